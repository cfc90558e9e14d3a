#pragma once

#include "sovo/app/command.h"

namespace sovo::app {

/// Adds `refine` to the subcommands of `sovo calib`.
void add_calib_refine_command(const Command& calib);

}  // namespace sovo::app
