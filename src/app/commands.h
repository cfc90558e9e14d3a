#pragma once

#include <CLI/CLI.hpp>

namespace sovo::app {

// Each function adds one subcommand to `app`; its callback does the work and sets `*exit_code`
// (see exit_codes.h), which must outlive the parsing.

void add_calib_command(CLI::App& app, int* exit_code);
void add_camera_command(CLI::App& app, int* exit_code);
void add_command_command(CLI::App& app, int* exit_code);
void add_config_command(CLI::App& app, int* exit_code);
void add_eval_command(CLI::App& app, int* exit_code);
void add_run_command(CLI::App& app, int* exit_code);
void add_status_command(CLI::App& app, int* exit_code);
void add_vo_command(CLI::App& app, int* exit_code);

}  // namespace sovo::app
