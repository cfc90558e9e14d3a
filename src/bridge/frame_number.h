#pragma once

#include <cstdint>
#include <optional>

#include "sovo/bridge/cdr_sertype.h"

namespace sovo::bridge {

/// Which frame a serialized StereoFrame is.
struct FrameNumber {
  std::uint64_t session = 0;
  std::uint64_t sequence = 0;
};

/// Reads only what stands before the images; nothing when that is cut.
std::optional<FrameNumber> frame_number(CdrBytes stereo_frame);

}  // namespace sovo::bridge
