#pragma once

#include <algorithm>
#include <chrono>
#include <utility>

namespace sovo {

/// How long to wait before a device is tried again: longer after every failure, up to a bound.
class Backoff {
 public:
  using Duration = std::chrono::milliseconds;

  explicit Backoff(Duration first = Duration(100), Duration longest = Duration(1000))
      : first_(first), longest_(longest), next_(first) {}

  /// The wait after one more failure.
  Duration next() { return std::exchange(next_, std::min(longest_, next_ * 8 / 5)); }

  /// The device works.
  void reset() { next_ = first_; }

 private:
  Duration first_;
  Duration longest_;
  Duration next_;
};

}  // namespace sovo
