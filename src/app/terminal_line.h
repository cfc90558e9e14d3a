#pragma once

#include <chrono>
#include <string>

namespace sovo::app {

/// One line on the terminal that is written over; nothing where stderr is not a terminal.
class TerminalLine {
 public:
  TerminalLine();
  ~TerminalLine();
  TerminalLine(const TerminalLine&) = delete;
  TerminalLine& operator=(const TerminalLine&) = delete;

  /// Shows `text`, at most five times a second.
  void show(const std::string& text);

 private:
  bool enabled_;
  bool shown_ = false;
  std::chrono::steady_clock::time_point last_{};
};

/// "1.23 GB"
std::string size_text(std::uint64_t bytes);

}  // namespace sovo::app
