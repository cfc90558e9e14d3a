#include "sovo/io/trajectory_file.h"

#include <gtest/gtest.h>

#include <limits>
#include <locale>
#include <random>

#include "io/io_test_support.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

TEST(Text, SecondsBecomeNanosecondsWithoutLoss) {
  EXPECT_EQ(parse_seconds_as_ns("1403636584.763555584"), 1403636584763555584);
  EXPECT_EQ(parse_seconds_as_ns("1.036170e-01"), 103617000);
  EXPECT_EQ(parse_seconds_as_ns("-0.5"), -500000000);
  EXPECT_EQ(parse_seconds_as_ns("12"), 12000000000);
  EXPECT_EQ(parse_seconds_as_ns("0.0000000005"), 1);
  EXPECT_EQ(parse_seconds_as_ns("0.0000000004"), 0);
  EXPECT_EQ(parse_seconds_as_ns("1e-30"), 0);
  EXPECT_EQ(parse_seconds_as_ns(".5"), 500000000);
  for (const char* bad : {"", ".", "1.2.3", "1e", "e5", "nan", "inf", "1,5", "1e99", "0x10",
                          "99999999999.0", "1e999999999999"}) {
    EXPECT_FALSE(parse_seconds_as_ns(bad)) << bad;
  }
}

TEST(Text, NanosecondsAreWrittenAsTheyAre) {
  EXPECT_EQ(format_ns_as_seconds(1403636584763555584), "1403636584.763555584");
  EXPECT_EQ(format_ns_as_seconds(-1), "-0.000000001");
  EXPECT_EQ(format_ns_as_seconds(0), "0.000000000");
  EXPECT_EQ(format_ns_as_seconds(std::numeric_limits<std::int64_t>::min()),
            "-9223372036.854775808");
}

TEST(Text, NumbersAreReadStrictly) {
  EXPECT_EQ(parse_double("+1.5e2"), 150.0);
  EXPECT_EQ(parse_double("1e-400"), 0.0);
  for (const char* bad :
       {"", "+", "+-1", "++1", "1 ", " 1", "nan", "inf", "-inf", "1e400", "1,5", "1.5x"}) {
    EXPECT_FALSE(parse_double(bad)) << bad;
  }
  EXPECT_EQ(parse_integer("+12"), 12);
  EXPECT_FALSE(parse_integer("1.0"));
  EXPECT_EQ(nearest_word("huver", {"points", "huber"}), "huber");
  EXPECT_EQ(nearest_word("zzz", {"points", "huber"}), "");
}

Trajectory some_trajectory() {
  Trajectory trajectory;
  for (int i = 0; i < 20; ++i) {
    Vec6 x;
    x << 0.1 * i, -0.2, 3.0 + i, 0.05 * i, 0.3, -0.15 * i;
    trajectory.push_back({1403636584763555584 + i * 50000001, SE3::exp(x)});
  }
  return trajectory;
}

TEST(TrajectoryFile, TumRoundTrip) {
  const TemporaryFolder folder;
  const Trajectory written = some_trajectory();
  ASSERT_TRUE(write_tum(folder / "a.txt", written, "left camera"));
  const auto read = read_trajectory(folder / "a.txt");
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp_ns, written[i].stamp_ns);
    EXPECT_LT(((*read)[i].T_world_body.inverse() * written[i].T_world_body).log().norm(), 1e-8);
  }
  EXPECT_EQ(format_tum(*read, "left camera"), *read_text_file(folder / "a.txt"));
}

TEST(TrajectoryFile, KittiRoundTripAndTimes) {
  const TemporaryFolder folder;
  const Trajectory written = some_trajectory();
  ASSERT_TRUE(write_kitti_poses(folder / "00.txt", written));
  std::string times;
  for (const StampedPose& pose : written) times += format_ns_as_seconds(pose.stamp_ns) + "\n";
  folder.write("times.txt", times);
  const auto read = read_trajectory(folder / "00.txt", folder / "times.txt");
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->size(), written.size());
  for (std::size_t i = 0; i < written.size(); ++i) {
    EXPECT_EQ((*read)[i].stamp_ns, written[i].stamp_ns);
    EXPECT_LT(((*read)[i].T_world_body.inverse() * written[i].T_world_body).log().norm(), 1e-12);
  }
  folder.write("few.txt", "0.0\n0.1\n");
  EXPECT_TRUE(
      contains(read_trajectory(folder / "00.txt", folder / "few.txt").error(), "has 2 times"));
  EXPECT_EQ((*read_kitti_poses(folder / "00.txt"))[3].stamp_ns, 300000000);
}

