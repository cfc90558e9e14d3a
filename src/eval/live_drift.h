#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/io/trajectory_file.h"

namespace sovo {

/// Compares poses with the truth while they come: where the camera is said to be against where it
/// is, both seen from the first pose.
class LiveDrift {
 public:
  /// `truth` of the left camera, stamps ascending.
  explicit LiveDrift(Trajectory truth);

  struct Value {
    double drift_m = 0.0;  ///< Distance between both positions.
    double path_m = 0.0;   ///< Length of the true path since the first pose.
  };

  /// A pose of the left camera in a world of its own. A new `segment` begins anew. Nothing when
  /// the truth has no pose at this stamp (within half its period).
  std::optional<Value> update(std::int64_t stamp_ns, std::uint32_t segment, const SE3& T_odom_left);

  const Trajectory& truth() const { return truth_; }

 private:
  std::optional<std::size_t> find(std::int64_t stamp_ns) const;

  Trajectory truth_;
  std::vector<double> path_;  ///< Up to each pose [m].
  std::optional<std::uint32_t> segment_;
  std::size_t first_ = 0;
  SE3 T_truth_odom_;
};

}  // namespace sovo
