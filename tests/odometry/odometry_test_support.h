#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "sovo/odometry/stereo_odometry.h"
#include "support/cameras.h"
#include "support/synthetic_scene.h"

namespace sovo::test {

inline constexpr double kBaseline = 0.11;
inline constexpr std::int64_t kPeriodNs = 50'000'000;

/// Small enough to be rendered in milliseconds; the right camera is another one than the left.
inline StereoCameras test_cameras() {
  StereoCameras cameras;
  cameras.rig.left = make_camera(240, 180, 195, 195, 119.2, 90.6);
  cameras.rig.right = make_camera(240, 180, 199, 198, 121.0, 88.3);
  cameras.rig.T_right_left = SE3(SO3::exp(Vec3(0.004, -0.003, 0.006)), Vec3(-kBaseline, 0.002, 0));
  return cameras;
}

/// A vehicle that comes forward and to the side, turning and swaying a little.
inline SE3 drive(double i) {
  const double s = 0.02 * i;
  return {SO3::exp(Vec3(0.012 * std::sin(5 * s), -0.12 * s, 0.015 * std::sin(3 * s))),
          Vec3(1.3 * s, 0.06 * std::sin(4 * s), 0.7 * s)};
}

inline SideImage side_of(const ImageF& image) {
  const ImageU8 grey = quantized(image);
  SideImage side;
  side.valid = true;
  side.width = side.step = grey.width();
  side.height = grey.height();
  side.data = std::make_shared<std::vector<std::uint8_t>>(grey.data(), grey.data() + grey.size());
  return side;
}

/// Frame `i` of the drive; rendered once a program.
inline StereoFrame drive_frame(int i) {
  static const SyntheticScene scene(3);
  static const StereoCameras cameras = test_cameras();
  static std::map<int, StereoFrame> rendered;
  const auto found = rendered.find(i);
  if (found != rendered.end()) return found->second;
  StereoFrame frame;
  frame.stamp_ns = 1'000'000'000 + i * kPeriodNs;
  frame.sequence = static_cast<std::uint64_t>(i);
  frame.session = 7;
  const SE3 pose = drive(i);
  frame.left = side_of(scene.render(cameras.rig.left, pose));
  frame.right = side_of(scene.render(cameras.rig.right, pose * cameras.rig.T_right_left.inverse()));
  return rendered.emplace(i, frame).first->second;
}

/// Frame `i` of the drive, of cameras that are not triggered together; rendered once a program.
inline StereoFrame staggered_frame(int i, std::int64_t right_offset_ns) {
  static const SyntheticScene scene(3);
  static std::map<std::pair<int, std::int64_t>, StereoFrame> rendered;
  const auto found = rendered.find({i, right_offset_ns});
  if (found != rendered.end()) return found->second;
  const StereoCameras cameras = test_cameras();
  StereoFrame frame = drive_frame(i);
  const double later = i + static_cast<double>(right_offset_ns) / static_cast<double>(kPeriodNs);
  frame.right =
      side_of(scene.render(cameras.rig.right, drive(later) * cameras.rig.T_right_left.inverse()));
  frame.right.stamp_offset_ns = right_offset_ns;
  frame.pair_error_s = 1e-9 * std::abs(static_cast<double>(right_offset_ns));
  rendered[{i, right_offset_ns}] = frame;
  return frame;
}

/// The first frame of the drive, as a rig sees it whose baseline is shorter by `factor`: depths
/// come out 1 / factor too long. (The drive begins at the identity.)
inline StereoFrame first_frame_of_narrow_rig(double factor) {
  const SyntheticScene scene(3);
  const StereoCameras cameras = test_cameras();
  SE3 T_right_left = cameras.rig.T_right_left;
  T_right_left.translation() *= factor;
  StereoFrame frame = drive_frame(0);
  frame.right = side_of(scene.render(cameras.rig.right, T_right_left.inverse()));
  return frame;
}

/// The same frame with every pixel of a side set.
inline StereoFrame with_left(StereoFrame frame, const std::function<int(int x, int y)>& value) {
  auto data = std::make_shared<std::vector<std::uint8_t>>(*frame.left.data);
  for (int y = 0; y < frame.left.height; ++y) {
    for (int x = 0; x < frame.left.width; ++x) {
      (*data)[static_cast<std::size_t>(y * frame.left.step + x)] =
          static_cast<std::uint8_t>(value(x, y));
    }
  }
  frame.left.data = data;
  return frame;
}

/// The same images as of frame `i` of the drive, by other noise.
inline StereoFrame with_noise(StereoFrame frame, int i) {
  frame.stamp_ns = drive_frame(i).stamp_ns;
  for (SideImage* side : {&frame.left, &frame.right}) {
    auto noisy = std::make_shared<std::vector<std::uint8_t>>(*side->data);
    for (std::size_t k = static_cast<std::size_t>(i) % 5; k < noisy->size(); k += 5) {
      (*noisy)[k] ^= 1U;
    }
    side->data = noisy;
  }
  return frame;
}

/// An image that has nothing to do with the drive, another one for each `i`.
inline StereoFrame unrelated_frame(int i) {
  return with_left(drive_frame(i), [i](int x, int y) {
    return ((x + 3 * i) / (9 + i % 3) + y / 7) % 2 == 0 ? 10 : 240;
  });
}

/// Frame `i` of the drive in the dark, by a lamp between the cameras that moves with them.
inline StereoFrame lamp_frame(int i) {
  const StereoCameras cameras = test_cameras();
  const auto lit = [&](const SideImage& side, const CameraModel& camera) {
    SideImage out = side;
    auto data = std::make_shared<std::vector<std::uint8_t>>(*side.data);
    for (int y = 0; y < side.height; ++y) {
      for (int x = 0; x < side.width; ++x) {
        // The beam's edge is 20 degrees from its middle.
        const double r2 = std::pow((x - camera.cx) / camera.fx, 2) +
                          std::pow((y - camera.cy - 20) / camera.fy, 2);
        std::uint8_t& p = (*data)[static_cast<std::size_t>(y * side.step + x)];
        p = static_cast<std::uint8_t>(std::lround(p * std::exp(-0.7 * r2 / (0.36 * 0.36))));
      }
    }
    out.data = data;
    return out;
  };
  StereoFrame frame = drive_frame(i);
  frame.left = lit(frame.left, cameras.rig.left);
  frame.right = lit(frame.right, cameras.rig.right);
  return frame;
}

/// As a lens out of focus shows it: the mean of (2 r + 1)^2 pixels, twice.
inline SideImage blurred(const SideImage& side, int r) {
  SideImage out = side;
  auto pixels = std::make_shared<std::vector<std::uint8_t>>(*side.data);
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<std::uint8_t> from = *pixels;
    for (int y = 0; y < side.height; ++y) {
      for (int x = 0; x < side.width; ++x) {
        int sum = 0;
        int count = 0;
        for (int j = std::max(y - r, 0); j <= std::min(y + r, side.height - 1); ++j) {
          for (int i = std::max(x - r, 0); i <= std::min(x + r, side.width - 1); ++i) {
            sum += from[static_cast<std::size_t>(j * side.step + i)];
            ++count;
          }
        }
        (*pixels)[static_cast<std::size_t>(y * side.step + x)] =
            static_cast<std::uint8_t>((2 * sum + count) / (2 * count));
      }
    }
  }
  out.data = pixels;
  return out;
}

