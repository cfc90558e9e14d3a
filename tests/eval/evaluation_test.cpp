#include "sovo/eval/evaluation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "io/io_test_support.h"
#include "sovo/eval/svg_chart.h"

namespace sovo {
namespace {

constexpr std::int64_t kStart = 1'403'636'584'763'555'584;

Trajectory curve(int count, double speed, std::int64_t period) {
  Trajectory trajectory;
  for (int i = 0; i < count; ++i) {
    const double a = 0.02 * i;
    const Vec3 t(speed * 50 * std::sin(a), 0.1 * std::sin(5 * a), speed * 50 * (1 - std::cos(a)));
    trajectory.push_back({kStart + i * period, SE3(SO3::exp(Vec3(0, a, 0)), t)});
  }
  return trajectory;
}

constexpr std::int64_t kPeriod = 50'000'000;

TEST(Evaluation, PerfectEstimateInItsOwnWorld) {
  EvaluationInput input;
  input.truth = curve(200, 0.5, kPeriod);
  const SE3 world(SO3::exp(Vec3(0.2, 0.1, -0.4)), Vec3(1, 2, 3));
  for (const StampedPose& p : input.truth) {
    input.estimate.push_back({p.stamp_ns, world * p.T_world_body});
  }
  const auto report = evaluate(input, {});
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->compared, 200U);
  EXPECT_EQ(report->completion, 1.0);
  EXPECT_NEAR(report->rigid.translation.rmse, 0.0, 1e-12);
  EXPECT_NEAR(report->rotation.rmse, 0.0, 1e-12);
  EXPECT_NEAR(report->overall.translation_mean, 0.0, 1e-12);
  EXPECT_NEAR(report->scale.median_abs, 0.0, 1e-12);
  EXPECT_EQ(report->scale_length, 10.0);
}

TEST(Evaluation, CompletionCountsMissingFrames) {
  EvaluationInput input;
  input.truth = curve(200, 0.5, kPeriod);
  input.estimate.assign(input.truth.begin() + 50, input.truth.end());
  EXPECT_NEAR(evaluate(input, {})->completion, 0.75, 1e-12);
  EvaluationOptions options;
  options.frames = 300;
  EXPECT_NEAR(evaluate(input, options)->completion, 0.5, 1e-12);
  input.truth = curve(2000, 0.05, kPeriod / 10);
  const auto report = evaluate(input, {});
  EXPECT_EQ(report->expected, 201U);
  EXPECT_NEAR(report->completion, 150.0 / 201.0, 1e-12);
}

TEST(Evaluation, ScaleStartsAtKeyframes) {
  EvaluationInput input;
  input.truth = curve(200, 0.5, kPeriod);
  for (const StampedPose& p : input.truth) {
    const SE3& T = p.T_world_body;
    input.estimate.push_back({p.stamp_ns, SE3(T.rotation(), T.translation() / 1.02)});
  }
  for (int i = 0; i < 200; i += 5) {
    input.keyframes.push_back({kStart + i * kPeriod, 0.001, 0.004, "accepted"});
  }
  const auto report = evaluate(input, {});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->at_keyframes);
  EXPECT_LE(report->scale.count, 40);
  EXPECT_GT(report->scale.count, 10);
  EXPECT_NEAR(report->scale.median_abs, std::log(1.02), 1e-9);
  EXPECT_EQ(report->verdicts.at("accepted"), 40);
  EXPECT_NEAR(report->median_sigma, 0.004, 1e-12);
}

TEST(Evaluation, ClocksThatDoNotMeetAreAnError) {
  EvaluationInput input;
  input.truth = curve(200, 0.5, kPeriod);
  input.estimate = input.truth;
  for (StampedPose& p : input.estimate) p.stamp_ns -= kStart;
  const auto report = evaluate(input, {});
  ASSERT_FALSE(report.ok());
  EXPECT_NE(report.error().find("0 of 200"), std::string::npos) << report.error();
}

