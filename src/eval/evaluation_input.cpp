#include "sovo/eval/evaluation_input.h"

#include <filesystem>

#include "sovo/io/calibration.h"
#include "sovo/io/calibration_formats.h"
#include "sovo/io/number_lines.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

enum class Format { kTum, kKitti, kEuroc };

Result<Format> format_of(const std::string& path) {
  const auto file = NumberFile::read(path, ", \t");
  if (!file) return file.failure();
  if (file->lines().empty()) return Error{path + ": has no poses"};
  if (file->has_commas()) return Format::kEuroc;
  return file->lines().front().size() == 12 ? Format::kKitti : Format::kTum;
}

/// times.txt beside the poses, or in the sequence of the same name as KITTI lays them out.
std::string find_times(const std::string& poses) {
  const fs::path path(poses);
  const fs::path folder = path.parent_path();
  for (const fs::path& candidate :
       {folder / "times.txt", folder / ".." / "sequences" / path.stem() / "times.txt"}) {
    if (fs::is_regular_file(candidate)) return candidate.lexically_normal().string();
  }
  return "";
}

/// The times file of KITTI poses; poses are worthless beside stamped ones without it.
Result<std::string> times_for(const EvaluationFiles& files, Format truth, Format estimate) {
  if (truth != Format::kKitti && estimate != Format::kKitti) return std::string();
  if (!files.times.empty()) return files.times;
  const std::string& poses = truth == Format::kKitti ? files.truth : files.estimate;
  const std::string found = find_times(poses);
  if (found.empty() && truth != estimate) {
    return Error{poses + ": KITTI poses have no stamps, and no times.txt was found; give --times"};
  }
  return found;
}

Result<void> bring_to_left_camera(const std::string& calibration, Trajectory* truth) {
  const auto T_body_left = read_body_from_left(calibration);
  if (!T_body_left) return T_body_left.failure();
  for (StampedPose& pose : *truth) pose.T_world_body = pose.T_world_body * *T_body_left;
  return {};
}

/// What the notes of the input say about assumptions.
void note_assumptions(const EvaluationFiles& files, Format truth, const std::string& times,
                      EvaluationInput* input) {
  if (files.truth_calibration.empty() && truth == Format::kEuroc) {
    input->notes.push_back("EuRoC truth is of the body: give --gt-calib to bring it to the camera");
  }
  if (!times.empty() && files.times.empty()) input->notes.push_back("times from " + times);
}

/// Everything that stands beside the estimate. `times`: of KITTI poses.
Result<EvaluationInput> read_beside(const EvaluationFiles& files, Format truth_format,
                                    const std::string& times, Trajectory estimate) {
  auto truth = read_trajectory(files.truth, truth_format == Format::kKitti ? times : "");
  if (!truth) return truth.failure();
  EvaluationInput input{std::move(*truth), std::move(estimate), {}, {}};
  if (!files.truth_calibration.empty()) {
    const auto brought = bring_to_left_camera(files.truth_calibration, &input.truth);
    if (!brought) return brought.failure();
  }
  note_assumptions(files, truth_format, times, &input);
  if (!files.keyframes.empty()) {
    auto keyframes = read_keyframes(files.keyframes);
    if (!keyframes) return keyframes.failure();
    input.keyframes = std::move(*keyframes);
  }
  return input;
}

}  // namespace

Result<SE3> read_body_from_left(const std::string& path) {
  try {
    if (fs::is_regular_file(path)) {
      const auto text = calibration_formats::value_or_throw(read_text_file(path));
      if (text.find("\nT_BS") != std::string::npos || text.starts_with("T_BS")) {
        const YamlField pose = calibration_formats::read_yaml_file(path).at("T_BS");
        return calibration_formats::rigid_from_matrix(pose.matrix(4, 4), pose.error("").what());
      }
    }
  } catch (const FormatError& error) {
    return Error{error.what()};
  }
  CalibrationOptions options;
  options.validate = false;
  const auto calibration = load_calibration(path, options);
  if (!calibration) return calibration.failure();
  return calibration->rig.T_base_left;
}

Result<EvaluationInput> read_evaluation_input(const EvaluationFiles& files) {
  const auto truth_format = format_of(files.truth);
  if (!truth_format) return truth_format.failure();
  const auto estimate_format = format_of(files.estimate);
  if (!estimate_format) return estimate_format.failure();
  const auto times = times_for(files, *truth_format, *estimate_format);
  if (!times) return times.failure();
  auto estimate = read_trajectory(files.estimate, *estimate_format == Format::kKitti ? *times : "");
  if (!estimate) return estimate.failure();
  return read_beside(files, *truth_format, *times, std::move(*estimate));
}

Result<EvaluationInput> read_evaluation_input(const EvaluationFiles& files, Trajectory estimate) {
  const auto truth_format = format_of(files.truth);
  if (!truth_format) return truth_format.failure();
  const auto times = times_for(files, *truth_format, Format::kTum);
  if (!times) return times.failure();
  return read_beside(files, *truth_format, *times, std::move(estimate));
}

}  // namespace sovo
