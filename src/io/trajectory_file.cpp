#include "sovo/io/trajectory_file.h"

#include <array>
#include <cmath>

#include "sovo/io/number_lines.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr double kUnitTolerance = 0.01;
constexpr std::int64_t kKittiPeriodNs = 100000000;

/// Position and quaternion from seven columns; `w_first` tells EuRoC's order from TUM's.
Result<SE3> parse_pose(const NumberLine& line, std::size_t first, bool w_first) {
  static constexpr std::array<const char*, 7> kTum = {"tx", "ty", "tz", "qx", "qy", "qz", "qw"};
  static constexpr std::array<const char*, 7> kEuroc = {"px", "py", "pz", "qw", "qx", "qy", "qz"};
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < 7; ++i) {
    const auto number = line.number(first + i, (w_first ? kEuroc : kTum)[i]);
    if (!number) return number.failure();
    v[i] = *number;
  }
  const Eigen::Quaterniond q = w_first ? Eigen::Quaterniond(v[3], v[4], v[5], v[6])
                                       : Eigen::Quaterniond(v[6], v[3], v[4], v[5]);
  if (std::abs(q.norm() - 1.0) > kUnitTolerance) {
    return line.error("the quaternion has length " + format_double(q.norm()) + ", not 1");
  }
  return SE3(SO3(q), Vec3(v[0], v[1], v[2]));
}

Result<void> append(const NumberLine& line, std::int64_t stamp_ns, const SE3& pose,
                    Trajectory* trajectory) {
  if (!trajectory->empty() && stamp_ns <= trajectory->back().stamp_ns) {
    return line.error("the stamp is not later than the one before");
  }
  trajectory->push_back({stamp_ns, pose});
  return {};
}

Result<Trajectory> parse_tum(const NumberFile& file) {
  Trajectory trajectory;
  for (const NumberLine& line : file.lines()) {
    if (line.size() != 8) {
      return line.error("has " + std::to_string(line.size()) +
                        " fields; 8 are needed: t tx ty tz qx qy qz qw");
    }
    const auto stamp = parse_seconds_as_ns(line.field(0));
    if (!stamp) return line.bad_field(0, "t", "seconds");
    const auto pose = parse_pose(line, 1, false);
    if (!pose) return pose.failure();
    if (const auto done = append(line, *stamp, *pose, &trajectory); !done) return done.failure();
  }
  if (trajectory.empty()) return Error{file.path() + ": has no poses"};
  return trajectory;
}

Result<Trajectory> parse_euroc(const NumberFile& file) {
  Trajectory trajectory;
  for (const NumberLine& line : file.lines()) {
    if (line.size() < 8) {
      return line.error("has " + std::to_string(line.size()) +
                        " fields; 8 or more are needed: stamp, position, quaternion w x y z");
    }
    const auto stamp = parse_integer(line.field(0));
    if (!stamp) return line.bad_field(0, "timestamp", "whole nanoseconds");
    const auto pose = parse_pose(line, 1, true);
    if (!pose) return pose.failure();
    if (const auto done = append(line, *stamp, *pose, &trajectory); !done) return done.failure();
  }
  if (trajectory.empty()) return Error{file.path() + ": has no poses"};
  return trajectory;
}

Result<std::vector<Mat34>> parse_kitti(const NumberFile& file) {
  std::vector<Mat34> matrices;
  for (const NumberLine& line : file.lines()) {
    if (line.size() != 12) {
      return line.error("has " + std::to_string(line.size()) +
                        " fields; 12 are needed: the rows of [R | t]");
    }
    Mat34 m;
    for (std::size_t i = 0; i < 12; ++i) {
      const auto number = line.number(i, "number " + std::to_string(i + 1));
      if (!number) return number.failure();
      m(static_cast<int>(i / 4), static_cast<int>(i % 4)) = *number;
    }
    const Mat3 r = m.leftCols<3>();
    if (!((r * r.transpose() - Mat3::Identity()).norm() < kUnitTolerance) ||
        r.determinant() < 0.0) {
      return line.error("the left 3x3 block is not a rotation");
    }
    matrices.push_back(m);
  }
  if (matrices.empty()) return Error{file.path() + ": has no poses"};
  return matrices;
}

