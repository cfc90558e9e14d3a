#pragma once

#include "sovo/app/command.h"

namespace sovo::app {

/// Subcommands of `sovo camera` for real cameras: `v4l2`, `aravis` and `list`.
void add_live_camera_commands(const Command& camera);

}  // namespace sovo::app
