#pragma once

#include <chrono>
#include <optional>
#include <string>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/stereo_frame.h"

namespace sovo {

/// Why a source gave no frame.
enum class SourceState {
  kFrame,        ///< A frame was given.
  kTimeout,      ///< None came in time; more may follow.
  kEndOfStream,  ///< There will be no more.
  kBadFrame,     ///< A frame was lost or unreadable; `message` says which and why. More may follow.
  kFailed,       ///< The source is broken; `message` says what to do.
};

struct SourceResult {
  SourceState state = SourceState::kTimeout;
  StereoFrame frame;    ///< Valid with kFrame.
  std::string message;  ///< For people: what is wrong and what to do.
};

/// A stream of synchronized stereo pairs: camera, dataset, recording or simulator.
class FrameSource {
 public:
  virtual ~FrameSource() = default;

  /// The calibration of the pairs, with raw (distorted) cameras.
  virtual const StereoRig& rig() const = 0;

  /// The next pair, waiting at most `timeout`.
  virtual SourceResult next(std::chrono::milliseconds timeout) = 0;

  /// How many pairs there will be, when that is known.
  virtual std::optional<std::size_t> size() const { return std::nullopt; }
};

}  // namespace sovo
