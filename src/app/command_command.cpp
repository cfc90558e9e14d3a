#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <thread>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"
#include "sovo/bridge/writer.h"

namespace sovo::app {
namespace {

using bridge::msg::VoCommand;
using bridge::msg::VoStatus;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kAnswerPatience(5);

/// A command without a pose: a reset keeps the last one.
VoCommand make_command(std::uint8_t what) {
  std::random_device device;
  VoCommand command{};
  command.stamp = bridge::to_message(dds_time());
  command.id = (std::uint64_t{device()} << 32) | device();
  command.command = what;
  return command;
}

/// Waits for the status that echoes the command's id; its result.
Result<std::string> wait_for_answer(bridge::Reader<VoStatus>& statuses, std::uint64_t id) {
  const auto begin = Clock::now();
  std::optional<std::string> answer;
  while (!answer && Clock::now() - begin < kAnswerPatience) {
    statuses.wait(std::chrono::milliseconds(100));
    const auto taken = statuses.take_each([&](const VoStatus& status, const auto&) {
      if (status.last_command_id != id) return;
      answer = status.last_command_result == nullptr ? "" : status.last_command_result;
    });
    if (!taken) return taken.failure();
  }
  if (!answer) {
    return Error{
        "sovo vo did not answer; it says so in its status only while frames come, and "
        "takes commands from this machine alone unless dds.accept_commands is true"};
  }
  return *answer;
}

int send(const AppConfig& config, std::uint8_t what) {
  auto participant = bridge::Participant::open(config.dds, "command");
  if (!participant) return fail(kFailed, participant.error());
  auto statuses = bridge::Reader<VoStatus>::open(*participant, bridge::topics::kStatus,
                                                 bridge::topics::kStatusQos);
  if (!statuses) return fail(kFailed, statuses.error());
  auto commands = bridge::Writer<VoCommand>::open(*participant, bridge::topics::kCommand,
                                                  bridge::topics::kCommandQos);
  if (!commands) return fail(kFailed, commands.error());

  const auto begin = Clock::now();
  while (commands->num_readers() == 0 || statuses->num_writers() == 0) {
    if (Clock::now() - begin > kAnswerPatience) {
      return fail(kFailed, "no sovo vo on " + commands->topic() +
                               "; is it running, in the same domain and namespace?");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  const VoCommand command = make_command(what);
  if (auto sent = commands->write(command); !sent) return fail(kFailed, sent.error());
  const auto answer = wait_for_answer(*statuses, command.id);
  if (!answer) return fail(kFailed, answer.error());
  std::cout << *answer << std::endl;
  return kOk;
}

void add_one(const Command& parent, const std::string& name, const std::string& help,
             std::uint8_t what) {
  const Command command = parent.add_command(name, help);
  auto options = std::make_shared<ConfigOptions>(command);
  add_dds_options(*options);
  command.action([options, what] {
    const auto config = options->load();
    return config ? send(*config, what) : fail(kUsage, config.error());
  });
}

}  // namespace

void add_command_command(const Command& program) {
  using Traits = bridge::MessageTraits<VoCommand>;
  const Command command = program.add_command("command", "Send a command to the odometry process");
  command.require_command();
  add_one(command, "reset", "Forget the map and begin a new segment", Traits::RESET);
  add_one(command, "pause", "Leave frames unprocessed until resume", Traits::PAUSE);
  add_one(command, "resume", "Process frames again", Traits::RESUME);
}

}  // namespace sovo::app
