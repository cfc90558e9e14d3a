#include "sovo/bridge/command_subscriber.h"

#include <algorithm>

#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

constexpr std::size_t kMostKnownIds = 1024;

bool is_known(std::uint8_t command) {
  using Traits = MessageTraits<msg::VoCommand>;
  return command == Traits::RESET || command == Traits::PAUSE || command == Traits::RESUME;
}

/// All zeros: no pose was given.
bool is_given(const msg::Pose& pose) {
  const msg::Quaternion& q = pose.orientation;
  const msg::Point& p = pose.position;
  return q.w != 0.0 || q.x != 0.0 || q.y != 0.0 || q.z != 0.0 || p.x != 0.0 || p.y != 0.0 ||
         p.z != 0.0;
}

/// Empty when the message is a command that can be obeyed.
std::string refusal(const msg::VoCommand& m, bool accepts) {
  if (!accepts) {
    return "refused: commands from a network are obeyed only with accept_commands: true";
  }
  if (!is_known(m.command)) {
    return "refused: command " + std::to_string(m.command) +
           " is not 1 (reset), 2 (pause) or 3 (resume)";
  }
  if (is_given(m.pose) && !is_rigid(m.pose.position, m.pose.orientation)) {
    return "refused: the pose is not a rigid motion";
  }
  return {};
}

}  // namespace

Result<CommandSubscriber> CommandSubscriber::open(const Participant& participant) {
  auto reader = Reader<msg::VoCommand>::open(participant, topics::kCommand, topics::kCommandQos);
  if (!reader) return reader.failure();
  const bool accepts = participant.accepts_commands();
  return CommandSubscriber(std::move(*reader), accepts);
}

std::vector<Command> CommandSubscriber::poll() {
  std::vector<Command> commands;
  // A reader that cannot be read has no commands; its topic is read anew at the next poll.
  (void)reader_.take_each(
      [&](const msg::VoCommand& message, const dds_sample_info_t&) { take(message, &commands); });
  return commands;
}

void CommandSubscriber::take(const msg::VoCommand& message, std::vector<Command>* commands) {
  if (is_repeated(message.id)) return;
  Command command;
  command.id = message.id;
  const std::string wrong = refusal(message, accepts_);
  if (!wrong.empty()) {
    answer(command, wrong);
    return;
  }
  command.kind = static_cast<CommandKind>(message.command);
  if (is_given(message.pose)) {
    command.T_odom_base = to_se3(message.pose.position, message.pose.orientation);
  }
  commands->push_back(command);
}

bool CommandSubscriber::is_repeated(std::uint64_t id) {
  if (std::find(known_ids_.begin(), known_ids_.end(), id) != known_ids_.end()) return true;
  known_ids_.push_back(id);
  if (known_ids_.size() > kMostKnownIds) known_ids_.pop_front();
  return false;
}

void CommandSubscriber::answer(const Command& command, const std::string& result) {
  last_id_ = command.id;
  last_result_ = result;
}

}  // namespace sovo::bridge
