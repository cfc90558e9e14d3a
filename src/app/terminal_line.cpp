#include "sovo/app/terminal_line.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <iostream>

namespace sovo::app {

TerminalLine::TerminalLine() : enabled_(isatty(STDERR_FILENO) == 1) {}

TerminalLine::~TerminalLine() {
  if (shown_) std::cerr << "\r\x1b[K" << std::flush;
}

void TerminalLine::show(const std::string& text) {
  const auto now = std::chrono::steady_clock::now();
  if (!enabled_ || now - last_ < std::chrono::milliseconds(200)) return;
  last_ = now;
  shown_ = true;
  std::cerr << "\r\x1b[K" << text << std::flush;
}

std::string size_text(std::uint64_t bytes) {
  const auto value = static_cast<double>(bytes);
  if (value < 1e6) return fmt::format("{:.1f} kB", value * 1e-3);
  if (value < 1e9) return fmt::format("{:.1f} MB", value * 1e-6);
  return fmt::format("{:.2f} GB", value * 1e-9);
}

}  // namespace sovo::app