inline StereoOdometryConfig test_config() {
  StereoOdometryConfig config;
  config.deterministic = true;
  config.threads = 1;
  config.vo.points.active_points = 600;
  config.vo.points.immature_points = 500;
  // Several keyframes in a second or two.
  config.vo.keyframe.flow_translation = 0.04;
  return config;
}

/// Keeps all that an odometry gives out.
class Recorder : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override { frames.push_back(output); }
  void on_keyframe(const KeyframeOutput& keyframe) override { keyframes.push_back(keyframe); }
  void on_scale(const ScaleRecord& record) override { scales.push_back(record); }

  std::vector<OdometryOutput> frames;
  std::vector<KeyframeOutput> keyframes;
  std::vector<ScaleRecord> scales;
};

/// An odometry with its outputs.
struct Playback {
  explicit Playback(const StereoOdometryConfig& config,
                    const StereoCameras& cameras = test_cameras())
      : odometry(config, cameras, &recorder) {}

  /// Gives a frame; checks that it yields exactly one output, and returns it.
  OdometryOutput give(const StereoFrame& frame) {
    const std::size_t before = recorder.frames.size();
    odometry.process(frame);
    EXPECT_EQ(recorder.frames.size(), before + 1);
    EXPECT_EQ(recorder.frames.back().stamp_ns, frame.stamp_ns);
    return recorder.frames.back();
  }

  void give_drive(int from, int to) {
    for (int i = from; i < to; ++i) give(drive_frame(i));
  }

  Recorder recorder;
  StereoOdometry odometry;
};

/// How far a trajectory is from the drive, its first pose laid on the drive's; and the ratio of
/// its length to the drive's.
struct DriveError {
  double rms = 0.0;    ///< Of position [m].
  double scale = 0.0;  ///< Estimated over true path length.
};

inline int index_of(std::int64_t stamp_ns) {
  return static_cast<int>((stamp_ns - 1'000'000'000) / kPeriodNs);
}

inline DriveError drive_error(const std::vector<TrajectoryPose>& trajectory) {
  const SE3 T_drive_odom =
      drive(index_of(trajectory.front().stamp_ns)) * trajectory.front().T_odom_left.inverse();
  double squares = 0.0;
  double length = 0.0;
  double true_length = 0.0;
  const TrajectoryPose* last = nullptr;
  for (const TrajectoryPose& p : trajectory) {
    const SE3 truth = drive(index_of(p.stamp_ns));
    const Vec3 error = T_drive_odom * p.T_odom_left.translation() - truth.translation();
    squares += error.squaredNorm();
    if (last != nullptr) {
      length += (p.T_odom_left.translation() - last->T_odom_left.translation()).norm();
      true_length += (truth.translation() - drive(index_of(last->stamp_ns)).translation()).norm();
    }
    last = &p;
  }
  return {std::sqrt(squares / static_cast<double>(trajectory.size())), length / true_length};
}

/// The poses that were published.
inline std::vector<TrajectoryPose> published(const Recorder& recorder) {
  std::vector<TrajectoryPose> out;
  for (const OdometryOutput& o : recorder.frames) {
    if (o.pose_valid) out.push_back({o.stamp_ns, o.T_odom_left});
  }
  return out;
}

inline constexpr int kDriveFrames = 24;

inline void expect_follows_the_drive(const std::vector<TrajectoryPose>& trajectory, double rms,
                                     double scale) {
  ASSERT_GT(trajectory.size(), 2U);
  for (std::size_t i = 1; i < trajectory.size(); ++i) {
    ASSERT_GT(trajectory[i].stamp_ns, trajectory[i - 1].stamp_ns);
  }
  const DriveError error = drive_error(trajectory);
  EXPECT_LT(error.rms, rms);
  EXPECT_NEAR(error.scale, 1.0, scale);
}

}  // namespace sovo::test
