#include "sovo/vo/staying_cells.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "sovo/image/interpolation.h"
#include "sovo/vo/lower_share.h"
#include "sovo/vo/point_transfer.h"

namespace sovo {

namespace {

constexpr int kFewestPoints = 2;     ///< That make a cell one that stays.
constexpr double kFarthest = 0.1;    ///< Of what stays, as many points may be farther
constexpr double kOfTheRest = 0.5;   ///< than this share of the rest.
constexpr float kMuchNearer = 1.5F;  ///< Than the rest, by the medians of inverse depths.

/// Gradient of an image at a pixel that is not at its edge [grey levels/px].
double gradient_at(const ImageF& image, int x, int y) {
  return 0.5 * std::hypot(image.at(x + 1, y) - image.at(x - 1, y),
                          image.at(x, y + 1) - image.at(x, y - 1));
}

/// What an image shows in a point's place.
struct InPlace {
  double change = 0.0;    ///< From what the reference lets expect there [grey levels].
  double gradient = 0.0;  ///< [grey levels/px]
};

InPlace in_place(const ReferenceLevel& level, std::size_t i, const ImageF& image,
                 const BrightnessTransfer& transfer) {
  const int x = static_cast<int>(level.u[i]);
  const int y = static_cast<int>(level.v[i]);
  const double expected = transfer.gain * static_cast<double>(level.colour[i]) + transfer.bias;
  return {std::abs(static_cast<double>(image.at(x, y)) - expected), gradient_at(image, x, y)};
}

/// How far a motion moves each point of a level; infinitely those that come to lie behind [px].
std::vector<float> displacements(const ReferenceLevel& level, const SE3& T) {
  const PointTransfer transfer(level.camera, T);
  std::vector<float> out;
  out.reserve(level.size());
  for (std::size_t i = 0; i < level.size(); ++i) {
    const Eigen::Vector3f at = transfer(level, i);
    const Eigen::Vector2f p(level.u[i], level.v[i]);
    out.push_back(at.z() > 0.0F ? (at.hnormalized() - p).norm()
                                : std::numeric_limits<float>::infinity());
  }
  return out;
}

/// Keeps the points of a level for which `wanted` is true of their index.
template <class Wanted>
void keep_if(ReferenceLevel* level, Wanted&& wanted) {
  const auto all = {&level->u, &level->v, &level->rho, &level->colour, &level->weight};
  const std::size_t size = level->size();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < size; ++i) {
    if (!wanted(i)) continue;
    for (auto* values : all) (*values)[kept] = (*values)[i];
    ++kept;
  }
  for (auto* values : all) values->resize(kept);
}

}  // namespace

ChosenCells staying_cells(const CoMovingConfig& config, const ImageCells& cells,
                          const TrackingReference& reference, const ImageF& image,
                          const BrightnessTransfer& transfer) {
  const ReferenceLevel& level = reference.levels[0];
  std::vector<double> changes(cells.size(), 0.0);  // squared
  std::vector<double> gradients(cells.size(), 0.0);
  std::vector<int> points(cells.size(), 0);
  for (std::size_t i = 0; i < level.size(); ++i) {
    // The rows of a rolling shutter may have moved a point beyond the image.
    if (!in_image(image, level.u[i], level.v[i], 2.0F)) continue;
    const InPlace seen = in_place(level, i, image, transfer);
    if (!(seen.gradient > config.min_gradient)) continue;
    const std::size_t cell = cells.at(level.u[i], level.v[i]);
    changes[cell] += seen.change * seen.change;
    gradients[cell] += seen.gradient * seen.gradient;
    ++points[cell];
  }
  const auto stays = [&](std::size_t i) {
    return changes[i] < config.stays_below * config.stays_below * gradients[i];
  };
  ChosenCells sure(cells.size(), 0);
  for (std::size_t i = 0; i < sure.size(); ++i) {
    sure[i] = points[i] >= kFewestPoints && stays(i) ? 1 : 0;
  }
  // A single point may stay by chance, but hardly beside others.
  ChosenCells chosen = sure;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (points[i] > 0 && stays(i) && cells.beside(i, sure)) chosen[i] = 1;
  }
  return chosen;
}

bool stays_nearer(const ImageCells& cells, const TrackingReference& reference,
                  const ChosenCells& staying) {
  const ReferenceLevel& level = reference.levels[0];
  std::vector<float> stay, rest;  // inverse depths
  for (std::size_t i = 0; i < level.size(); ++i) {
    (staying[cells.at(level.u[i], level.v[i])] != 0 ? stay : rest).push_back(level.rho[i]);
  }
  return !stay.empty() && !rest.empty() &&
         lower_share(std::move(stay), 0.5) > kMuchNearer * lower_share(std::move(rest), 0.5);
}

ChosenCells co_moving_cells(const CoMovingConfig& config, const ImageCells& cells,
                            const TrackingReference& reference, const SE3& T_current_reference,
                            const ChosenCells& staying) {
  const ReferenceLevel& level = reference.levels[0];
  const std::vector<float> moved = displacements(level, T_current_reference);
  std::vector<float> along, rest;  // inverse depths
  std::vector<int> balance(cells.size(), 0);
  for (std::size_t i = 0; i < level.size(); ++i) {
    const std::size_t cell = cells.at(level.u[i], level.v[i]);
    if (staying[cell] == 0) {
      rest.push_back(level.rho[i]);
    } else if (moved[i] > static_cast<float>(config.min_displacement)) {
      along.push_back(level.rho[i]);
      ++balance[cell];
    } else {
      --balance[cell];
    }
  }
  ChosenCells chosen(cells.size(), 0);
  if (along.empty() || rest.empty()) return chosen;
  if (lower_share(along, kFarthest) < lower_share(rest, kOfTheRest)) return chosen;
  for (std::size_t i = 0; i < chosen.size(); ++i) chosen[i] = balance[i] > 0 ? 1 : 0;
  return chosen;
}

TrackingReference without(const TrackingReference& reference, const ImageCells& cells,
                          const ChosenCells& chosen) {
  TrackingReference out = reference;
  float pixel = 1.0F;  // of the level, in pixels of the image
  for (ReferenceLevel& level : out.levels) {
    keep_if(&level, [&, &points = level](std::size_t i) {
      return chosen[cells.at(pixel * (points.u[i] + 0.5F), pixel * (points.v[i] + 0.5F))] == 0;
    });
    pixel *= 2.0F;
  }
  return out;
}

TrackingReference without_hidden(const TrackingReference& reference, const ImageCells& cells,
                                 const ChosenCells& chosen, const SE3& T_current_reference) {
  TrackingReference out = reference;
  float pixel = 1.0F;
  for (ReferenceLevel& level : out.levels) {
    const PointTransfer transfer(level.camera, T_current_reference);
    keep_if(&level, [&, &points = level](std::size_t i) {
      const Eigen::Vector3f at = transfer(points, i);
      if (!(at.z() > 0.0F)) return true;
      const Eigen::Vector2f place = pixel * (at.hnormalized() + Eigen::Vector2f(0.5F, 0.5F));
      return !cells.covers(place.x(), place.y()) || chosen[cells.at(place.x(), place.y())] == 0;
    });
    pixel *= 2.0F;
  }
  return out;
}

}  // namespace sovo
