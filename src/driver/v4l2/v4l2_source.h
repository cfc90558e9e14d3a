#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/driver/live/live_options.h"
#include "sovo/driver/live/live_source.h"
#include "sovo/driver/v4l2/v4l2_options.h"
#include "sovo/io/calibration.h"

namespace sovo::v4l2 {

/// A stereo camera that was opened.
struct OpenedSource {
  std::unique_ptr<LiveSource> source;
  Calibration calibration;
  std::vector<std::string> notes;  ///< For people: what was assumed or is missing yet.
};

/// Whether the options make sense by themselves; `open_v4l2` asks already.
Result<void> check_options(const V4l2Options& options, const LiveOptions& live);

/// Looks the devices up, tries mode and controls, and starts the source. A device that is not there
/// yet is waited for; a wrong mode, control or calibration is an error that says what to do.
/// `calibration`: a file, or empty for the ZED's own in /usr/local/zed/settings.
Result<OpenedSource> open_v4l2(const V4l2Options& options, const LiveOptions& live,
                               const std::string& calibration);

}  // namespace sovo::v4l2
