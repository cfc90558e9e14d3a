#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sovo/app/app_config.h"
#include "sovo/driver/live/live_source.h"
#include "sovo/io/calibration.h"
#include "sovo/io/result.h"

namespace sovo::app {

/// A real camera that was opened.
struct LiveInput {
  std::unique_ptr<LiveSource> source;
  Calibration calibration;
  std::vector<std::string> notes;  ///< For the log.
};

/// Publishes a real camera until the user ends it or `camera.frames` were sent; returns an exit
/// code. `open` is called when the signals are taken care of.
int publish_live(const AppConfig& config, const std::function<Result<LiveInput>()>& open);

}  // namespace sovo::app
