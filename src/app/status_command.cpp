#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/message_json.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo::app {
namespace {

using bridge::msg::VoStatus;

struct StatusOptions {
  bool once = false;
  bool json = false;
};

std::string text_or_dash(const char* text) { return text == nullptr || *text == '\0' ? "-" : text; }

std::string stage_lines(const VoStatus& s) {
  std::string text = fmt::format("{:<22}{:>9}{:>9}{:>9}\n", "stage [ms]", "last", "mean", "max");
  for (std::uint32_t i = 0; i < s.stages._length; ++i) {
    const auto& stage = s.stages._buffer[i];
    text += fmt::format("{:<22}{:>9.2f}{:>9.2f}{:>9.2f}\n", text_or_dash(stage.name), stage.last_ms,
                        stage.mean_ms, stage.max_ms);
  }
  return text;
}

std::string screen(const VoStatus& s) {
  const auto state = to_string(static_cast<OdometryState>(s.state));
  std::string text = fmt::format("state       {} ({})\n", state, text_or_dash(s.reason));
  text += fmt::format("frame       {} of session {:x}; latency {:.1f} ms, queue {}\n", s.sequence,
                      s.session, 1e3 * s.latency_s, s.queue_depth);
  text += fmt::format("received    {}; lost in transport {}, dropped {}, refused {}\n", s.received,
                      s.lost_transport, s.dropped_queue, s.rejected);
  text += fmt::format("map         segment {}, {} keyframes, {} points, {} inliers\n", s.segment,
                      s.keyframes, s.points, s.inliers);
  text += fmt::format("tracking    residual {:.2f} grey levels, pair error {:.3f} ms\n", s.residual,
                      1e3 * s.sync_error_s);
  text += fmt::format("distance    {:.2f} m, {} resets\n", s.distance_m, s.reset_counter);
  text +=
      fmt::format("command     {} {}\n\n", s.last_command_id, text_or_dash(s.last_command_result));
  return text + stage_lines(s);
}

void show(const VoStatus& status, const StatusOptions& options) {
  if (options.json) {
    std::cout << to_json(status).dump() << std::endl;
    return;
  }
  const bool redraw = !options.once && isatty(STDOUT_FILENO) == 1;
  std::cout << (redraw ? "\x1b[H\x1b[J" : "") << screen(status) << std::endl;
}

int watch(const AppConfig& config, const StatusOptions& options) {
  StopSignal stop;
  auto participant = bridge::Participant::open(config.dds, "status");
  if (!participant) return fail(kFailed, participant.error());
  auto reader = bridge::Reader<VoStatus>::open(*participant, bridge::topics::kStatus,
                                               bridge::topics::kStatusQos);
  if (!reader) return fail(kFailed, reader.error());

  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::seconds kPatience(5);
  auto last = Clock::now();
  auto last_shown = last - kPatience;
  while (!stop.requested()) {
    reader->wait(std::chrono::milliseconds(200));
    bool done = false;
    const auto taken = reader->take_each([&](const VoStatus& status, const auto&) {
      last = Clock::now();
      const bool due = options.json || last - last_shown > std::chrono::milliseconds(200);
      if (done || !due) return;
      show(status, options);
      last_shown = last;
      done = options.once;
    });
    if (!taken) return fail(kFailed, taken.error());
    if (done) return kOk;
    if (Clock::now() - last < kPatience) continue;
    const std::string silence = fmt::format(
        "nothing on {} for {} s; is sovo vo running, in the "
        "same domain and namespace?",
        reader->topic(), kPatience.count());
    if (options.once) return fail(kFailed, silence);
    spdlog::warn("{}", silence);
    last = Clock::now();
  }
  return kOk;
}

}  // namespace

void add_status_command(const Command& program) {
  const Command command = program.add_command("status", "Show the state of the odometry process");
  auto status = std::make_shared<StatusOptions>();
  command.flag("--once", "Show the next state and end", &status->once);
  command.flag("--json", "One line of JSON a state", &status->json);
  auto options = std::make_shared<ConfigOptions>(command);
  add_dds_options(*options);
  command.action([options, status] {
    const auto config = options->load();
    return config ? watch(*config, *status) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
