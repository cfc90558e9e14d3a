#include "sovo/app/progress.h"

#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <iostream>

namespace sovo::app {

Progress::Progress(std::optional<std::size_t> total)
    : total_(total), enabled_(isatty(STDERR_FILENO) == 1), start_(Clock::now()) {}

Progress::~Progress() {
  if (shown_) std::cerr << "\r\x1b[K" << std::flush;
}

void Progress::update(std::size_t frames, const std::string& note) {
  const auto now = Clock::now();
  if (!enabled_ || now - last_ < std::chrono::milliseconds(100)) return;
  last_ = now;
  shown_ = true;
  const double seconds = std::chrono::duration<double>(now - start_).count();
  const std::string total = total_ ? fmt::format("/{}", *total_) : "";
  const double per_second = seconds > 0.0 ? static_cast<double>(frames) / seconds : 0.0;
  std::cerr << fmt::format("\r\x1b[K{}{} frames  {:.1f}/s  {}", frames, total, per_second, note)
            << std::flush;
}

}  // namespace sovo::app
