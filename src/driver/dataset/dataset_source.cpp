#include "sovo/driver/dataset/dataset_source.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "sovo/io/image_file.h"

namespace sovo {
namespace {

constexpr std::uint8_t kDatasetClock = 3;

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

/// One side of a pair; the error names the file.
Result<SideImage> load_side(const ImageRef& ref, const CameraModel& camera) {
  auto image = read_grey_image(ref.path.string());
  if (!image) return image.failure();
  if (image->width != camera.width || image->height != camera.height) {
    return Error{ref.path.string() + ": the image is " + size_text(image->width, image->height) +
                 " pixels, the calibration is for " + size_text(camera.width, camera.height)};
  }
  SideImage side = to_side(std::move(*image));
  side.exposure_s = ref.exposure_s;
  return side;
}

/// The part of the pairs that the options ask for, in the order of feeding.
std::vector<PairRef> select_pairs(const std::vector<PairRef>& all, const DatasetOptions& options) {
  const auto first = std::min<std::size_t>(std::max(0, options.start_frame), all.size());
  std::size_t count = all.size() - first;
  if (options.max_frames > 0) count = std::min<std::size_t>(count, options.max_frames);
  const auto begin = all.begin() + static_cast<std::ptrdiff_t>(first);
  std::vector<PairRef> pairs(begin, begin + static_cast<std::ptrdiff_t>(count));
  if (options.reverse) std::reverse(pairs.begin(), pairs.end());
  return pairs;
}

std::int64_t utc_now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Refuses a calibration for images of another size: neither the first, nor the middle, nor
/// the last left image that can be read fits the camera.
Result<void> check_sizes(const std::vector<PairRef>& pairs, const CameraModel& camera) {
  std::string other;
  for (const std::size_t i : {std::size_t{0}, pairs.size() / 2, pairs.size() - 1}) {
    const auto image = read_grey_image(pairs[i].left.path.string());
    if (!image) continue;
    if (image->width == camera.width && image->height == camera.height) return {};
    other = pairs[i].left.path.string() + " is " + size_text(image->width, image->height);
  }
  if (other.empty()) return {};
  return Error{other + " pixels, but the calibration is for " +
               size_text(camera.width, camera.height) + "; give the calibration of these images"};
}

Result<Calibration> calibration_for(const DatasetLayout& layout, const DatasetOptions& options) {
  CalibrationOptions calibration;
  switch (layout.kind) {
    case LayoutKind::kKittiGrey:
    case LayoutKind::kKittiRawGrey:
      calibration.kitti_colour = false;
      break;
    case LayoutKind::kKittiColour:
    case LayoutKind::kKittiRawColour:
      calibration.kitti_colour = true;
      break;
    default:
      break;
  }
  for (const PairRef& pair : layout.list.pairs) {
    const auto image = read_grey_image(pair.left.path.string());
    if (!image) continue;
    calibration.image_width = image->width;
    calibration.image_height = image->height;
    break;
  }
  const std::string own = layout.root.string();
  return load_calibration(options.calibration.empty() ? own : options.calibration, calibration);
}

Result<void> check_options(const DatasetOptions& options) {
  if (options.rate < 0.0) return Error{"rate must be positive, or 0 for as fast as possible"};
  if (!(options.frame_rate > 0.0)) return Error{"frame_rate must be positive [Hz]"};
  if (options.start_frame < 0) return Error{"start_frame must not be negative"};
  if (options.max_frames < 0) return Error{"max_frames must not be negative"};
  return {};
}

}  // namespace

DatasetSource::DatasetSource(DatasetLayout layout, Calibration calibration,
                             const DatasetOptions& options)
    : layout_(std::move(layout)),
      calibration_(std::move(calibration)),
      options_(options),
      pairs_(select_pairs(layout_.list.pairs, options)) {
  if (!pairs_.empty()) {
    mirror_ns_ = pairs_.front().left.stamp_ns + pairs_.back().left.stamp_ns;
  }
  decoder_ = std::make_unique<FrameDecoder>(pairs_.size(),
                                            [this](std::size_t index) { return decode(index); });
}

/// Stamps here are recorded ones, mirrored in a reversed run; `next` shifts them.
SourceResult DatasetSource::decode(std::size_t index) const {
  const PairRef& pair = pairs_[index];
  SourceResult result;
  StereoFrame& frame = result.frame;
  const std::int64_t stamp = pair.left.stamp_ns;
  const std::int64_t right_offset = pair.right.stamp_ns - stamp;
  frame.stamp_ns = options_.reverse ? mirror_ns_ - stamp : stamp;
  frame.sequence = index;
  frame.clock = kDatasetClock;
  frame.pair_error_s = 1e-9 * static_cast<double>(std::abs(right_offset));
  frame.frame_id = options_.frame_id;
  auto left = load_side(pair.left, calibration_.rig.left);
  auto right = load_side(pair.right, calibration_.rig.right);
  if (!left || !right) {
    result.state = SourceState::kBadFrame;
    result.message = !left ? left.error() : right.error();
    if (!left && !right) result.message += "; " + right.error();
    return result;
  }
  frame.left = std::move(*left);
  frame.right = std::move(*right);
  frame.right.stamp_offset_ns = options_.reverse ? -right_offset : right_offset;
  result.state = SourceState::kFrame;
  return result;
}

void DatasetSource::begin() {
  begun_ = true;
  start_ = std::chrono::steady_clock::now();
  if (!options_.restamp || pairs_.empty()) return;
  const std::int64_t first = pairs_.front().left.stamp_ns;
  shift_ns_ = utc_now_ns() - (options_.reverse ? mirror_ns_ - first : first);
}

SourceResult DatasetSource::next(std::chrono::milliseconds timeout) {
  if (!begun_) begin();
  constexpr std::chrono::milliseconds kLongest =
      std::chrono::hours(24);  // Keeps clear of overflow.
  const auto deadline = std::chrono::steady_clock::now() + std::min(timeout, kLongest);
  if (!waiting_) {
    SourceResult result = decoder_->next(deadline);
    if (result.state == SourceState::kTimeout || result.state == SourceState::kEndOfStream) {
      return result;
    }
    waiting_ = std::move(result);
  }
  if (options_.rate > 0.0) {
    const std::int64_t first = pairs_.front().left.stamp_ns;
    const std::int64_t fed_first = options_.reverse ? mirror_ns_ - first : first;
    const double elapsed = static_cast<double>(waiting_->frame.stamp_ns - fed_first);
    const auto due =
        start_ + std::chrono::nanoseconds(static_cast<std::int64_t>(elapsed / options_.rate));
    std::this_thread::sleep_until(std::min(due, deadline));
    if (deadline < due) return {};
  }
  SourceResult result = std::move(*waiting_);
  waiting_.reset();
  result.frame.stamp_ns += shift_ns_;
  ++(result.state == SourceState::kFrame ? counts_.delivered : counts_.bad);
  return result;
}

std::int64_t DatasetSource::original_stamp(std::int64_t fed) const {
  const std::int64_t stamp = fed - shift_ns_;
  return options_.reverse ? mirror_ns_ - stamp : stamp;
}

Result<std::unique_ptr<DatasetSource>> open_dataset(const DatasetOptions& options) {
  const auto checked = check_options(options);
  if (!checked) return checked.failure();
  auto layout = find_layout(options.path, options.frame_rate);
  if (!layout) return layout.failure();
  const auto& pairs = layout->list.pairs;
  if (select_pairs(pairs, options).empty()) {
    return Error{options.path + ": start_frame " + std::to_string(options.start_frame) +
                 " is beyond its " + std::to_string(pairs.size()) + " pairs"};
  }
  auto calibration = calibration_for(*layout, options);
  if (!calibration) return calibration.failure();
  const auto fits = check_sizes(pairs, calibration->rig.left);
  if (!fits) return fits.failure();
  return std::make_unique<DatasetSource>(std::move(*layout), std::move(*calibration), options);
}

}  // namespace sovo
