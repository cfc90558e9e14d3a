#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sovo/bridge/dds_config.h"
#include "sovo/bridge/dds_handle.h"
#include "sovo/io/result.h"

namespace sovo::bridge {

class RosGraphWriter;

/// This process on the bus: opens the domain with the tuned settings and holds everything that
/// reads and writes in it.
///
///     auto participant = Participant::open(config, "vo");
///     if (!participant) { /* participant.error() says what to do */ }
///     for (const auto& note : participant->notes()) { /* log it */ }
///
/// A participant outlives its readers and writers. The first participant of a process in a domain
/// owns the domain and outlives the others in it.
class Participant {
 public:
  /// `node`: name that ROS 2 tools show, when `config.ros.graph` is on.
  static Result<Participant> open(const DdsConfig& config, const std::string& node,
                                  const DdsEnvironment& environment = DdsEnvironment::current());

  Participant(Participant&&) noexcept;
  Participant& operator=(Participant&&) noexcept;
  ~Participant();

  dds_entity_t entity() const { return participant_.get(); }
  std::uint32_t domain() const { return plan_.domain; }
  const DdsConfig& config() const { return config_; }
  /// Whether commands are obeyed: from this machine, by those who have a key, or as configured.
  bool accepts_commands() const {
    return plan_.loopback_only || plan_.secured || config_.accept_commands;
  }
  /// Lines for the log at start.
  const std::vector<std::string>& notes() const { return plan_.notes; }

  /// "/ns/name"; names with a leading slash are global.
  std::string topic(const std::string& name) const;
  /// Frame name under this namespace.
  std::string frame(const std::string& name) const;

  /// Tells ROS 2's graph about the readers and writers that exist now; called by theirs when they
  /// open.
  void announce() const;

 private:
  Participant() = default;

  DdsConfig config_;
  NetworkPlan plan_;
  DdsHandle domain_;  // before the participant: deleted after it
  DdsHandle participant_;
  std::unique_ptr<RosGraphWriter> graph_;
};

}  // namespace sovo::bridge
