#pragma once

#include <string>
#include <vector>

#include "sovo/eval/keyframe_file.h"
#include "sovo/io/result.h"
#include "sovo/io/trajectory_file.h"

namespace sovo {

/// The files of an evaluation.
struct EvaluationFiles {
  std::string truth;              ///< TUM, KITTI or EuRoC, told apart by content.
  std::string estimate;           ///< Likewise.
  std::string times;              ///< Times of KITTI poses; empty: looked for beside the poses.
  std::string truth_calibration;  ///< Brings truth of the body to the left camera; may be empty.
  std::string keyframes;          ///< The run's `--keyframes` file; may be empty.
};

/// What is compared: both trajectories are of the left camera.
struct EvaluationInput {
  Trajectory truth;
  Trajectory estimate;
  std::vector<KeyframeRecord> keyframes;
  std::vector<std::string> notes;  ///< For people: what was assumed.
};

/// Reads all files. The error names the file and says what to do.
Result<EvaluationInput> read_evaluation_input(const EvaluationFiles& files);

/// The same for an estimate that is in no file: of the left camera, stamps ascending.
Result<EvaluationInput> read_evaluation_input(const EvaluationFiles& files, Trajectory estimate);

/// T_body_left of a calibration: `T_BS` of an EuRoC sensor.yaml (of that very file), else what
/// `load_calibration` gives as T_base_left.
Result<SE3> read_body_from_left(const std::string& path);

}  // namespace sovo