TEST(Evaluation, DefaultLengthsFitThePath) {
  EXPECT_EQ(default_lengths(2000.0).back(), 800.0);
  EXPECT_EQ(default_lengths(300.0), (std::vector<double>{100.0, 200.0}));
  EXPECT_EQ(default_lengths(150.0).front(), 10.0);
  EXPECT_EQ(default_lengths(45.0).back(), 40.0);
  EXPECT_EQ(default_lengths(3.5), (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_TRUE(default_lengths(0.5).empty());
}

TEST(Evaluation, ReportsCarryTheNumbers) {
  EvaluationInput input;
  input.truth = curve(200, 0.5, kPeriod);
  input.estimate = input.truth;
  input.estimate[100].T_world_body.translation().y() += 1.0;
  const auto report = evaluate(input, {});
  ASSERT_TRUE(report.ok());
  const auto json = nlohmann::json::parse(format_json(*report));
  EXPECT_EQ(json["poses"]["compared"], 200);
  EXPECT_DOUBLE_EQ(json["ate_se3_m"]["rmse"].get<double>(), report->rigid.translation.rmse);
  const std::string table = format_table(*report);
  EXPECT_NE(table.find("SE(3) [m]"), std::string::npos);
  EXPECT_NE(table.find("yaw* [m]"), std::string::npos);
  EXPECT_NE(table.find("  * for estimates whose z axis is vertical"), std::string::npos);
  const std::string svg = format_svg(*report, "a < b & c");
  EXPECT_NE(svg.find("a &lt; b &amp; c"), std::string::npos);
  EXPECT_NE(svg.find("Trajectory"), std::string::npos);
  EXPECT_EQ(svg.find("nan"), std::string::npos);
  EXPECT_EQ(svg.find("inf"), std::string::npos);
}

TEST(Evaluation, StandingStillIsReportedWithoutPieces) {
  EvaluationInput input;
  for (int i = 0; i < 20; ++i) input.truth.push_back({kStart + i * kPeriod, SE3()});
  input.estimate = input.truth;
  const auto report = evaluate(input, {});
  ASSERT_TRUE(report.ok());
  EXPECT_TRUE(report->segments.empty());
  EXPECT_EQ(format_svg(*report, "still").find("nan"), std::string::npos);
  EXPECT_FALSE(format_table(*report).empty());
}

TEST(AxisTicks, AreRoundAndInside) {
  EXPECT_EQ(axis_ticks(0.0, 1.0, 5).size(), 6U);
  for (const double v : axis_ticks(-3.3, 12.4, 6)) {
    EXPECT_GE(v, -3.3);
    EXPECT_LE(v, 12.4);
    EXPECT_NEAR(std::remainder(v, 5.0), 0.0, 1e-9);
  }
  EXPECT_TRUE(axis_ticks(1.0, 1.0, 5).empty());
}

TEST(KeyframeFile, ReadsColumnsByName) {
  const TemporaryFolder folder;
  const auto good = read_keyframes(
      folder.write("a.csv",
                   "stamp,correction,sigma,verdict\n1403636584.763555584,0.01,0.002,accepted\n"
                   "1403636584813555456,-0.5,nan,rejected\n"));
  ASSERT_TRUE(good.ok()) << good.error();
  ASSERT_EQ(good->size(), 2U);
  EXPECT_EQ(good->at(0).stamp_ns, kStart);
  EXPECT_EQ(good->at(0).correction, 0.01);
  EXPECT_EQ(good->at(1).stamp_ns, 1'403'636'584'813'555'456);
  EXPECT_TRUE(std::isnan(good->at(1).sigma));
  EXPECT_EQ(good->at(1).verdict, "rejected");
  const auto header = read_keyframes(folder.write("b.csv", "1.0,0,0,good\n"));
  ASSERT_FALSE(header.ok());
  const auto number =
      read_keyframes(folder.write("c.csv", "stamp,correction,sigma,verdict\n1.0,x,0,good\n"));
  ASSERT_FALSE(number.ok());
  EXPECT_NE(number.error().find("c.csv:2"), std::string::npos) << number.error();
}

TEST(EvaluationInputFiles, KittiPosesTakeTheirTimesFromTheSequence) {
  const TemporaryFolder folder;
  const std::string poses =
      folder.write("poses/07.txt", "1 0 0 0 0 1 0 0 0 0 1 0\n1 0 0 0 0 1 0 0 0 0 1 1.5\n");
  const std::string estimate = folder.write("est.txt", "0 0 0 0 0 0 0 1\n0.104 0 0 1 0 0 0 1\n");
  EvaluationFiles files;
  files.truth = poses;
  files.estimate = estimate;
  const auto without = read_evaluation_input(files);
  ASSERT_FALSE(without.ok());
  EXPECT_NE(without.error().find("--times"), std::string::npos) << without.error();
  folder.write("sequences/07/times.txt", "0.0\n0.104\n");
  const auto with = read_evaluation_input(files);
  ASSERT_TRUE(with.ok()) << with.error();
  EXPECT_EQ(with->truth[1].stamp_ns, 104'000'000);
}

TEST(EvaluationInputFiles, TruthOfTheBodyIsBroughtToTheCamera) {
  const TemporaryFolder folder;
  EvaluationFiles files;
  files.truth = folder.write("gt.csv", "#stamp,x,y,z,w,x,y,z\n1403636584763555584,1,2,3,1,0,0,0\n");
  files.estimate = folder.write("est.txt", "1403636584.763555584 0 0 0 0 0 0 1\n");
  files.truth_calibration =
      folder.write("sensor.yaml",
                   "sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n"
                   "  data: [0, -1, 0, 0.5, 1, 0, 0, 0.25, 0, 0, 1, 0, 0, 0, 0, 1]\n");
  const auto input = read_evaluation_input(files);
  ASSERT_TRUE(input.ok()) << input.error();
  const SE3& pose = input->truth[0].T_world_body;
  EXPECT_NEAR((pose.translation() - Vec3(1.5, 2.25, 3)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((pose.rotation() * Vec3::UnitX() - Vec3::UnitY()).norm(), 0.0, 1e-12);
  files.truth_calibration = folder / "nowhere.yaml";
  EXPECT_FALSE(read_evaluation_input(files).ok());
}

}  // namespace
}  // namespace sovo
