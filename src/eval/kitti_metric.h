#pragma once

#include <span>
#include <vector>

#include "sovo/geometry/se3.h"

namespace sovo {

/// Error of one piece of trajectory, per metre of its length.
struct SegmentError {
  int first_frame = 0;          ///< Index of the piece's first pose.
  int last_frame = 0;           ///< Index of its last pose.
  double length = 0.0;          ///< Nominal length [m].
  double translation = 0.0;     ///< Translational error / length [1].
  double rotation = 0.0;        ///< Rotational error / length [rad/m].
  double best_scale = 1.0;      ///< Factor on the estimate that makes this piece fit best.
  double translation_best = 0;  ///< `translation` with that factor applied: what is not scale.
};

/// Averages over a set of pieces.
struct SegmentSummary {
  double length = 0.0;                 ///< Nominal length of the pieces [m]; 0 for all lengths.
  int count = 0;                       ///< Number of pieces; the others mean nothing when 0.
  double translation_mean = 0.0;       ///< What the KITTI devkit reports and papers call t_rel [1].
  double translation_rms = 0.0;        ///< True root mean square [1].
  double rotation_mean = 0.0;          ///< [rad/m]
  double rotation_rms = 0.0;           ///< [rad/m]
  double translation_best_mean = 0.0;  ///< Mean with each piece at its own best scale [1].
};

/// The lengths of the KITTI devkit: 100, 200, ... 800 m.
std::vector<double> kitti_lengths();

/// Distance travelled at each pose since the first [m].
std::vector<double> travelled_distances(std::span<const SE3> poses);

/// Relative pose errors as the KITTI odometry devkit defines them. Pieces start at every
/// `step`-th frame (10 in the devkit) and end at the first frame that is farther along the truth
/// than the start by more than the length; E = (Te_i^-1 Te_j)^-1 (T_i^-1 T_j) with truth T and
/// estimate Te. Poses of both run in parallel and map camera to world, each in a world of its own.
/// Lengths that the path does not reach give no pieces.
std::vector<SegmentError> kitti_segments(std::span<const SE3> truth, std::span<const SE3> estimate,
                                         std::span<const double> lengths, int step = 10);

/// Averages over all pieces.
SegmentSummary summarize(std::span<const SegmentError> segments);

/// Averages over the pieces of each length; lengths without pieces are left out.
std::vector<SegmentSummary> summarize_by_length(std::span<const SegmentError> segments,
                                                std::span<const double> lengths);

}  // namespace sovo
