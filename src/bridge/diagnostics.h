#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/odometry_conversion.h"

namespace sovo::bridge {

/// Level of /diagnostics for a state of the odometry: lost is an error, anything else that is not
/// good tracking a warning.
std::uint8_t diagnostic_level(OdometryState state);

/// A DiagnosticArray about the odometry, with the texts that it borrows (borrow.h).
class DiagnosticsMessage {
 public:
  DiagnosticsMessage(const std::string& process_name, const OdometryOutput& output,
                     const FeedStatus& feed, std::int64_t now_ns);
  DiagnosticsMessage(const DiagnosticsMessage&) = delete;
  DiagnosticsMessage& operator=(const DiagnosticsMessage&) = delete;

  const msg::DiagnosticArray& message() const { return message_; }

 private:
  std::string name_;
  std::string text_;
  std::vector<std::pair<std::string, std::string>> values_;
  std::vector<msg::KeyValue> key_values_;
  std::vector<msg::DiagnosticStatus> status_;
  msg::DiagnosticArray message_{};
};

}  // namespace sovo::bridge
