#include "sovo/odometry/frame_preparation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <tuple>
#include <utility>

#include "sovo/image/halving.h"
#include "sovo/image/photometric.h"

namespace sovo {

namespace {

std::int64_t steady_now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// The pixels of a sparse grid over the image, full scale 65535.
template <class Visit>
void for_sparse_pixels(const SideImage& side, const Visit& visit) {
  constexpr int kStride = 7;
  const bool wide = side.format == PixelFormat::kMono16;
  const std::uint8_t* data = side.data->data();
  for (int y = 0; y < side.height; y += kStride) {
    const std::uint8_t* row = data + static_cast<std::ptrdiff_t>(y) * side.step;
    for (int x = 0; x < side.width; x += kStride) {
      visit(wide ? row[2 * x] + 256 * row[2 * x + 1] : 257 * row[x]);
    }
  }
}

/// Whether every pixel of a sparse grid over the image is zero: a covered or dead camera.
bool is_black(const SideImage& side) {
  bool black = true;
  for_sparse_pixels(side, [&](int grey) { black = black && grey == 0; });
  return black;
}

/// Left images that are held at once: of the window's keyframes, and of the newest frame.
std::size_t images_held(const StereoOdometryConfig& config) {
  const int keyframes = config.backend == Backend::kDirect ? config.vo.keyframe.max_keyframes
                                                           : config.features.max_keyframes;
  return static_cast<std::size_t>(keyframes) + 1;
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
      local_contrast_(config.local_contrast),
      readout_s_(1e-3 * config.readout_ms) {
  take_light_out(config.lighting == Lighting::kVehicle);
  const CameraModel raw_left = cameras.rig.left.downscaled(downscale_);
  StereoRig rig = cameras.rig;
  rig.left = optimal_pinhole(raw_left, config.undistortion);
  rig.right = cameras.rig.right.downscaled(downscale_);
  ImageU8 mask = reduced_mask(cameras.left_mask, downscale_);
  Undistorter undistorter(raw_left, rig.left);
  if (!undistorter.is_identity()) {
    mask = undistorter.valid_mask(mask);
    undistorter_ = std::move(undistorter);
  }
  if (has_rolling_shutter()) {
    left_unroller_.emplace(raw_left, rig.left);
    right_unroller_.emplace(rig.right, rig.right);
  }
  add_resolutions(rig, mask, config.max_halvings);
  if (config.mode != OdometryMode::kMono) {
    for (Resolution& r : resolutions_) r.rays = AxialRays::of(r.rig.left);
  }
  const bool direct = config.backend == Backend::kDirect;
  if (direct && config.lighting == Lighting::kAuto && config.mode != OdometryMode::kMono) {
    moving_light_ = std::make_unique<MovingLight>(config.moving_light);
  }
  if (direct && config.lighting != Lighting::kVehicle && config.vo.vignette.estimate &&
      cameras.left_photometric.vignette.empty() && cameras.right_photometric.vignette.empty()) {
    vignette_estimate_ = std::make_unique<VignetteEstimate>(rig.left);
    const OffAxis off_axis(rig.left);
    left_vignette_.emplace(off_axis.of(rig.left));
    right_vignette_.emplace(off_axis.of(rig.right));
  }
  left_pyramids_.reserve(images_held(config), rig.left.width, rig.left.height, max_levels_);
}

std::string FramePreparation::exposure_problem(const SideImage& side) {
  constexpr int kWhite = 250 * 257;
  constexpr int kDark = 6 * 257;
  constexpr double kTooWhite = 0.5;
  constexpr double kTooDark = 0.9;
  double all = 0.0;
  double white = 0.0;
  double dark = 0.0;
  for_sparse_pixels(side, [&](int grey) {
    all += 1.0;
    white += grey >= kWhite ? 1.0 : 0.0;
    dark += grey <= kDark ? 1.0 : 0.0;
  });
  if (white > kTooWhite * all) {
    return "more than half of the left image is white: shorten the exposure";
  }
  if (dark > kTooDark * all) {
    return "nine tenths of the left image are dark: lengthen the exposure, or give it light";
  }
  return "";
}

void FramePreparation::add_resolutions(const StereoRig& rig, const ImageU8& mask,
                                       int max_halvings) {
  constexpr int kLeastSide = 80;  // with less there is no room for points
  resolutions_.push_back({rig, mask, {}});
  for (int h = 1; h <= max_halvings; ++h) {
    StereoRig halved = rig;
    halved.left = rig.left.at_level(h);
    halved.right = rig.right.at_level(h);
    const auto& [l, r] = std::tie(halved.left, halved.right);
    if (std::min({l.width, l.height, r.width, r.height}) < kLeastSide) return;
    resolutions_.push_back({halved, reduced_mask(mask, 1 << h), {}});
  }
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

double FramePreparation::displacement(const Vec6& rate_difference, double rho) const {
  if (!left_unroller_) return 0.0;
  const double way = 0.5 * std::abs(readout_s_) * rate_difference.head<3>().norm();
  return left_unroller_->reach(readout_s_ * rate_difference.tail<3>()) + rig().left.fx * rho * way;
}

ViewShift FramePreparation::view_shift(const Vec6& rate, int halvings) const {
  ViewShift shift;
  shift.axial = at(halvings).rays;
  if (!left_unroller_) return shift;
  const int raw_rows = cameras_.rig.left.height / downscale_;
  const double seconds_a_row = readout_s_ / (raw_rows - 1) * left_unroller_->raw_rows();
  shift.per_row = (1 << halvings) * seconds_a_row * rate.head<3>();
  shift.middle =
      static_cast<double>(to_halved(static_cast<float>(left_unroller_->middle_row()), halvings));
  return shift;
}

void FramePreparation::write_left(const SideImage& left, const Vec3& turn, ImageF* image) {
  if (left_unroller_ && !turn.isZero(0.0)) {
    to_float(left, cameras_.left_photometric, downscale_, &raw_left_);
    left_unroller_->apply(raw_left_, turn, &left_lattice_, image);
  } else if (undistorter_ && takes_bytes(left)) {
    undistorter_->apply(left.data->data(), left.step, image);
  } else if (undistorter_) {
    to_float(left, cameras_.left_photometric, downscale_, &raw_left_);
    undistorter_->apply(raw_left_, image);
  } else {
    to_float(left, cameras_.left_photometric, downscale_, image);
  }
}

LightObservers FramePreparation::light_observers() const {
  if (left_contrast_) return {};
  return {vignette_estimate_.get(), moving_light_.get()};
}

void FramePreparation::take_light_out(bool out) {
  left_contrast_.reset();
  if (out) left_contrast_.emplace(local_contrast_);
}

double FramePreparation::corner_light() const {
  return vignette_estimate_ && !left_contrast_ ? std::exp(vignette_estimate_->current().log_at(1.0))
                                               : 1.0;
}

MonoFrame FramePreparation::prepare_left(const StereoFrame& frame, StageObserver* observer,
                                         int halvings, const Vec6& rate) {
  MonoFrame out;
  out.rate = rate;
  out.shift = view_shift(rate, halvings);
  out.stamp_ns = frame.stamp_ns;
  if (vignette_estimate_ && !left_contrast_) out.vignette = vignette_estimate_->current();
  // Without its light an image does not depend on its exposure.
  if (!left_contrast_) out.exposure_s = frame.left.exposure_s;
  auto pyramid = left_pyramids_.take();
  std::optional<ScopedStage> stage(std::in_place, observer, Stage::kUndistortion);
  pyramid->rebuild(max_levels_, [&](ImageF* image) {
    write_left(frame.left, readout_s_ * rate.tail<3>(), image);
    if (out.vignette.any()) left_vignette_->apply(out.vignette, image);
    for (int h = 0; h < halvings; ++h) {
      std::swap(*image, unhalved_left_);
      halve(unhalved_left_, image);
    }
    if (left_contrast_) left_contrast_->apply(image);
    stage.emplace(observer, Stage::kPyramid);
  });
  out.pyramid = std::move(pyramid);
  return out;
}

void FramePreparation::prepare_right(const SideImage& right, int halvings, const MonoFrame& left,
                                     ImagePyramid* out) const {
  out->rebuild(max_levels_, [&](ImageF* image) {
    to_float(right, cameras_.right_photometric, downscale_, image);
    if (left.vignette.any()) right_vignette_->apply(left.vignette, image);
    if (right_unroller_ && !left.rate.isZero(0.0)) {
      // Both cameras turn alike, each about its own axes.
      const Vec3 turn = readout_s_ * (cameras_.rig.T_right_left.rotation() * left.rate.tail<3>());
      ImageF unrolled;
      Unroller::Lattice lattice;
      right_unroller_->apply(*image, turn, &lattice, &unrolled);
      *image = std::move(unrolled);
    }
    for (int h = 0; h < halvings; ++h) {
      ImageF halved;
      halve(*image, &halved);
      *image = std::move(halved);
    }
    if (left_contrast_) LocalContrast(local_contrast_).apply(image);
  });
}

}  // namespace sovo
