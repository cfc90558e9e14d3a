#pragma once

#include <vector>

#include "sovo/vo/pixel_selector.h"
#include "sovo/vo/window.h"

namespace sovo {

/// Which pixels of the newest keyframe the next one will still see, when the camera moves on as it
/// came from the keyframe before. Depths are those of the window's points nearby.
class ViewForecast {
 public:
  /// Everything stays in view of a window of one keyframe.
  explicit ViewForecast(const Window& window);

  /// True where no depth is known nearby.
  bool stays(int x, int y) const;

  /// Least share of the pixels that a forecast leaves: one that leaves fewer is not believed, for
  /// a camera that was knocked does not go on like that.
  static constexpr double kLeastShare = 0.4;

  /// True where all that is known nearby is so far that it hardly tells the way: it has less than a
  /// fifth of the window's mean inverse depth. False where nothing is known.
  bool is_far(int x, int y) const;

  /// Part of the pixels that may be far as long as there are others: they tell the turn, and for
  /// that few are enough.
  static constexpr double kFarShare = 0.25;

  /// Leaves those that stay, or all when they are fewer than kLeastShare, `wanted` at most, evenly
  /// taken, of which kFarShare may be far. Returns the share that is of use, kLeastShare at least.
  double keep_lasting(int wanted, std::vector<SelectedPixel>* pixels) const;

 private:
  static constexpr int kCell = 32;  ///< Side of what has one depth [px].

  void add(float x, float y, float rho);
  void add_host(const Keyframe& host, const PairGeometry* to_newest);
  void fill_gaps();

  int width_;
  int height_;
  int cells_x_;
  int cells_y_;
  Eigen::Matrix3f KRKi_ = Eigen::Matrix3f::Identity();
  Eigen::Vector3f Kt_ = Eigen::Vector3f::Zero();
  float far_rho_ = 0.0F;    ///< [1/m]
  std::vector<float> rho_;  ///< Of the farthest point of each cell [1/m]; infinite: of none.
  /// Of the nearest; infinite: of none. Gaps stay: with those next to them called far as well, a
  /// highway drifted by a third more in a version before.
  std::vector<float> nearest_rho_;
};

}  // namespace sovo
