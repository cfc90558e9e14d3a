#include "sovo/eval/evaluation.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "sovo/eval/association.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

using Stamps = std::vector<std::int64_t>;

Stamps stamps_of(const Trajectory& trajectory) {
  Stamps stamps;
  stamps.reserve(trajectory.size());
  for (const StampedPose& pose : trajectory) stamps.push_back(pose.stamp_ns);
  return stamps;
}

void take_pairs(const EvaluationInput& input, const std::vector<StampPair>& pairs,
                EvaluationReport* report) {
  std::int64_t worst = 0;
  const std::int64_t first = input.estimate[pairs.front().estimate].stamp_ns;
  for (const StampPair& pair : pairs) {
    const StampedPose& truth = input.truth[pair.truth];
    const StampedPose& estimate = input.estimate[pair.estimate];
    worst = std::max(worst, std::abs(truth.stamp_ns - estimate.stamp_ns));
    report->times.push_back(1e-9 * static_cast<double>(estimate.stamp_ns - first));
    report->truth.push_back(truth.T_world_body);
    report->estimate.push_back(estimate.T_world_body);
  }
  report->compared = pairs.size();
  report->worst_stamp_gap_s = 1e-9 * static_cast<double>(worst);
  report->duration_s = report->times.back();
  report->distances = travelled_distances(report->truth);
  report->path_length = report->distances.back();
}

/// How many frames should have a pose: as told, else the truth's poses when it has one a frame,
/// else as many frames of the estimate's period as fit into the truth's span.
void set_completion(const Stamps& truth, const Stamps& estimate, std::size_t frames,
                    EvaluationReport* report) {
  const double truth_period = static_cast<double>(median_period(truth));
  const double period = static_cast<double>(median_period(estimate));
  std::size_t valid = report->compared;
  if (frames > 0) {
    report->expected = frames;
    report->expected_is = "frames fed";
    valid = estimate.size();
  } else if (!(truth_period > 0.0) || !(period > 0.0) || truth_period > 0.67 * period) {
    report->expected = truth.size();
    report->expected_is = "poses of the truth";
  } else {
    const double span = static_cast<double>(truth.back() - truth.front());
    report->expected = static_cast<std::size_t>(std::lround(span / period)) + 1;
    report->expected_is = "frames in the truth's span";
  }
  report->completion = static_cast<double>(valid) / static_cast<double>(report->expected);
}

std::string list_of(const std::vector<double>& values) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + format_double(v);
  return text;
}

void compare_segments(const EvaluationOptions& options, EvaluationReport* report) {
  report->lengths = options.lengths;
  report->step = options.step;
  if (report->lengths.empty()) {
    report->lengths = default_lengths(report->path_length);
    report->notes.push_back(report->lengths.empty()
                                ? "the path is too short for pieces of 1 m"
                                : "lengths " + list_of(report->lengths) +
                                      " m chosen for a path of " +
                                      format_fixed(report->path_length, 1) + " m");
  }
  report->segments = kitti_segments(report->truth, report->estimate, report->lengths, report->step);
  report->overall = summarize(report->segments);
  report->by_length = summarize_by_length(report->segments, report->lengths);
}

/// Indices of the compared poses at the keyframes, or of all without keyframes.
std::vector<int> scale_starts(const EvaluationInput& input, const std::vector<StampPair>& pairs,
                              std::int64_t tolerance) {
  std::vector<int> starts;
  if (input.keyframes.empty()) {
    for (std::size_t i = 0; i < pairs.size(); ++i) starts.push_back(static_cast<int>(i));
    return starts;
  }
  Stamps compared;
  for (const StampPair& pair : pairs) compared.push_back(input.estimate[pair.estimate].stamp_ns);
  Stamps keyframes;
  for (const KeyframeRecord& record : input.keyframes) keyframes.push_back(record.stamp_ns);
  std::sort(keyframes.begin(), keyframes.end());
  for (const StampPair& pair : associate(compared, keyframes, tolerance)) {
    starts.push_back(static_cast<int>(pair.truth));
  }
  return starts;
}

void compare_scale(const EvaluationInput& input, std::span<const int> starts,
                   const EvaluationOptions& options, EvaluationReport* report) {
  constexpr double kDrivingSpeed = 2.0;  // [m/s]
  constexpr double kDrivingLength = 10.0;
  constexpr double kHandheldLength = 0.5;
  const bool driving = report->path_length > kDrivingSpeed * report->duration_s;
  report->scale_length = options.scale_length > 0.0 ? options.scale_length
                         : driving                  ? kDrivingLength
                                                    : kHandheldLength;
  report->at_keyframes = !input.keyframes.empty();
  report->scale_samples =
      scale_errors(report->truth, report->estimate, starts, report->scale_length);
  report->scale = summarize(report->scale_samples);
  std::vector<double> sigmas;
  for (const KeyframeRecord& record : input.keyframes) {
    ++report->verdicts[record.verdict];
    if (std::isfinite(record.sigma) && record.sigma > 0.0) sigmas.push_back(record.sigma);
  }
  report->median_sigma = quantile(sigmas, 0.5);
}

}  // namespace

std::vector<double> default_lengths(double path_length) {
  const double unit = path_length > 150.0 ? 100.0 : path_length > 20.0 ? 10.0 : 1.0;
  std::vector<double> lengths;
  for (int i = 1; i <= 8; ++i) {
    if (i * unit < path_length) lengths.push_back(i * unit);
  }
  return lengths;
}

Result<EvaluationReport> evaluate(const EvaluationInput& input, const EvaluationOptions& options) {
  const Stamps truth = stamps_of(input.truth);
  const Stamps estimate = stamps_of(input.estimate);
  const std::int64_t tolerance = options.tolerance_s > 0.0 ? std::llround(1e9 * options.tolerance_s)
                                                           : default_tolerance(truth, estimate);
  const std::vector<StampPair> pairs = associate(truth, estimate, tolerance);
  if (pairs.size() < 3) {
    return Error{"only " + std::to_string(pairs.size()) + " of " + std::to_string(estimate.size()) +
                 " estimated poses have a truth within " +
                 format_double(1e-6 * static_cast<double>(tolerance)) +
                 " ms; are both files of the same recording and clock?"};
  }
  EvaluationReport report;
  report.notes = input.notes;
  report.truth_poses = truth.size();
  report.estimate_poses = estimate.size();
  take_pairs(input, pairs, &report);
  set_completion(truth, estimate, options.frames, &report);
  compare_segments(options, &report);
  report.rigid = absolute_error(report.truth, report.estimate, AlignmentKind::kRigid);
  report.similarity = absolute_error(report.truth, report.estimate, AlignmentKind::kSimilarity);
  report.yaw = absolute_error(report.truth, report.estimate, AlignmentKind::kYaw);
  report.rotation = statistics_of(rotation_errors(report.truth, report.estimate));
  compare_scale(input, scale_starts(input, pairs, tolerance), options, &report);
  return report;
}

}  // namespace sovo
