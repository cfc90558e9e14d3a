#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "sovo/image/stereo_frame.h"

namespace sovo::bridge {

/// Pairs left and right images by their stamps.
class StereoPairing {
 public:
  /// `tolerance_ns`: largest difference of the stamps of a pair; below half of the frame period.
  explicit StereoPairing(std::int64_t tolerance_ns) : tolerance_ns_(tolerance_ns) {}

  struct Image {
    std::int64_t stamp_ns = 0;
    SideImage side;
    std::string frame_id;  ///< Of the left image it becomes that of the frame.
  };

  void add_left(Image image) { add(std::move(image), &left_); }
  void add_right(Image image) { add(std::move(image), &right_); }

  /// The next pair, stamped as its left image; nothing when none is complete. A left image whose
  /// partner did not come while three later ones did is given alone, with the right side missing.
  std::optional<StereoFrame> next();

  /// No image will follow: `next` gives those that wait.
  void end() { ended_ = true; }

  /// Forgets the images that wait: another publisher begins.
  void clear();

  /// Images that found no partner.
  std::uint64_t unpaired() const { return unpaired_; }

 private:
  static constexpr std::size_t kMostWaiting = 4;

  void add(Image image, std::deque<Image>* queue);
  StereoFrame make_frame(Image left, std::optional<Image> right) const;

  std::int64_t tolerance_ns_;
  std::deque<Image> left_;
  std::deque<Image> right_;
  std::uint64_t unpaired_ = 0;
  bool ended_ = false;
};

}  // namespace sovo::bridge
