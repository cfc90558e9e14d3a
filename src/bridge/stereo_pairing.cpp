#include "sovo/bridge/stereo_pairing.h"

#include <cstdlib>

namespace sovo::bridge {

void StereoPairing::add(Image image, std::deque<Image>* queue) {
  // Stamps that go back are those of a recording that began again.
  if (!queue->empty() && image.stamp_ns <= queue->back().stamp_ns) {
    unpaired_ += queue->size();
    queue->clear();
  }
  queue->push_back(std::move(image));
  if (queue == &right_ && right_.size() > kMostWaiting) {
    right_.pop_front();
    ++unpaired_;
  }
}

void StereoPairing::clear() {
  left_.clear();
  right_.clear();
}

StereoFrame StereoPairing::make_frame(Image left, std::optional<Image> right) const {
  StereoFrame frame;
  frame.stamp_ns = left.stamp_ns;
  frame.frame_id = std::move(left.frame_id);
  frame.left = std::move(left.side);
  if (right) {
    frame.right = std::move(right->side);
    frame.right.stamp_offset_ns = right->stamp_ns - frame.stamp_ns;
    frame.pair_error_s = 1e-9 * std::abs(static_cast<double>(frame.right.stamp_offset_ns));
  }
  return frame;
}

std::optional<StereoFrame> StereoPairing::next() {
  while (!left_.empty() && !right_.empty()) {
    const std::int64_t difference = right_.front().stamp_ns - left_.front().stamp_ns;
    if (std::abs(difference) <= tolerance_ns_) {
      StereoFrame frame = make_frame(std::move(left_.front()), std::move(right_.front()));
      left_.pop_front();
      right_.pop_front();
      return frame;
    }
    ++unpaired_;
    if (difference < 0) {
      right_.pop_front();
      continue;
    }
    StereoFrame alone = make_frame(std::move(left_.front()), std::nullopt);
    left_.pop_front();
    return alone;
  }
  if (left_.empty() || (left_.size() < kMostWaiting && !ended_)) return std::nullopt;
  ++unpaired_;
  StereoFrame alone = make_frame(std::move(left_.front()), std::nullopt);
  left_.pop_front();
  return alone;
}

}  // namespace sovo::bridge
