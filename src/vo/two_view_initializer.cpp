#include "sovo/vo/two_view_initializer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "sovo/vo/image_rotation.h"
#include "sovo/vo/median.h"

namespace sovo {
namespace {

constexpr double kDegree = std::numbers::pi / 180.0;
constexpr int kRotationAlignmentWidth = 120;  // the widest level that rotation is aligned on [px]

/// A pixel whose inverse depth is known.
struct KnownDepth {
  float u, v, inverse_depth;
};

/// Median of the inverse depths of the `count` nearest known pixels, itself left out.
float neighbourhood_depth(const std::vector<KnownDepth>& known, float u, float v,
                          std::size_t count) {
  std::vector<std::pair<float, float>> nearest;  // squared distance, inverse depth
  nearest.reserve(known.size());
  for (const KnownDepth& k : known) {
    const float distance = (k.u - u) * (k.u - u) + (k.v - v) * (k.v - v);
    if (distance > 0.25F) nearest.emplace_back(distance, k.inverse_depth);
  }
  const std::size_t n = std::min(count, nearest.size());
  std::partial_sort(nearest.begin(), nearest.begin() + static_cast<std::ptrdiff_t>(n),
                    nearest.end());
  std::vector<float> depths;
  for (std::size_t i = 0; i < n; ++i) depths.push_back(nearest[i].second);
  return median(&depths);
}

void set_expected_depths(std::vector<TwoViewPoint>* points, std::size_t count) {
  std::vector<KnownDepth> known;
  for (const TwoViewPoint& p : *points) {
    if (p.good) known.push_back({p.u, p.v, p.inverse_depth});
  }
  for (TwoViewPoint& p : *points) {
    if (p.good) p.expected = neighbourhood_depth(known, p.u, p.v, count);
  }
}

}  // namespace

TwoViewInitializer::TwoViewInitializer(const TwoViewInitializerConfig& config)
    : config_(config), tracker_(config.tracker) {}

bool TwoViewInitializer::set_first(std::int64_t stamp_ns, ImagePyramidPtr pyramid,
                                   const CameraModel& pinhole, const ImageU8* mask,
                                   PixelSelector* selector) {
  camera_ = pinhole;
  mask_ = mask != nullptr ? *mask : ImageU8();
  first_ = std::move(pyramid);
  last_ = first_;
  frames_ = 0;
  lost_frames_ = 0;
  R_last_first_ = R_last_step_ = SO3();
  T_last_first_ = SE3();
  result_ = TwoViewResult();
  result_.first_stamp_ns = stamp_ns;
  selector->select(*first_, mask, config_.wanted_points, &pixels_);
  std::vector<PatchTracker::Position> candidates;
  candidates.reserve(pixels_.size());
  for (const SelectedPixel& p : pixels_) {
    candidates.push_back({static_cast<float>(p.x), static_cast<float>(p.y)});
  }
  tracker_.set_first(first_, camera_, candidates);
  const int patches = static_cast<int>(tracker_.tracks().size());
  const bool enough = patches >= config_.min_matches;
  reason_ = enough ? "no frame followed the first one"
                   : "too little texture, only " + std::to_string(patches) +
                         " patches of the image can be followed";
  return enough;
}

TwoViewInitializer::Status TwoViewInitializer::track(std::int64_t stamp_ns,
                                                     const ImagePyramidPtr& pyramid) {
  ++frames_;
  const SO3 R_new_last = predict_rotation(*pyramid);
  const SO3 R_predicted = R_new_last * R_last_first_;
  tracker_.track(*pyramid, R_new_last, R_predicted);
  last_ = pyramid;
  R_last_step_ = R_new_last;
  T_last_first_ = SE3(R_new_last, Vec3::Zero()) * T_last_first_;
  R_last_first_ = R_predicted;
  collect_matches();
  if (static_cast<int>(matches_.size()) < config_.min_matches) {
    ++lost_frames_;
    reason_ = "too few patches of the first frame are seen again";
    return give_up_or_wait();
  }
  lost_frames_ = 0;

  double rotation_cost = 0.0, parallax_px = 0.0;
  R_last_first_ = estimate_rotation(matches_, camera_.fx, R_predicted,
                                    5.0 * config_.epipolar.inlier_px, &rotation_cost, &parallax_px);
  if (!geometry_suffices(rotation_cost, parallax_px)) return give_up_or_wait();
  result_.newest_stamp_ns = stamp_ns;
  return make_points(*pyramid) ? Status::kReady : give_up_or_wait();
}

TwoViewInitializer::Status TwoViewInitializer::give_up_or_wait() {
  return frames_ >= config_.max_frames || lost_frames_ >= config_.max_lost_frames ? Status::kFailed
                                                                                  : Status::kNotYet;
}

/// Rotation since the last frame: the better of no motion and the last one, aligned at a coarse
/// level.
SO3 TwoViewInitializer::predict_rotation(const ImagePyramid& pyramid) const {
  int level = 0;
  while (level + 1 < pyramid.num_levels() && pyramid[level].width() > kRotationAlignmentWidth) {
    ++level;
  }
  const CameraModel camera = camera_.at_level(level);
  SO3 still, moving;
  const double error_still = align_rotation((*last_)[level], pyramid[level], camera, SO3(), &still);
  const double error_moving =
      align_rotation((*last_)[level], pyramid[level], camera, R_last_step_, &moving);
  return error_moving < error_still ? moving : still;
}

void TwoViewInitializer::collect_matches() {
  matches_.clear();
  match_positions_.clear();
  for (const PatchTrack& t : tracker_.tracks()) {
    if (!t.followed) continue;
    if (!mask_.empty() &&
        mask_.at(static_cast<int>(t.u + 0.5F), static_cast<int>(t.v + 0.5F)) == 0) {
      continue;
    }
    matches_.push_back({(t.u0 - camera_.cx) / camera_.fx, (t.v0 - camera_.cy) / camera_.fy,
                        (t.u - camera_.cx) / camera_.fx, (t.v - camera_.cy) / camera_.fy});
    match_positions_.push_back({t.u0, t.v0});
  }
}

/// Whether the patches show a translation, and well enough to give depths.
bool TwoViewInitializer::geometry_suffices(double rotation_cost, double parallax_px) {
  const double f = camera_.fx;
  if (parallax_px < config_.min_parallax_deg * kDegree * f) {
    reason_ = "too little parallax";
    return false;
  }
  const SE3 start(
      T_last_first_.translation().norm() > 0.5 ? T_last_first_.rotation() : R_last_first_,
      T_last_first_.translation());
  pose_ = estimate_epipolar_pose(matches_, f, start, static_cast<std::uint32_t>(frames_),
                                 config_.epipolar);
  if (!pose_.valid ||
      pose_.inliers < config_.min_inlier_share * static_cast<double>(matches_.size())) {
    reason_ = "no epipolar geometry explains the patches";
    return false;
  }
  T_last_first_ = pose_.T_1_0;
  R_last_first_ = pose_.T_1_0.rotation();
  if (rotation_cost < config_.rotation_cost_ratio * pose_.cost) {
    reason_ = "rotation alone explains the patches";
    return false;
  }
  if (pose_.direction_sigma > config_.max_direction_deg * kDegree) {
    reason_ = "the direction of the translation is uncertain";
    return false;
  }
  int in_front = 0;
  std::vector<double> errors;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    if (pose_.is_inlier[i] == 0) continue;
    double sigma = 0.0;
    const double rho = triangulate_inverse_depth(matches_[i], pose_.T_1_0, f, &sigma);
    if (sigma > 0.0 && rho > -sigma) ++in_front;
    errors.push_back(sigma > 0.0 && rho > 0.0 ? 0.5 * sigma / rho : 1.0);
  }
  if (in_front < config_.min_in_front * pose_.inliers) {
    reason_ = "points lie behind the camera";
    return false;
  }
  if (median(&errors) > config_.max_depth_error) {
    reason_ = "depths are uncertain";
    return false;
  }
  return true;
}

