#pragma once

#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "sovo/io/result.h"
#include "sovo/odometry/odometry_output.h"

namespace sovo::app {

/// How far a run may be from its golden file.
struct GoldenTolerances {
  double position_m = 0.01;
  double rotation_rad = 0.005;
  double log_scale = 0.02;
};

/// What a run said of a frame.
struct GoldenFrame {
  std::int64_t stamp_ns = 0;
  std::string state;
  bool pose_valid = false;
  SE3 T_odom_left;
  double log_scale = 0.0;
};

/// A run to hold later ones against.
struct Golden {
  /// Whose bits the numbers have: those of scalar code, whatever registers computed them.
  std::string kernels = "scalar";
  GoldenTolerances tolerances;
  std::vector<GoldenFrame> frames;
};

std::string to_json(const Golden& golden);
/// `name` is for the error text.
Result<Golden> parse_golden(const std::string& text, const std::string& name);

/// What the first frame that differs by more than the tolerances of `expected` is, and how;
/// nothing when there is none.
std::optional<std::string> first_difference(const Golden& expected, const Golden& actual);

/// Largest differences of poses that both have, for the report.
GoldenTolerances largest_differences(const Golden& expected, const Golden& actual);

/// Collects the frames of a run.
class GoldenRecorder : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override;
  void on_keyframe(const KeyframeOutput&) override {}
  void on_scale(const ScaleRecord&) override {}
  std::vector<GoldenFrame> frames() const;

 private:
  mutable std::mutex mutex_;
  std::vector<GoldenFrame> frames_;
};

}  // namespace sovo::app
