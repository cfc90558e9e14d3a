#pragma once

#include "sovo/app/command.h"

namespace sovo::app {

// Each function adds one subcommand to the program's commands.

void add_bench_command(const Command& program);
void add_calib_command(const Command& program);
void add_camera_command(const Command& program);
void add_command_command(const Command& program);
void add_config_command(const Command& program);
void add_convert_command(const Command& program);
void add_dashboard_command(const Command& program);
void add_doctor_command(const Command& program);
void add_eval_command(const Command& program);
void add_record_command(const Command& program);
void add_recover_command(const Command& program);
void add_replay_command(const Command& program);
void add_replay_test_command(const Command& program);
void add_report_command(const Command& program);
void add_run_command(const Command& program);
void add_status_command(const Command& program);
void add_topic_command(const Command& program);
void add_vo_command(const Command& program);

}  // namespace sovo::app
