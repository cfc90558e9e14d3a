#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "message_traits.h"
#include "sovo/bridge/participant.h"
#include "sovo/bridge/writer.h"
#include "sovo/driver/live/camera_report.h"

namespace sovo::bridge {

/// A DiagnosticArray about a real camera, a status for each device and one for the pairs, with the
/// texts that it borrows (borrow.h).
class CameraDiagnosticsMessage {
 public:
  CameraDiagnosticsMessage(const std::string& process_name, const LiveReport& report,
                           std::int64_t now_ns);
  CameraDiagnosticsMessage(const CameraDiagnosticsMessage&) = delete;
  CameraDiagnosticsMessage& operator=(const CameraDiagnosticsMessage&) = delete;

  const msg::DiagnosticArray& message() const { return message_; }

 private:
  struct Entry {
    std::uint8_t level = 0;
    std::string name;
    std::string text;
    std::string device;
    std::vector<std::pair<std::string, std::string>> values;
    std::vector<msg::KeyValue> key_values;
  };

  std::vector<Entry> entries_;
  std::vector<msg::DiagnosticStatus> status_;
  msg::DiagnosticArray message_{};
};

/// Publishes the diagnostics of a camera process.
class CameraDiagnostics {
 public:
  static Result<CameraDiagnostics> open(const Participant& participant);

  Result<void> publish(const LiveReport& report, std::int64_t now_ns);

 private:
  CameraDiagnostics(Writer<msg::DiagnosticArray> writer, std::string name)
      : writer_(std::move(writer)), name_(std::move(name)) {}

  Writer<msg::DiagnosticArray> writer_;
  std::string name_;
};

}  // namespace sovo::bridge
