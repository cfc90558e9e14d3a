#include "sovo/vo/image_change.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sovo/vo/likeness.h"
#include "sovo/vo/lower_share.h"

namespace sovo {

namespace {

constexpr int kCellSide = 16;              ///< [px of the halved images]
constexpr double kWithTexture = 2.0;       ///< Contrast of a cell, in RMS of residuals.
constexpr int kFewestDifferent = 4;        ///< Cells that may be the world,
constexpr double kSomeDifferent = 0.07;    ///< and their share of those with texture;
constexpr double kMuchDifferent = 0.15;    ///< more than what passes by.
constexpr double kMostlyBack = 0.5;        ///< Share of it that looks as before when it is over.
constexpr std::size_t kFewestMoving = 20;  ///< In what is different, for its depth to be known.
constexpr double kFartherPoints = 0.1;     ///< Of what stays, as many points may be farther
constexpr double kOfWhatMoves = 0.5;       ///< than this share of what moves.

}  // namespace

ImageChange image_change(const ImagePyramid& before, const ImagePyramid& image, double rmse,
                         int halvings) {
  const int level = std::min(halvings, before.num_levels() - 1);
  const ImageF& a = before.level(level);
  const ImageF& b = image.level(level);
  // Noise falls to a half with each halving; what the first one takes is left to model errors.
  const double noise = std::ldexp(rmse, 1 - std::max(level, 1));
  const ImageCells cells(kCellSide << level, before.level(0).width(), before.level(0).height());
  ImageChange out{cells, ChosenCells(cells.size(), 0), ChosenCells(cells.size(), 0)};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Likeness l = likeness(a, b, cells.left(i) >> level, cells.top(i) >> level, kCellSide);
    if (!(l.contrast > kWithTexture * noise)) continue;
    ++out.textured;
    out.same[i] = l.is_same() ? 1 : 0;
    out.different[i] = l.is_different(noise) ? 1 : 0;
  }
  return out;
}

double ImageChange::share() const {
  const auto count = static_cast<double>(std::ranges::count(different, 1));
  return count < kFewestDifferent ? 0.0 : count / textured;
}

bool may_deny_rest(const ImageChange& change) { return change.share() > kSomeDifferent; }

bool denies_rest(const ImageChange& change, const ReferenceLevel& level) {
  if (change.share() < kMuchDifferent) return false;
  std::vector<float> staying, moving;  // inverse depths
  for (std::size_t i = 0; i < level.size(); ++i) {
    const std::size_t cell = change.cells.at(level.u[i], level.v[i]);
    if (change.same[cell] != 0) staying.push_back(level.rho[i]);
    if (change.different[cell] != 0) moving.push_back(level.rho[i]);
  }
  if (staying.empty() || moving.size() < kFewestMoving) return true;
  return lower_share(staying, kFartherPoints) >= lower_share(moving, kOfWhatMoves);
}

bool RestDenial::holds(const ImageChange& change, const ReferenceLevel& level,
                       std::uint32_t keyframe_id, int halvings) {
  if (keyframe_id_ != keyframe_id) clear();
  keyframe_id_ = keyframe_id;
  ChosenCells& different = different_.at(static_cast<std::size_t>(halvings - 1));
  if (denies_rest(change, level)) {
    different = change.different;
    return true;
  }
  double denied = 0.0;
  double back = 0.0;
  for (std::size_t i = 0; i < different.size(); ++i) {
    if (different[i] == 0) continue;
    denied += 1.0;
    back += change.same[i];
  }
  if (back >= kMostlyBack * denied) different.clear();
  return !different.empty();
}

}  // namespace sovo
