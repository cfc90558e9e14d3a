#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/driver/aravis/aravis_options.h"
#include "sovo/driver/live/live_options.h"
#include "sovo/driver/live/live_source.h"
#include "sovo/io/calibration.h"

namespace sovo::aravis {

/// A pair of GigE Vision cameras that was opened.
struct OpenedSource {
  std::unique_ptr<LiveSource> source;
  Calibration calibration;
  std::vector<std::string> notes;  ///< For people: what was assumed or is missing yet.
};

/// Whether the options make sense by themselves; `open_aravis` asks already.
Result<void> check_options(const AravisOptions& options, const LiveOptions& live);

/// Looks the cameras up, tries their settings, and starts the source. A camera that is not there
/// yet is waited for; a wrong feature, size or calibration is an error that says what to do.
Result<OpenedSource> open_aravis(const AravisOptions& options, const LiveOptions& live,
                                 const std::string& calibration);

}  // namespace sovo::aravis
