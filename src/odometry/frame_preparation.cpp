#include "sovo/odometry/frame_preparation.h"

#include <algorithm>
#include <chrono>

#include "sovo/image/photometric.h"

namespace sovo {

namespace {

std::int64_t steady_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// A reduced pixel may be used when all its pixels may.
ImageU8 reduce_mask(const ImageU8& mask, int factor) {
  if (mask.empty() || factor == 1) return mask;
  ImageU8 out(mask.width() / factor, mask.height() / factor);
  for (int y = 0; y < out.height(); ++y) {
    for (int x = 0; x < out.width(); ++x) {
      std::uint8_t least = 255;
      for (int j = 0; j < factor; ++j) {
        for (int i = 0; i < factor; ++i) {
          least = std::min(least, mask.at(x * factor + i, y * factor + j));
        }
      }
      out.at(x, y) = least;
    }
  }
  return out;
}

/// Whether every byte of a sparse grid over the image is zero: a covered or dead camera.
bool is_black(const SideImage& side) {
  constexpr int kStride = 7;
  const int bytes = side.format == PixelFormat::kMono16 ? 2 : 1;
  const std::uint8_t* data = side.data->data();
  for (int y = 0; y < side.height; y += kStride) {
    const std::uint8_t* row = data + static_cast<std::ptrdiff_t>(y) * side.step;
    for (int x = 0; x < side.width * bytes; x += kStride) {
      if (row[x] != 0) return false;
    }
  }
  return true;
}

}  // namespace

ScopedStage::ScopedStage(StageObserver* observer, Stage stage)
    : observer_(observer), stage_(stage), start_ns_(observer != nullptr ? steady_now_ns() : 0) {}

ScopedStage::~ScopedStage() {
  if (observer_ == nullptr) return;
  observer_->on_stage(stage_, 1e-9 * static_cast<double>(steady_now_ns() - start_ns_));
}

FramePreparation::FramePreparation(const StereoOdometryConfig& config, const StereoCameras& cameras)
    : cameras_(cameras),
      downscale_(std::max(1, config.downscale)),
      max_levels_(config.vo.tracker.max_levels),
      rig_(cameras.rig),
      local_contrast_(config.local_contrast) {
  if (config.lighting == Lighting::kVehicle) left_contrast_.emplace(local_contrast_);
  const CameraModel raw_left = cameras.rig.left.downscaled(downscale_);
  rig_.left = optimal_pinhole(raw_left, config.undistortion);
  rig_.right = cameras.rig.right.downscaled(downscale_);
  const ImageU8 raw_mask = reduce_mask(cameras.left_mask, downscale_);
  Undistorter undistorter(raw_left, rig_.left);
  if (undistorter.is_identity()) {
    left_mask_ = raw_mask;
    return;
  }
  left_mask_ = undistorter.valid_mask(raw_mask);
  undistorter_ = std::move(undistorter);
}

std::string FramePreparation::check_side(const SideImage& side, bool is_left) const {
  const CameraModel& camera = is_left ? cameras_.rig.left : cameras_.rig.right;
  const std::string name = is_left ? "left" : "right";
  if (!side.valid || side.data == nullptr) return name + " image is missing";
  if (side.width != camera.width || side.height != camera.height) {
    return name + " image is " + std::to_string(side.width) + "x" + std::to_string(side.height) +
           ", its calibration is for " + std::to_string(camera.width) + "x" +
           std::to_string(camera.height);
  }
  const int bytes = side.format == PixelFormat::kMono16 ? 2 : 1;
  const auto needed = static_cast<std::size_t>(side.step) * static_cast<std::size_t>(side.height);
  if (side.step < side.width * bytes || side.data->size() < needed) {
    return name + " image is shorter than its size says";
  }
  if (is_black(side)) return name + " image is black: is the camera covered, or dead?";
  return "";
}

bool FramePreparation::takes_bytes(const SideImage& left) const {
  return undistorter_->takes_bytes() && left.format == PixelFormat::kMono8 && downscale_ == 1 &&
         cameras_.left_photometric.empty();
}

MonoFrame FramePreparation::prepare_left(const StereoFrame& frame, StageObserver* observer) {
  MonoFrame out;
  out.stamp_ns = frame.stamp_ns;
  // Without its light an image does not depend on its exposure.
  if (!left_contrast_) out.exposure_s = frame.left.exposure_s;
  auto pyramid = left_pyramids_.take();
  std::optional<ScopedStage> stage(std::in_place, observer, Stage::kUndistortion);
  pyramid->rebuild(max_levels_, [&](ImageF* image) {
    if (undistorter_ && takes_bytes(frame.left)) {
      undistorter_->apply(frame.left.data->data(), frame.left.step, image);
    } else if (undistorter_) {
      to_float(frame.left, cameras_.left_photometric, downscale_, &raw_left_);
      undistorter_->apply(raw_left_, image);
    } else {
      to_float(frame.left, cameras_.left_photometric, downscale_, image);
    }
    if (left_contrast_) left_contrast_->apply(image);
    stage.emplace(observer, Stage::kPyramid);
  });
  out.pyramid = std::move(pyramid);
  return out;
}

ImagePyramid FramePreparation::prepare_right(const SideImage& right) const {
  ImageF image;
  to_float(right, cameras_.right_photometric, downscale_, &image);
  if (left_contrast_) LocalContrast(local_contrast_).apply(&image);
  const int levels = ImagePyramid::num_levels_for(image.width(), image.height(), max_levels_);
  return {std::move(image), levels};
}

}  // namespace sovo
