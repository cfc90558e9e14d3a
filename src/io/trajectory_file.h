#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "sovo/geometry/se3.h"
#include "sovo/io/result.h"

namespace sovo {

/// One pose of a trajectory. Which body, and which world, is for the file's owner to know.
struct StampedPose {
  std::int64_t stamp_ns = 0;
  SE3 T_world_body;
};

using Trajectory = std::vector<StampedPose>;

/// TUM format: `t tx ty tz qx qy qz qw`, t in decimal seconds, kept to the nanosecond; `#` begins a
/// comment. Refused: fields that are missing, not numbers or not finite, quaternions that are not
/// unit to 1 %, stamps that do not increase; the error names file, line and field.
Result<Trajectory> read_tum(const std::string& path);

/// Writes TUM format with nine decimals of stamp, position and quaternion (w >= 0). `comment`, when
/// not empty, becomes the first line.
Result<void> write_tum(const std::string& path, const Trajectory& trajectory,
                       const std::string& comment = "");

/// The text that `write_tum` writes.
std::string format_tum(const Trajectory& trajectory, const std::string& comment = "");

/// A KITTI pose as its file has it, not projected onto the rotations.
using Mat34 = Eigen::Matrix<double, 3, 4>;

/// KITTI poses: the 12 numbers of a 3x4 matrix [R | t] a line, row-major, left camera. Refused
/// likewise, and matrices whose rotation is not one to 1 %.
Result<std::vector<Mat34>> read_kitti_matrices(const std::string& path);

/// KITTI times: decimal seconds, one a line.
Result<std::vector<std::int64_t>> read_kitti_times(const std::string& path);

/// KITTI poses with their stamps. Without a times file (empty path) they are 0.1 s apart from 0 on,
/// KITTI's nominal rate. Times may be more than poses, not fewer.
Result<Trajectory> read_kitti_poses(const std::string& path, const std::string& times_path = "");

/// Writes KITTI poses; the stamps are lost.
Result<void> write_kitti_poses(const std::string& path, const Trajectory& trajectory);

/// EuRoC ground truth (`state_groundtruth_estimate0/data.csv`, or TUM-VI's `mocap0/data.csv`):
/// stamp [ns], position, quaternion w x y z, further columns ignored.
Result<Trajectory> read_euroc_csv(const std::string& path);

/// Any of the three, recognised by content: commas are EuRoC, 12 columns KITTI, 8 TUM.
Result<Trajectory> read_trajectory(const std::string& path, const std::string& times_path = "");

}  // namespace sovo