TEST(TrajectoryFile, EurocOrderIsWFirst) {
  const TemporaryFolder folder;
  const auto path = folder.write(
      "data.csv",
      "#timestamp [ns], p x, y, z, q w x y z, v\r\n"
      "1403636584713600000,1.5,-2,3,0.5,0.5,-0.5,0.5,9,9,9\r\n1403636584718599936, 1, 2, 3, 1, 0, "
      "0, 0\r\n");
  const auto read = read_trajectory(path);
  ASSERT_TRUE(read) << read.error();
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ((*read)[0].stamp_ns, 1403636584713600000);
  const auto& q = (*read)[0].T_world_body.rotation().quaternion();
  EXPECT_NEAR(q.w(), 0.5, 1e-12);
  EXPECT_NEAR(q.y(), -0.5, 1e-12);
  EXPECT_EQ((*read)[0].T_world_body.translation(), Vec3(1.5, -2.0, 3.0));
}

std::string tum_error(const std::string& text) {
  const TemporaryFolder folder;
  const auto read = read_tum(folder.write("t.txt", text));
  return read ? "" : read.error();
}

TEST(TrajectoryFile, ErrorsNameLineAndField) {
  EXPECT_TRUE(contains(tum_error("# c\n1 0 0 0 0 0 0 1\n2 0 x 0 0 0 0 1\n"), "t.txt:3: ty must"));
  EXPECT_TRUE(contains(tum_error("1 0 0 nan 0 0 0 1\n"), "t.txt:1: tz must be a finite number"));
  EXPECT_TRUE(contains(tum_error("1 0 0 0 0 0 1\n"), "has 7 fields"));
  EXPECT_TRUE(contains(tum_error("1s 0 0 0 0 0 0 1\n"), "t must be seconds"));
  EXPECT_TRUE(contains(tum_error("1 0 0 0 0 0 0 0\n"), "quaternion has length 0"));
  EXPECT_TRUE(contains(tum_error("1 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"), "t.txt:2: the stamp"));
  EXPECT_TRUE(contains(tum_error("# nothing\n"), "has no poses"));
  EXPECT_TRUE(contains(read_tum("/no/such.txt").error(), "/no/such.txt"));
  EXPECT_TRUE(contains(read_tum("/").error(), "folder"));
  const TemporaryFolder folder;
  EXPECT_TRUE(contains(read_kitti_matrices(folder.write("k", "1 0 0 0 0 1 0 0 0 0 2 0\n")).error(),
                       "k:1: the left 3x3 block"));
}

/// Writes numbers as 1.234,5.
class CommaPunctuation : public std::numpunct<char> {
 protected:
  char do_decimal_point() const override { return ','; }
  char do_thousands_sep() const override { return '.'; }
  std::string do_grouping() const override { return "\3"; }
};

TEST(TrajectoryFile, NumbersDoNotDependOnTheLocale) {
  const TemporaryFolder folder;
  const auto path = folder.write("t.txt", "1403636584.5 1234.25 0 0 0 0 0 1\n");
  const std::locale before =
      std::locale::global(std::locale(std::locale::classic(), new CommaPunctuation));
  const auto read = read_tum(path);
  const std::string text = read ? format_tum(*read) : read.error();
  std::locale::global(before);
  EXPECT_TRUE(contains(text, "1403636584.500000000 1234.250000000 ")) << text;
}

TEST(TrajectoryFile, SurvivesTruncatedAndRandomText) {
  const TemporaryFolder folder;
  const std::string text = format_tum(some_trajectory());
  std::mt19937 random(2);
  for (int i = 0; i < 500; ++i) {
    std::string noisy = text.substr(0, random() % text.size());
    for (int k = 0; k < 3 && !noisy.empty(); ++k) {
      noisy[random() % noisy.size()] = static_cast<char>(random() % 256);
    }
    const auto read = read_trajectory(folder.write("n.txt", noisy));
    if (read) {
      EXPECT_FALSE(read->empty());
    } else {
      EXPECT_FALSE(read.error().empty());
    }
  }
}

TEST(TrajectoryFile, ReadsRealFiles) {
  const std::string tum = shared_data("euroc/MH_01_head/groundtruth_cam0_tum.txt");
  const std::string csv = shared_data("euroc/MH_01_head/mav0/state_groundtruth_estimate0/data.csv");
  const std::string kitti = shared_data("kitti/poses/06.txt");
  const std::string times = shared_data("kitti/sequences/06/times.txt");
  if (tum.empty() || csv.empty() || kitti.empty() || times.empty()) {
    GTEST_SKIP() << "no real clips at ../shared/data or $SOVO_SHARED/data";
  }
  const auto a = read_trajectory(tum);
  ASSERT_TRUE(a) << a.error();
  EXPECT_EQ(a->size(), 150U);
  EXPECT_EQ(a->front().stamp_ns, 1403636584763555584);
  const auto b = read_trajectory(csv);
  ASSERT_TRUE(b) << b.error();
  const auto c = read_trajectory(kitti, times);
  ASSERT_TRUE(c) << c.error();
  EXPECT_EQ(c->size(), 51U);
}

}  // namespace
}  // namespace sovo
