#include <memory>
#include <string>
#include <thread>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/frame_input.h"
#include "sovo/app/replayer.h"
#include "sovo/app/stop_signal.h"
#include "sovo/app/terminal_line.h"

namespace sovo::app {
namespace {

/// What is sent when the process ends would be lost with it.
constexpr std::chrono::milliseconds kLastWords(500);

int replay(const AppConfig& config) {
  const ReplaySection& section = config.replay;
  if (section.path.empty()) return fail(kUsage, "no recording given: sovo replay FOLDER");
  const auto rate = parse_rate(section.rate, 1.0);
  if (!rate) return fail(kUsage, "--rate is '" + section.rate + "'; it must be a number, or max");
  StopSignal stop_signal;  // before the threads of the bus
  const auto stop = [&stop_signal] { return stop_signal.requested(); };
  auto participant = bridge::Participant::open(config.dds, "replay");
  if (!participant) return fail(kFailed, participant.error());
  for (const std::string& note : participant->notes()) spdlog::info("{}", note);
  auto replayer = Replayer::open(*participant, section, *rate);
  if (!replayer) return fail(kBadInput, replayer.error());
  for (const std::string& note : (*replayer)->notes()) spdlog::warn("{}", note);
  TerminalLine line;
  Replayer::State state;
  do {
    const auto played = (*replayer)->play(stop, [&](const Replayer::State& now) {
      state = now;
      const double left = (now.duration_s - now.position_s) / (*rate > 0.0 ? *rate : 1.0);
      line.show(fmt::format("{:.1f} of {:.1f} s  {:.0f} s left  {} messages", now.position_s,
                            now.duration_s, left, now.published));
    });
    if (!played) return fail(kFailed, played.error());
  } while (section.loop && !stop());
  std::this_thread::sleep_for(kLastWords);
  spdlog::info("published {} messages of {} topics; {} left out", state.published,
               (*replayer)->num_topics(), state.left_out);
  return kOk;
}

}  // namespace

void add_replay_command(const Command& program) {
  const Command command = program.add_command("replay", "Play a recording back on the bus");
  auto options = std::make_shared<ConfigOptions>(command);
  options->value("recording", "replay.path", "Folder or .mcap file", "DIR|FILE")
      .value("--rate", "replay.rate", "Speed: 1 is real time, max as fast as the odometry", "X|max")
      .value("--start", "replay.start", "Left out at the beginning [s]", "S")
      .value("--left", "replay.left", "Image topic of the left camera, when names do not say",
             "TOPIC")
      .value("--right", "replay.right", "That of the right camera", "TOPIC")
      .flag("--loop", "replay.loop", "Begin again at the end")
      .flag("--all", "replay.all", "Also what a live odometry writes, and recorded commands");
  add_dds_options(*options);
  command.action([options] {
    const auto config = options->load();
    return config ? replay(*config) : fail(kUsage, config.error());
  });
}

}  // namespace sovo::app
