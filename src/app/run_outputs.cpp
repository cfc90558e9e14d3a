#include "sovo/app/run_outputs.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <system_error>

#include "sovo/io/calibration.h"
#include "sovo/io/text.h"
#include "sovo/io/trajectory_file.h"

namespace sovo::app {
namespace {

std::int64_t map_stamp(const StampMap& map, std::int64_t stamp_ns) {
  return map ? map(stamp_ns) : stamp_ns;
}

/// The same trajectory seen from its first pose: refinement moves that one a little, too.
std::vector<TrajectoryPose> from_first(std::vector<TrajectoryPose> poses) {
  if (poses.empty()) return poses;
  const SE3 T_first_odom = poses.front().T_odom_left.inverse();
  for (TrajectoryPose& p : poses) p.T_odom_left = T_first_odom * p.T_odom_left;
  return poses;
}

Trajectory to_trajectory(const std::vector<TrajectoryPose>& poses, const StampMap& map) {
  Trajectory trajectory;
  trajectory.reserve(poses.size());
  for (const TrajectoryPose& p : poses) {
    trajectory.push_back({map_stamp(map, p.stamp_ns), p.T_odom_left});
  }
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  return trajectory;
}

std::string scale_csv(std::vector<ScaleRecord> records, const StampMap& map) {
  for (ScaleRecord& r : records) r.stamp_ns = map_stamp(map, r.stamp_ns);
  std::stable_sort(records.begin(), records.end(),
                   [](const auto& a, const auto& b) { return a.stamp_ns < b.stamp_ns; });
  std::string text = "stamp,correction,sigma,verdict\n";
  for (const ScaleRecord& r : records) {
    text += format_ns_as_seconds(r.stamp_ns) + "," + format_double(r.correction) + "," +
            format_double(r.sigma) + "," + to_string(r.verdict) + "\n";
  }
  return text;
}

Result<void> check_writable(const std::string& file) {
  const std::filesystem::path path(file);
  const std::filesystem::path folder = path.has_parent_path() ? path.parent_path() : ".";
  std::error_code error;
  if (!std::filesystem::is_directory(folder, error)) {
    return Error{file + ": the folder " + folder.string() + " does not exist; make it first"};
  }
  if (std::filesystem::is_directory(path, error)) return Error{file + " is a folder; name a file"};
  const std::filesystem::path& target = std::filesystem::exists(path, error) ? path : folder;
  if (access(target.c_str(), W_OK) != 0) return Error{file + ": no permission to write it"};
  return {};
}

}  // namespace

Result<void> check_outputs(const OutputSection& output) {
  for (const std::string* file :
       {&output.trajectory, &output.map_trajectory, &output.live_trajectory, &output.keyframes,
        &output.profile, &output.truth, &output.calibration}) {
    if (file->empty()) continue;
    if (auto writable = check_writable(*file); !writable) return writable;
  }
  return {};
}

Result<void> write_outputs(const OutputSection& output, const RunResults& results) {
  const StampMap& map = results.original_stamp;
  if (!output.trajectory.empty()) {
    auto done = write_tum(output.trajectory, to_trajectory(from_first(results.refined), map));
    if (!done) return done;
  }
  if (!output.map_trajectory.empty()) {
    auto done = write_tum(output.map_trajectory, to_trajectory(from_first(results.corrected), map));
    if (!done) return done;
  }
  if (!output.live_trajectory.empty()) {
    auto done =
        write_tum(output.live_trajectory, to_trajectory(results.recorder->live_poses(), map));
    if (!done) return done;
  }
  if (!output.keyframes.empty()) {
    auto done =
        write_text_file(output.keyframes, scale_csv(results.recorder->scale_records(), map));
    if (!done) return done;
  }
  if (!output.profile.empty()) {
    auto done = write_text_file(
        output.profile,
        profile_json(*results.profile, results.recorder->counts(), results.context));
    if (!done) return done;
  }
  if (!output.calibration.empty()) {
    auto done = write_text_file(output.calibration, format_sovo_calibration(results.rig));
    if (!done) return done;
  }
  return {};
}

}  // namespace sovo::app
