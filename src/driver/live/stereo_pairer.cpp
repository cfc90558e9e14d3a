#include "sovo/driver/live/stereo_pairer.h"

#include <cstdlib>
#include <utility>

namespace sovo {

StereoPairer::StereoPairer(std::int64_t tolerance_ns, std::size_t max_waiting)
    : tolerance_ns_(tolerance_ns), max_waiting_(max_waiting) {
  left_.reserve(max_waiting + 1);
  right_.reserve(max_waiting + 1);
}

void StereoPairer::add(CameraSide side, TimedImage image) {
  auto& last = side == CameraSide::kLeft ? last_left_ns_ : last_right_ns_;
  if (last && image.time_ns <= *last) {
    ++counts_.out_of_order;
    return;
  }
  last = image.time_ns;
  (side == CameraSide::kLeft ? left_ : right_).push_back(std::move(image));
}

std::optional<StereoPair> StereoPairer::next() {
  while (!left_.empty() && !right_.empty()) {
    const std::int64_t gap = right_.front().time_ns - left_.front().time_ns;
    if (gap > tolerance_ns_) return take_left();
    const bool next_is_nearer =
        right_.size() > 1 && std::abs(right_[1].time_ns - left_.front().time_ns) < std::abs(gap);
    if (gap < -tolerance_ns_ || next_is_nearer) {
      drop_right();
      continue;
    }
    return take_pair();
  }
  if (left_.size() > max_waiting_) return take_left();
  while (right_.size() > max_waiting_) drop_right();
  return std::nullopt;
}

void StereoPairer::restart() {
  counts_.unpaired_left += left_.size();
  counts_.unpaired_right += right_.size();
  left_.clear();
  right_.clear();
  last_left_ns_.reset();
  last_right_ns_.reset();
}

StereoPair StereoPairer::take_pair() {
  ++counts_.pairs;
  StereoPair pair{std::move(left_.front()), std::move(right_.front())};
  left_.erase(left_.begin());
  right_.erase(right_.begin());
  return pair;
}

StereoPair StereoPairer::take_left() {
  ++counts_.unpaired_left;
  StereoPair alone{std::move(left_.front()), std::nullopt};
  left_.erase(left_.begin());
  return alone;
}

void StereoPairer::drop_right() {
  ++counts_.unpaired_right;
  right_.erase(right_.begin());
}

}  // namespace sovo
