#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/driver/live/colour.h"
#include "sovo/image/stereo_frame.h"

namespace sovo {

enum class CameraSide { kLeft, kRight };

/// An image with the times of its exposure.
struct TimedImage {
  std::int64_t time_ns = 0;    ///< Mid-exposure, by a clock that both cameras share.
  std::int64_t stamp_ns = 0;   ///< Mid-exposure, UTC.
  double stamp_sigma_s = 0.0;  ///< Standard deviation of `stamp_ns`.
  std::uint64_t sequence = 0;  ///< Counts every image that the camera made.
  std::uint8_t clock = 0;      ///< As `StereoFrame::clock`.
  SideImage image;
  ColourImage colour;  ///< Of `image`, where it was kept.
};

/// A left image and, when it has one, the right image of the same instant.
struct StereoPair {
  TimedImage left;
  std::optional<TimedImage> right;
};

struct PairerCounts {
  std::uint64_t pairs = 0;
  std::uint64_t unpaired_left = 0;   ///< Given without a right image.
  std::uint64_t unpaired_right = 0;  ///< Dropped.
  std::uint64_t out_of_order = 0;    ///< Dropped: not later than the one before it.
};

/// Joins the images of two cameras by the time of their exposure. When they arrive does not matter,
/// and frame numbers are not looked at: cameras start and skip at different ones.
///
/// Images of a side must come in order. Pairs leave in order. A left image waits for its right one
/// until a later right image or `max_waiting` more left ones have come; it then leaves alone.
class StereoPairer {
 public:
  /// `tolerance_ns`: largest time between the exposures of a pair.
  explicit StereoPairer(std::int64_t tolerance_ns, std::size_t max_waiting = 3);

  void add(CameraSide side, TimedImage image);

  /// The next pair, or lone left image, that is certain.
  std::optional<StereoPair> next();

  /// Forgets what waits, counted as unpaired, and the order: a clock was set.
  void restart();

  const PairerCounts& counts() const { return counts_; }

 private:
  StereoPair take_pair();
  StereoPair take_left();
  void drop_right();

  std::int64_t tolerance_ns_;
  std::size_t max_waiting_;
  std::vector<TimedImage> left_;  ///< Oldest first, a few; as is `right_`.
  std::vector<TimedImage> right_;
  std::optional<std::int64_t> last_left_ns_;
  std::optional<std::int64_t> last_right_ns_;
  PairerCounts counts_;
};

}  // namespace sovo