Result<Trajectory> join_kitti(const NumberFile& file, const std::string& times_path) {
  const auto matrices = parse_kitti(file);
  if (!matrices) return matrices.failure();
  std::vector<std::int64_t> times;
  if (!times_path.empty()) {
    auto read = read_kitti_times(times_path);
    if (!read) return read.failure();
    times = std::move(*read);
    if (times.size() < matrices->size()) {
      return Error{times_path + ": has " + std::to_string(times.size()) + " times, but " +
                   file.path() + " has " + std::to_string(matrices->size()) + " poses"};
    }
  }
  Trajectory trajectory;
  for (std::size_t i = 0; i < matrices->size(); ++i) {
    const Mat34& m = (*matrices)[i];
    const std::int64_t stamp =
        times.empty() ? static_cast<std::int64_t>(i) * kKittiPeriodNs : times[i];
    trajectory.push_back({stamp, SE3(Mat3(m.leftCols<3>()), m.col(3))});
  }
  return trajectory;
}

}  // namespace

Result<Trajectory> read_tum(const std::string& path) {
  const auto file = NumberFile::read(path, " \t,");
  if (!file) return file.failure();
  return parse_tum(*file);
}

std::string format_tum(const Trajectory& trajectory, const std::string& comment) {
  std::string out = comment.empty() ? "" : "# " + comment + "\n";
  for (const StampedPose& pose : trajectory) {
    out += format_ns_as_seconds(pose.stamp_ns);
    Eigen::Vector4d q = pose.T_world_body.rotation().quaternion().coeffs();
    if (q.w() < 0.0) q = -q;
    for (const double value : pose.T_world_body.translation()) out += " " + format_fixed(value, 9);
    for (const double value : q) out += " " + format_fixed(value, 9);
    out += "\n";
  }
  return out;
}

Result<void> write_tum(const std::string& path, const Trajectory& trajectory,
                       const std::string& comment) {
  return write_text_file(path, format_tum(trajectory, comment));
}

Result<std::vector<Mat34>> read_kitti_matrices(const std::string& path) {
  const auto file = NumberFile::read(path, " \t");
  if (!file) return file.failure();
  return parse_kitti(*file);
}

Result<std::vector<std::int64_t>> read_kitti_times(const std::string& path) {
  const auto file = NumberFile::read(path, " \t");
  if (!file) return file.failure();
  std::vector<std::int64_t> times;
  for (const NumberLine& line : file->lines()) {
    const auto stamp = parse_seconds_as_ns(line.field(0));
    if (!stamp || line.size() != 1) return line.error("one time in seconds is needed");
    if (!times.empty() && *stamp <= times.back()) {
      return line.error("the stamp is not later than the one before");
    }
    times.push_back(*stamp);
  }
  if (times.empty()) return Error{path + ": has no times"};
  return times;
}

Result<Trajectory> read_kitti_poses(const std::string& path, const std::string& times_path) {
  const auto file = NumberFile::read(path, " \t");
  if (!file) return file.failure();
  return join_kitti(*file, times_path);
}

Result<void> write_kitti_poses(const std::string& path, const Trajectory& trajectory) {
  std::string out;
  for (const StampedPose& pose : trajectory) {
    const Mat4 m = pose.T_world_body.matrix();
    for (int i = 0; i < 12; ++i) out += (i == 0 ? "" : " ") + format_double(m(i / 4, i % 4));
    out += "\n";
  }
  return write_text_file(path, out);
}

Result<Trajectory> read_euroc_csv(const std::string& path) {
  const auto file = NumberFile::read(path, ", \t");
  if (!file) return file.failure();
  return parse_euroc(*file);
}

Result<Trajectory> read_trajectory(const std::string& path, const std::string& times_path) {
  const auto file = NumberFile::read(path, ", \t");
  if (!file) return file.failure();
  if (file->lines().empty()) return Error{path + ": has no poses"};
  if (file->has_commas()) return parse_euroc(*file);
  if (file->lines().front().size() == 12) return join_kitti(*file, times_path);
  return parse_tum(*file);
}

}  // namespace sovo