/// Depths for all selected pixels, adjusted photometrically together with the pose.
bool TwoViewInitializer::make_points(const ImagePyramid& pyramid) {
  TwoViewState state;
  state.T_1_0 = pose_.T_1_0;
  state.a = tracker_.gain();
  std::vector<double> offsets;
  for (const PatchTrack& t : tracker_.tracks()) {
    if (!t.followed) continue;
    const int x0 = static_cast<int>(t.u0 + 0.5F), y0 = static_cast<int>(t.v0 + 0.5F);
    const int x1 = static_cast<int>(t.u + 0.5F), y1 = static_cast<int>(t.v + 0.5F);
    offsets.push_back(pyramid[0].at(x1, y1) - state.a * (*first_)[0].at(x0, y0));
  }
  state.b = median(&offsets);
  std::vector<TwoViewPoint> points;
  give_depths(pyramid, state, &points);
  double rms = refine_two_views(*first_, pyramid, camera_, config_.refinement, 1, &state, &points);
  if (std::isfinite(rms)) {
    set_expected_depths(&points, 10);
    for (TwoViewPoint& p : points) {
      if (!p.good || p.energy <= config_.max_energy) continue;
      p.good = search_inverse_depth((*first_)[0], pyramid[0], camera_, state, 0.5F * p.expected,
                                    2.0F * p.expected, &p);
    }
    rms = refine_two_views(*first_, pyramid, camera_, config_.refinement, 0, &state, &points);
  }
  return finish(rms, state, points);
}

