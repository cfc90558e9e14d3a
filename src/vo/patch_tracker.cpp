#include "sovo/vo/patch_tracker.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sovo {
namespace {

/// d pixel' / d pixel of the mapping that a rotation causes, and the mapped pixel.
bool rotate_pixel(const CameraModel& camera, const SO3& R, float u, float v, float* u1, float* v1,
                  PatchWarp* warp) {
  const Vec3 ray((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
  const Mat3 r = R.matrix();
  const Vec3 p = r * ray;
  if (p.z() < 0.1) return false;
  const double x = p.x() / p.z();
  const double y = p.y() / p.z();
  *u1 = static_cast<float>(camera.fx * x + camera.cx);
  *v1 = static_cast<float>(camera.fy * y + camera.cy);
  if (warp == nullptr) return true;
  PatchWarp& A = *warp;
  const double aspect = camera.fx / camera.fy;
  A[0] = static_cast<float>((r(0, 0) - x * r(2, 0)) / p.z());
  A[1] = static_cast<float>((r(0, 1) - x * r(2, 1)) / p.z() * aspect);
  A[2] = static_cast<float>((r(1, 0) - y * r(2, 0)) / p.z() / aspect);
  A[3] = static_cast<float>((r(1, 1) - y * r(2, 1)) / p.z());
  return true;
}

}  // namespace

void PatchTracker::set_first(ImagePyramidPtr pyramid, const CameraModel& pinhole,
                             const std::vector<Position>& candidates) {
  first_ = std::move(pyramid);
  camera_ = pinhole;
  gain_ = 1.0F;
  struct Ranked {
    float eigenvalue;
    std::size_t index;
  };
  std::vector<Ranked> ranked;
  AlignmentPatch patch;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Position& p = candidates[i];
    if (!make_patch(first_->level(0), p.u, p.v, kNoWarp, &patch)) continue;
    if (patch.min_eigenvalue < static_cast<float>(config_.min_eigenvalue)) continue;
    ranked.push_back({patch.min_eigenvalue, i});
  }
  std::stable_sort(ranked.begin(), ranked.end(),
                   [](const Ranked& a, const Ranked& b) { return a.eigenvalue > b.eigenvalue; });
  if (ranked.size() > static_cast<std::size_t>(config_.max_tracks)) {
    ranked.resize(static_cast<std::size_t>(config_.max_tracks));
  }
  tracks_.clear();
  for (const Ranked& r : ranked) {
    const Position& p = candidates[r.index];
    tracks_.push_back({p.u, p.v, p.u, p.v, true, 1.0F});
  }
}

int PatchTracker::num_followed() const {
  return static_cast<int>(std::count_if(tracks_.begin(), tracks_.end(),
                                        [](const PatchTrack& t) { return t.followed; }));
}

void PatchTracker::track(const ImagePyramid& pyramid, const SO3& R_new_last,
                         const SO3& R_new_first) {
  contrasts_.clear();
  const PatchAlignmentConfig alignment{.levels = config_.coarsest_level + 1,
                                       .max_iterations = config_.max_iterations,
                                       .min_zncc = static_cast<float>(config_.min_zncc)};
  for (PatchTrack& t : tracks_) {
    t.followed = false;
    float u = 0.0F, v = 0.0F;
    PatchWarp warp;
    if (!rotate_pixel(camera_, R_new_first, t.u0, t.v0, &u, &v, &warp)) continue;
    if (!rotate_pixel(camera_, R_new_last, t.u, t.v, &t.u, &t.v, nullptr)) continue;
    const PatchMatch match =
        find_patch({first_.get(), t.u0, t.v0}, pyramid, warp, t.u, t.v, alignment);
    t.zncc = match.zncc;
    t.followed = match.found;
    if (!match.found) continue;
    t.u = match.u;
    t.v = match.v;
    contrasts_.push_back(match.contrast);
  }
  if (contrasts_.size() < 10) return;
  const auto middle = contrasts_.begin() + static_cast<std::ptrdiff_t>(contrasts_.size() / 2);
  std::nth_element(contrasts_.begin(), middle, contrasts_.end());
  gain_ = std::clamp(*middle, 0.2F, 5.0F);
}

}  // namespace sovo
