#pragma once

#include <cstdint>
#include <optional>

namespace sovo::aravis {

/// Counts images that a camera made and that never came, by its numbers: 16 bits from 1 on, in
/// which 0 is left out, or 64 bits.
class FrameGaps {
 public:
  /// Images lost between the last one and this; 0 when the numbers began anew.
  std::uint64_t before(std::uint64_t id) {
    constexpr std::uint64_t kLast16 = 0xffff;
    constexpr std::uint64_t kBelievable = 1000;
    std::uint64_t skipped = 0;
    if (last_ && id > *last_) {
      skipped = id - *last_ - 1;
    } else if (last_ && id < *last_ && *last_ <= kLast16) {
      skipped = kLast16 - *last_ + (id > 0 ? id - 1 : 0);
    }
    last_ = id;
    return skipped < kBelievable ? skipped : 0;
  }

 private:
  std::optional<std::uint64_t> last_;
};

}  // namespace sovo::aravis
