#pragma once

#include <map>
#include <string>
#include <vector>

#include "sovo/eval/absolute_error.h"
#include "sovo/eval/evaluation_input.h"
#include "sovo/eval/kitti_metric.h"
#include "sovo/eval/scale_error.h"
#include "sovo/io/result.h"

namespace sovo {

struct EvaluationOptions {
  std::vector<double> lengths;  ///< Of the pieces [m]; empty: chosen by the path's length.
  int step = 10;                ///< Every step-th frame starts a piece; 1 for short clips.
  double tolerance_s = 0.0;     ///< Between stamps [s]; 0: `default_tolerance`.
  std::size_t frames = 0;       ///< Frames that were fed; 0: as many as the truth tells.
  double scale_length = 0.0;    ///< Displacement for the scale error [m]; 0: chosen by speed.
};

/// Everything that `sovo eval` tells.
struct EvaluationReport {
  std::vector<std::string> notes;  ///< For people: what was assumed or chosen.

  std::size_t truth_poses = 0;
  std::size_t estimate_poses = 0;
  std::size_t compared = 0;        ///< Poses of the estimate that have a truth.
  std::size_t expected = 0;        ///< Frames there should be poses of.
  std::string expected_is;         ///< What `expected` counts.
  double completion = 0.0;         ///< Frames with a valid pose / expected [1].
  double worst_stamp_gap_s = 0.0;  ///< Between a pose and its truth [s].
  double duration_s = 0.0;         ///< Of the compared poses [s].
  double path_length = 0.0;        ///< Of the truth along the compared poses [m].

  std::vector<double> lengths;  ///< Of the pieces [m].
  int step = 10;
  std::vector<SegmentError> segments;
  SegmentSummary overall;
  std::vector<SegmentSummary> by_length;

  AbsoluteError rigid;
  AbsoluteError similarity;
  AbsoluteError yaw;
  Statistics rotation;  ///< [rad]

  double scale_length = 0.0;  ///< [m]
  bool at_keyframes = false;  ///< Scale errors start at keyframes, else at every pose.
  std::vector<ScaleSample> scale_samples;
  ScaleErrorSummary scale;
  std::map<std::string, int> verdicts;  ///< Of the scale optimizations, by name.
  double median_sigma = 0.0;            ///< Of the scale optimizations with one.

  // The compared poses, for plots: stamps [s] since the first, and distance travelled [m].
  std::vector<double> times;
  std::vector<double> distances;
  std::vector<SE3> truth;
  std::vector<SE3> estimate;
};

/// Compares two trajectories of the left camera. Errors: fewer than three poses have a truth.
Result<EvaluationReport> evaluate(const EvaluationInput& input, const EvaluationOptions& options);

/// Lengths for a path [m]: the devkit's 100..800 m above 150 m, 10..80 m above 20 m, else 1..8 m;
/// those longer than the path are left out.
std::vector<double> default_lengths(double path_length);

/// Table for the terminal.
std::string format_table(const EvaluationReport& report);

/// All numbers as JSON text (SI units, angles in radians), without the poses.
std::string format_json(const EvaluationReport& report);

/// Trajectory and errors as an SVG image.
std::string format_svg(const EvaluationReport& report, const std::string& title);

}  // namespace sovo
