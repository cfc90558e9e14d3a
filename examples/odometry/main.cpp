#include <cmath>
#include <cstdio>

#include "painted_wall.h"
#include "sovo/odometry/stereo_odometry.h"

struct Printer : sovo::OutputSink {
  void on_frame(const sovo::OdometryOutput& output) override {
    x = output.pose_valid ? output.T_odom_left.translation().x() : NAN;
    std::printf("%s: x = %.4f m\n", to_string(output.state).c_str(), x);
  }
  void on_keyframe(const sovo::KeyframeOutput& /*keyframe*/) override {}
  void on_scale(const sovo::ScaleRecord& /*record*/) override {}
  double x = NAN;
};

/// A stereo rig of 10 cm baseline moves 2 cm to the right between two pairs; the odometry says so.
int main() {
  sovo::StereoCameras cameras;
  cameras.rig.left = cameras.rig.right = wall_camera();
  cameras.rig.T_right_left.translation().x() = -0.1;

  Printer printer;
  sovo::StereoOdometry odometry({.deterministic = true}, cameras, &printer);
  for (int i = 0; i < 2; ++i) {
    sovo::StereoFrame frame;
    frame.stamp_ns = 50'000'000 * i;
    frame.sequence = i;
    frame.left = photograph(0.02 * i);
    frame.right = photograph(0.02 * i + 0.1);
    odometry.process(frame);
  }
  odometry.finish();
  return std::abs(printer.x - 0.02) < 0.001 ? 0 : 1;
}
