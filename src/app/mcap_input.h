#pragma once

#include "sovo/app/frame_input.h"

namespace sovo::app {

/// Opens the recording of the configuration (`camera.mcap`; `node.left` and `node.right` name its
/// image topics) and logs what is wrong with its files.
Result<FrameInput> open_mcap_input(const AppConfig& config);

}  // namespace sovo::app
