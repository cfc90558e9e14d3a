#pragma once

#include "sovo/app/frame_input.h"

namespace sovo::app {

/// Opens the recording of the configuration (`camera.mcap`) and logs what is wrong with its files.
Result<FrameInput> open_mcap_input(const CameraSection& camera);

}  // namespace sovo::app
