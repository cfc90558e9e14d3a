#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/odometry_conversion.h"

namespace sovo::bridge {

/// What a process says about itself on /diagnostics.
struct DiagnosticReport {
  std::string name;
  std::uint8_t level = 0;  ///< MessageTraits<msg::DiagnosticStatus>: OK, WARN, ERROR, STALE.
  std::string text;
  std::string hardware_id;
  std::vector<std::pair<std::string, std::string>> values;
};

/// Level of /diagnostics for a state of the odometry: lost is an error, anything else that is not
/// good tracking a warning.
std::uint8_t diagnostic_level(OdometryState state);

/// A report about the odometry; `stale`: no frame came lately.
DiagnosticReport describe(const std::string& process_name, const OdometryOutput& output,
                          const FeedStatus& feed, bool stale = false);

/// A DiagnosticArray of one report, with the texts that it borrows (borrow.h).
class DiagnosticsMessage {
 public:
  DiagnosticsMessage(DiagnosticReport report, std::int64_t now_ns);
  DiagnosticsMessage(const DiagnosticsMessage&) = delete;
  DiagnosticsMessage& operator=(const DiagnosticsMessage&) = delete;

  const msg::DiagnosticArray& message() const { return message_; }

 private:
  DiagnosticReport report_;
  std::vector<msg::KeyValue> key_values_;
  std::vector<msg::DiagnosticStatus> status_;
  msg::DiagnosticArray message_{};
};

}  // namespace sovo::bridge
