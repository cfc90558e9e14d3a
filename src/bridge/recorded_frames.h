#pragma once

#include <memory>
#include <string>

#include "sovo/driver/frame_source.h"
#include "sovo/io/recording.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::bridge {

/// Which topics of a recording are the stereo frames.
struct RecordedFramesConfig {
  std::string left;  ///< Image topics; both empty: StereoFrame, else what is named as a pair.
  std::string right;
  double pair_tolerance_s = 0.005;  ///< Largest difference of the stamps of two images.
};

/// The stereo frames of a recording, in the order in which they were received.
class RecordedFrames {
 public:
  virtual ~RecordedFrames() = default;

  /// The frames of the only StereoFrame topic, or those paired of two image topics. They read
  /// `recording`, which must outlive them.
  static Result<std::unique_ptr<RecordedFrames>> open(Recording& recording,
                                                      const RecordedFramesConfig& config);

  /// Topics that the frames come from, for people.
  virtual std::string about() const = 0;
  /// How many there are, those that cannot be used counted too.
  virtual std::size_t size() const = 0;
  /// The calibration that was recorded with them; `rewind` afterwards.
  virtual Result<StereoCameras> calibration() = 0;
  /// Goes to the first frame.
  virtual void rewind() = 0;
  /// kFrame, kBadFrame or kEndOfStream.
  virtual SourceResult next() = 0;
};

}  // namespace sovo::bridge
