#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "sovo/bridge/participant.h"
#include "sovo/bridge/reader.h"
#include "sovo/geometry/se3.h"

namespace sovo::bridge {

enum class CommandKind : std::uint8_t { kReset = 1, kPause = 2, kResume = 3 };

/// A command to the odometry that is to be obeyed.
struct Command {
  std::uint64_t id = 0;
  CommandKind kind = CommandKind::kReset;
  std::optional<SE3> T_odom_base;  ///< Of a reset: where the new segment begins, when given.
};

/// Takes commands from the bus: each id once, and only when nothing can come from another machine,
/// or the configuration accepts commands from the network.
///
///     for (const Command& command : commands.poll()) {
///       commands.answer(command, obey(command));
///     }
///     feed.last_command_id = commands.last_id();
///     feed.last_command_result = commands.last_result();
///
/// For one thread.
class CommandSubscriber {
 public:
  static Result<CommandSubscriber> open(const Participant& participant);

  /// Commands that have arrived and are to be obeyed. Those that are refused are answered here.
  std::vector<Command> poll();

  /// Says what became of a command, for VoStatus: "done", or why not.
  void answer(const Command& command, const std::string& result);

  std::uint64_t last_id() const { return last_id_; }
  const std::string& last_result() const { return last_result_; }

 private:
  CommandSubscriber(Reader<msg::VoCommand> reader, bool accepts)
      : reader_(std::move(reader)), accepts_(accepts) {}

  void take(const msg::VoCommand& message, std::vector<Command>* commands);
  bool is_repeated(std::uint64_t id);

  Reader<msg::VoCommand> reader_;
  bool accepts_;
  std::deque<std::uint64_t> known_ids_;
  std::uint64_t last_id_ = 0;
  std::string last_result_;
};

}  // namespace sovo::bridge
