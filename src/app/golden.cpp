#include "sovo/app/golden.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

namespace sovo::app {
namespace {

using Json = nlohmann::ordered_json;

Json frame_to_json(const GoldenFrame& frame) {
  Json json = {{"stamp_ns", frame.stamp_ns}, {"state", frame.state}};
  if (!frame.pose_valid) return json;
  const Vec3& t = frame.T_odom_left.translation();
  const auto& q = frame.T_odom_left.rotation().quaternion();
  json["position"] = {t.x(), t.y(), t.z()};
  json["quaternion_xyzw"] = {q.x(), q.y(), q.z(), q.w()};
  json["log_scale"] = frame.log_scale;
  return json;
}

GoldenFrame to_frame(const Json& json) {
  GoldenFrame frame;
  frame.stamp_ns = json.at("stamp_ns");
  frame.state = json.at("state");
  frame.pose_valid = json.contains("position");
  if (!frame.pose_valid) return frame;
  const auto t = json.at("position").get<std::array<double, 3>>();
  const auto q = json.at("quaternion_xyzw").get<std::array<double, 4>>();
  frame.T_odom_left = SE3(SO3(Eigen::Quaterniond(q[3], q[0], q[1], q[2])), Vec3(t[0], t[1], t[2]));
  frame.log_scale = json.at("log_scale");
  return frame;
}

GoldenTolerances distance(const GoldenFrame& a, const GoldenFrame& b) {
  const SE3 T = a.T_odom_left.inverse() * b.T_odom_left;
  return {T.translation().norm(), T.rotation().log().norm(), std::abs(a.log_scale - b.log_scale)};
}

/// Empty when the frames agree.
std::string difference(const GoldenFrame& expected, const GoldenFrame& actual,
                       const GoldenTolerances& allowed) {
  if (expected.stamp_ns != actual.stamp_ns) {
    return fmt::format("its stamp is {}, not {}", actual.stamp_ns, expected.stamp_ns);
  }
  if (expected.state != actual.state) {
    return fmt::format("its state is {}, not {}", actual.state, expected.state);
  }
  if (expected.pose_valid != actual.pose_valid) {
    return actual.pose_valid ? "it has a pose" : "it has no pose";
  }
  if (!expected.pose_valid) return {};
  const GoldenTolerances off = distance(expected, actual);
  if (!(off.position_m <= allowed.position_m)) {
    return fmt::format("its position is {:.4f} m off, allowed are {} m", off.position_m,
                       allowed.position_m);
  }
  if (!(off.rotation_rad <= allowed.rotation_rad)) {
    return fmt::format("its rotation is {:.5f} rad off, allowed are {} rad", off.rotation_rad,
                       allowed.rotation_rad);
  }
  if (!(off.log_scale <= allowed.log_scale)) {
    return fmt::format("its log-scale is {:.4f} off, allowed are {}", off.log_scale,
                       allowed.log_scale);
  }
  return {};
}

}  // namespace

std::string to_json(const Golden& golden) {
  Json json = {{"kernels", golden.kernels},
               {"tolerances",
                {{"position_m", golden.tolerances.position_m},
                 {"rotation_rad", golden.tolerances.rotation_rad},
                 {"log_scale", golden.tolerances.log_scale}}}};
  Json frames = Json::array();
  for (const GoldenFrame& frame : golden.frames) frames.push_back(frame_to_json(frame));
  json["frames"] = std::move(frames);
  return json.dump(1) + "\n";
}

Result<Golden> parse_golden(const std::string& text, const std::string& name) {
  try {
    const Json json = Json::parse(text);
    Golden golden;
    golden.kernels = json.at("kernels");
    const Json& tolerances = json.at("tolerances");
    golden.tolerances = {tolerances.at("position_m"), tolerances.at("rotation_rad"),
                         tolerances.at("log_scale")};
    for (const Json& frame : json.at("frames")) golden.frames.push_back(to_frame(frame));
    return golden;
  } catch (const std::exception& e) {
    return Error{name + " is not a golden file (" + e.what() + "); write it anew with --update"};
  }
}

std::optional<std::string> first_difference(const Golden& expected, const Golden& actual) {
  const std::size_t both = std::min(expected.frames.size(), actual.frames.size());
  for (std::size_t i = 0; i < both; ++i) {
    const std::string what = difference(expected.frames[i], actual.frames[i], expected.tolerances);
    if (what.empty()) continue;
    return fmt::format("frame {} (stamp {}) is the first that differs: {}", i,
                       expected.frames[i].stamp_ns, what);
  }
  if (expected.frames.size() == actual.frames.size()) return std::nullopt;
  return fmt::format("{} frames, not {}", actual.frames.size(), expected.frames.size());
}

GoldenTolerances largest_differences(const Golden& expected, const Golden& actual) {
  GoldenTolerances largest = {0.0, 0.0, 0.0};
  const std::size_t both = std::min(expected.frames.size(), actual.frames.size());
  for (std::size_t i = 0; i < both; ++i) {
    if (!expected.frames[i].pose_valid || !actual.frames[i].pose_valid) continue;
    const GoldenTolerances off = distance(expected.frames[i], actual.frames[i]);
    largest.position_m = std::max(largest.position_m, off.position_m);
    largest.rotation_rad = std::max(largest.rotation_rad, off.rotation_rad);
    largest.log_scale = std::max(largest.log_scale, off.log_scale);
  }
  return largest;
}

void GoldenRecorder::on_frame(const OdometryOutput& output) {
  const std::lock_guard lock(mutex_);
  frames_.push_back({output.stamp_ns, to_string(output.state), output.pose_valid,
                     output.T_odom_left, output.log_scale});
}

std::vector<GoldenFrame> GoldenRecorder::frames() const {
  const std::lock_guard lock(mutex_);
  return frames_;
}

}  // namespace sovo::app
