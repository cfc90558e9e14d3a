#include "sovo/odometry/frame_check.h"

#include <cstddef>
#include <functional>
#include <string_view>

#include "sovo/vo/motion_model.h"

namespace sovo {

namespace {

std::size_t bytes_per_pixel(const SideImage& side) {
  return side.format == PixelFormat::kMono16 ? 2 : 1;
}

/// Every eighth row, without its padding: noise leaves none of them as it was.
void for_sparse_rows(const SideImage& side, const std::function<void(std::string_view)>& use) {
  constexpr int kRows = 8;
  const std::size_t bytes = static_cast<std::size_t>(side.width) * bytes_per_pixel(side);
  for (int y = 0; y < side.height; y += kRows) {
    const std::size_t begin = static_cast<std::size_t>(side.step) * static_cast<std::size_t>(y);
    use({reinterpret_cast<const char*>(side.data->data() + begin), bytes});
  }
}

std::uint64_t digest_of(const SideImage& side) {
  const std::hash<std::string_view> hash;
  std::uint64_t digest = 0;
  for_sparse_rows(side, [&](std::string_view row) { digest = 31 * digest + hash(row); });
  return digest;
}

/// Whether all pixels of a row are alike, in each row: white, beyond what the sensor can tell.
bool is_blank(const SideImage& side) {
  const std::size_t pixel = bytes_per_pixel(side);
  bool blank = true;
  for_sparse_rows(side, [&](std::string_view row) {
    blank = blank && row.substr(pixel) == row.substr(0, row.size() - pixel);
  });
  return blank;
}

}  // namespace

void RepeatedImage::note(const SideImage& side, std::int64_t stamp_ns) {
  const std::uint64_t digest = digest_of(side);
  repeats_ = digest_ == digest && !is_blank(side);
  if (!repeats_) first_ns_ = stamp_ns;
  since_s_ = seconds_between(first_ns_, stamp_ns);
  digest_ = digest;
}

std::string FrameCheck::refuse(const StereoFrame& frame,
                               const std::function<double()>& believed_after_s) {
  if (last_stamp_ns_ && frame.stamp_ns <= *last_stamp_ns_) {
    return frame.stamp_ns == *last_stamp_ns_ ? "the frame's stamp repeats the last one"
                                             : "the frame's stamp is older than the last one";
  }
  std::string problem = preparation_.check_side(frame.left, true);
  if (!problem.empty()) return problem;
  left_.note(frame.left, frame.stamp_ns);
  if (left_.repeats() && left_.since_s() < believed_after_s()) {
    return "left image is the one before, to the bit: its camera or driver has no new one in time";
  }
  last_stamp_ns_ = frame.stamp_ns;
  return "";
}

std::string FrameCheck::right_problem(const StereoFrame& frame) {
  std::string problem = preparation_.check_side(frame.right, false);
  if (!problem.empty()) return problem;
  right_.note(frame.right, frame.stamp_ns);
  if (!right_.repeats() || left_.repeats()) return "";
  return "right image is the one before, to the bit, but the left one is new";
}

void FrameCheck::doubt(OdometryOutput* out) const {
  if (!out->pose_valid || !left_.repeats() || left_.since_s() < kFrozen) return;
  out->state = OdometryState::kDegraded;
  out->reason = "the left image has not changed by a bit for " +
                std::to_string(static_cast<int>(left_.since_s())) + " s: is the camera frozen?";
}

std::string FrameCheck::with_exposure(const std::string& reason, const StereoFrame& frame) {
  const std::string problem = FramePreparation::exposure_problem(frame.left);
  return problem.empty() ? reason : reason + "; " + problem;
}

}  // namespace sovo
