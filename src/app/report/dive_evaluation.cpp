#include "sovo/app/report/dive_evaluation.h"

#include <string>

#include "sovo/app/report/dive_runs.h"

namespace sovo::app {
namespace {

/// The left camera in a world of its own: `odom` has the axes of the base, the odometry's world
/// those of the camera, T_odom_base = A T_world_left A^-1 with A = T_base_left.
Trajectory left_trajectory(const Dive& dive, const SE3& T_base_left) {
  Trajectory trajectory;
  for (const DivePose& pose : dive.poses) {
    const bool follows = trajectory.empty() || pose.stamp_ns > trajectory.back().stamp_ns;
    if (!pose.metric || !follows) continue;
    trajectory.push_back({pose.stamp_ns, T_base_left.inverse() * pose.T_odom_base * T_base_left});
  }
  return trajectory;
}

}  // namespace

Result<DiveEvaluation> evaluate_dive(const Dive& whole, const EvaluationFiles& files,
                                     const EvaluationOptions& options) {
  const std::vector<Dive> longest = runs_of(whole, 1);
  const Dive& dive = longest.empty() ? whole : longest.front();
  const SE3 T_base_left = dive.cameras ? dive.cameras->rig.T_base_left : SE3();
  auto input = read_evaluation_input(files, left_trajectory(dive, T_base_left));
  if (!input) return input.failure();
  if (!dive.cameras) {
    input->notes.emplace_back(
        "no calibration was recorded: the base frame is compared as if it were the left camera");
  }
  const std::uint32_t run = dive.poses.empty() ? 0 : dive.poses.front().run;
  if (const std::size_t runs = count_runs(whole); runs > 1) {
    input->notes.push_back("the odometry was started " + std::to_string(runs) +
                           " times, each with an odom of its own: run " + std::to_string(run + 1) +
                           " is compared, which has the most poses");
  }
  auto report = evaluate(*input, options);
  if (!report) return Error{files.truth + ": " + report.error()};
  DiveEvaluation result{std::move(*report), {}, run};
  const Sim3 S_estimate_truth = result.report.rigid.S_truth_estimate.inverse();
  for (const SE3& pose : result.report.truth) {
    const SE3 T_truth_base = pose * T_base_left.inverse();
    result.truth.push_back(T_base_left * (S_estimate_truth * T_truth_base.translation()));
  }
  return result;
}

}  // namespace sovo::app
