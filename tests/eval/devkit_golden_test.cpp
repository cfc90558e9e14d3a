#include <gtest/gtest.h>

#include <array>
#include <sstream>

#include "io/io_test_support.h"
#include "sovo/eval/evaluation.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

/// Rows of the devkit's output: length [m], then the value of each of the two systems.
std::vector<std::array<double, 3>> expected_rows(const std::string& path) {
  std::istringstream in(read_text_file(path).value());
  std::vector<std::array<double, 3>> rows;
  for (std::array<double, 3> row; in >> row[0] >> row[1] >> row[2];) rows.push_back(row);
  return rows;
}

/// The report of `sovo eval` on two KITTI files.
EvaluationReport report_of(const std::string& truth, const std::string& estimate) {
  EvaluationFiles files;
  files.truth = truth;
  files.estimate = estimate;
  const auto input = read_evaluation_input(files);
  EXPECT_TRUE(input.ok()) << input.error();
  EvaluationOptions options;
  options.lengths = kitti_lengths();
  auto report = evaluate(*input, options);
  EXPECT_TRUE(report.ok()) << report.error();
  return std::move(*report);
}

class DevkitGolden : public testing::TestWithParam<const char*> {};

TEST_P(DevkitGolden, SixDigitsOfTheDevkitsOwnOutput) {
  const std::string reference = shared_data("reference");
  if (reference.empty()) GTEST_SKIP() << "no data/reference in the shared folder";
  const std::string sequence = GetParam();
  const std::string truth = reference + "/kitti_poses/" + sequence + ".txt";
  const auto translation = expected_rows(reference + "/expected/" + sequence + "_tl.txt");
  const auto rotation = expected_rows(reference + "/expected/" + sequence + "_rl.txt");
  ASSERT_FALSE(translation.empty());
  ASSERT_EQ(translation.size(), rotation.size());
  const std::array<std::string, 2> systems{"stereo_dso_jingetu", "orb_slam2_no_loop"};
  for (std::size_t k = 0; k < systems.size(); ++k) {
    const std::string published = reference + "/published/" + systems[k] + "/" + sequence + ".txt";
    const EvaluationReport report = report_of(truth, published);
    const auto& rows = report.by_length;
    ASSERT_GE(rows.size(), translation.size());
    for (std::size_t i = 0; i < translation.size(); ++i) {
      EXPECT_EQ(rows[i].length, translation[i][0]);
      EXPECT_NEAR(rows[i].translation_mean, translation[i][k + 1], 0.51e-6) << systems[k];
      EXPECT_NEAR(rows[i].rotation_mean, rotation[i][k + 1], 0.51e-6) << systems[k];
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Published, DevkitGolden, testing::Values("00", "05", "06", "07"));

TEST(EurocTruth, InTheBodyMeetsTheCamerasOwn) {
  const std::string clip = shared_data("euroc/MH_01_head");
  if (clip.empty()) GTEST_SKIP() << "no data/euroc/MH_01_head in the shared folder";
  EvaluationFiles files;
  files.truth = clip + "/mav0/state_groundtruth_estimate0/data.csv";
  files.estimate = clip + "/groundtruth_cam0_tum.txt";
  files.truth_calibration = clip + "/mav0/cam0/sensor.yaml";
  const auto input = read_evaluation_input(files);
  ASSERT_TRUE(input.ok()) << input.error();
  const auto report = evaluate(*input, {});
  ASSERT_TRUE(report.ok()) << report.error();
  EXPECT_EQ(report->compared, 150U);
  EXPECT_LT(report->rigid.translation.max, 1e-5);
  EXPECT_LT(report->rotation.max, 1e-4);
}

}  // namespace
}  // namespace sovo