/// Triangulated depths where a patch was followed; elsewhere a search along the epipolar line
/// around the neighbours' depth.
void TwoViewInitializer::give_depths(const ImagePyramid& pyramid, const TwoViewState& state,
                                     std::vector<TwoViewPoint>* points) const {
  std::vector<KnownDepth> known;
  for (std::size_t i = 0; i < matches_.size(); ++i) {
    if (pose_.is_inlier[i] == 0) continue;
    double sigma = 0.0;
    const double rho = triangulate_inverse_depth(matches_[i], state.T_1_0, camera_.fx, &sigma);
    if (sigma <= 0.0 || rho < -sigma) continue;
    known.push_back({match_positions_[i].u, match_positions_[i].v,
                     static_cast<float>(std::max(rho, 0.1 * sigma))});
  }
  for (const SelectedPixel& pixel : pixels_) {
    TwoViewPoint p;
    p.u = static_cast<float>(pixel.x);
    p.v = static_cast<float>(pixel.y);
    p.expected = neighbourhood_depth(known, p.u, p.v, 5);
    const auto own = std::find_if(known.begin(), known.end(),
                                  [&](const KnownDepth& k) { return k.u == p.u && k.v == p.v; });
    if (own != known.end()) {
      p.inverse_depth = own->inverse_depth;
    } else if (!search_inverse_depth((*first_)[0], pyramid[0], camera_, state, 0.4F * p.expected,
                                     2.5F * p.expected, &p)) {
      continue;
    }
    points->push_back(p);
  }
}

bool TwoViewInitializer::finish(double rms, const TwoViewState& state,
                                const std::vector<TwoViewPoint>& points) {
  if (!(rms <= config_.max_rms)) {
    reason_ = "the photometric residual is too large";
    return false;
  }
  const double noise = std::max(rms * rms, 9.0);
  double sum = 0.0;
  result_.points.clear();
  for (const TwoViewPoint& p : points) {
    if (!p.good || p.energy > config_.max_energy || p.information <= 0.0F) continue;
    const float sigma = static_cast<float>(std::sqrt(noise / p.information));
    if (sigma > p.inverse_depth) continue;
    result_.points.push_back({p.u, p.v, p.inverse_depth, sigma});
    sum += p.inverse_depth;
  }
  if (static_cast<double>(result_.points.size()) <
      config_.min_points_share * static_cast<double>(pixels_.size())) {
    reason_ = "too few points have a depth";
    return false;
  }
  const double mean = sum / static_cast<double>(result_.points.size());
  result_.T_newest_first = state.T_1_0;
  result_.T_newest_first.translation() *= mean;
  for (InitialPoint& p : result_.points) {
    p.inverse_depth /= static_cast<float>(mean);
    p.sigma /= static_cast<float>(mean);
  }
  result_.a = state.a;
  result_.b = state.b;
  result_.rms = rms;
  reason_.clear();
  return true;
}

}  // namespace sovo
