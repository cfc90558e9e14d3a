#pragma once

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <mutex>

namespace sovo::gige {

/// The port of a switch to which two cameras send: it carries so many bytes a second, keeps some
/// that come too fast, and drops the rest.
class SharedPort {
 public:
  SharedPort(double bytes_per_s, std::size_t buffer)
      : bytes_per_s_(bytes_per_s), buffer_(static_cast<double>(buffer)) {}

  /// Whether a packet that comes now is carried.
  bool carry(std::size_t bytes) {
    const std::scoped_lock lock(mutex_);
    const auto now = std::chrono::steady_clock::now();
    const double passed_s = std::chrono::duration<double>(now - last_).count();
    waiting_ = std::max(0.0, waiting_ - bytes_per_s_ * passed_s);
    last_ = now;
    const bool fits = waiting_ + static_cast<double>(bytes) <= buffer_;
    if (fits) waiting_ += static_cast<double>(bytes);
    if (!fits) ++dropped_;
    return fits;
  }

  std::uint64_t dropped() const {
    const std::scoped_lock lock(mutex_);
    return dropped_;
  }

 private:
  double bytes_per_s_;
  double buffer_;
  mutable std::mutex mutex_;  ///< Guards what follows.
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
  double waiting_ = 0.0;
  std::uint64_t dropped_ = 0;
};

}  // namespace sovo::gige
