#include "sovo/vo/image_change.h"

#include <algorithm>
#include <vector>

#include "sovo/vo/likeness.h"
#include "sovo/vo/lower_share.h"

namespace sovo {

namespace {

constexpr int kCellSide = 32;              ///< [px]
constexpr double kWithTexture = 2.0;       ///< Contrast of a cell, in RMS of residuals.
constexpr int kFewestDifferent = 4;        ///< Cells that may be the world,
constexpr double kSomeDifferent = 0.07;    ///< and their share of those with texture;
constexpr double kMuchDifferent = 0.15;    ///< more than what passes by.
constexpr std::size_t kFewestMoving = 20;  ///< In what is different, for its depth to be known.
constexpr double kFartherPoints = 0.1;     ///< Of what stays, as many points may be farther
constexpr double kOfWhatMoves = 0.5;       ///< than this share of what moves.

}  // namespace

ImageChange image_change(const ImagePyramid& before, const ImagePyramid& image, double rmse) {
  const int level = before.num_levels() > 1 ? 1 : 0;
  const ImageF& a = before.level(level);
  const ImageF& b = image.level(level);
  const ImageCells cells(kCellSide, before.level(0).width(), before.level(0).height());
  ImageChange out{cells, ChosenCells(cells.size(), 0), ChosenCells(cells.size(), 0)};
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Likeness l =
        likeness(a, b, cells.left(i) >> level, cells.top(i) >> level, kCellSide >> level);
    if (!(l.contrast > kWithTexture * rmse)) continue;
    ++out.textured;
    out.same[i] = l.is_same() ? 1 : 0;
    out.different[i] = l.is_different(rmse) ? 1 : 0;
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

}  // namespace sovo
