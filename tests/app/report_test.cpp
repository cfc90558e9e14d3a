#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <optional>
#include <random>
#include <regex>
#include <set>

#include "io/io_test_support.h"
#include "sovo/app/report/dive_evaluation.h"
#include "sovo/app/report/dive_map.h"
#include "sovo/app/report/dive_runs.h"
#include "sovo/app/report/dive_summary.h"
#include "sovo/app/report/health_timeline.h"
#include "sovo/app/report/html.h"
#include "sovo/app/report/report_page.h"
#include "sovo/bridge/borrow.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/message_schema.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/io/recording_writer.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

namespace msg = bridge::msg;

constexpr std::uint64_t kBegin = 1'700'000'000'000'000'000;
constexpr std::uint64_t kPeriod = 50'000'000;
constexpr char kHostile[] = "</title><script>alert(1)</script><img src=x onerror='a' \"b\">&amp;";

DiveStatus status_at(double seconds, std::uint8_t state) {
  DiveStatus s;
  s.log_ns = kBegin + static_cast<std::uint64_t>(1e9 * seconds);
  s.state = state;
  s.sequence = static_cast<std::uint64_t>(std::llround(20.0 * seconds));
  s.session = 5;
  return s;
}

/// Half a circle of radius 2 m in 5 s.
Dive half_circle() {
  Dive dive;
  dive.path = "somewhere/dive.mcap";
  dive.vehicle = "/sovo";
  dive.start_ns = kBegin;
  dive.reasons = {""};
  for (int i = 0; i <= 100; ++i) {
    const double a = 3.14159265358979 * i / 100.0;
    DivePose pose;
    pose.log_ns = kBegin + static_cast<std::uint64_t>(i) * kPeriod;
    pose.stamp_ns = static_cast<std::int64_t>(pose.log_ns);
    pose.T_odom_base =
        SE3(SO3::exp(Vec3(0, 0, a)), Vec3(2.0 * std::sin(a), 2.0 - 2.0 * std::cos(a), 0.1 * a));
    pose.state = 1;
    pose.metric = true;
    pose.log_scale_sigma = 0.01;
    dive.poses.push_back(pose);
    dive.statuses.push_back(status_at(0.05 * i, 1));
  }
  dive.end_ns = dive.poses.back().log_ns;
  return dive;
}

TEST(ReportHtml, TextStaysText) {
  EXPECT_EQ(escape_html("<b a=\"1\">&'"), "&lt;b a=&quot;1&quot;&gt;&amp;&#39;");
  EXPECT_EQ(escape_html("m\xC3\xBC\xE2\x82\xAC"), "m\xC3\xBC\xE2\x82\xAC");
  const std::string lost = "\xEF\xBF\xBD";
  EXPECT_EQ(escape_html("a\x01z"), "a" + lost + "z");
  EXPECT_EQ(escape_html("a\x80z"), "a" + lost + "z");          // no beginning
  EXPECT_EQ(escape_html("\xC0\xBC"), lost + lost);             // '<' in too many bytes
  EXPECT_EQ(escape_html("\xED\xA0\x80"), lost + lost + lost);  // half a surrogate pair
  EXPECT_EQ(escape_html("a\xE2\x82"), "a" + lost + lost);      // cut
  const std::string turns_the_writing_round = std::string("\xE2\x80") + "\xAE";
  EXPECT_EQ(escape_html(turns_the_writing_round + "z"), lost + lost + lost + "z");
}

TEST(HealthTimeline, ListsStatesReasonsAndSilence) {
  Dive dive;
  dive.start_ns = kBegin;
  dive.reasons = {"", "no near texture for 1 s", "no near texture for 2 s", "blurred"};
  const auto add = [&](double from, double to, std::uint8_t state, std::uint32_t reason) {
    for (double t = from; t < to - 1e-9; t += 0.05) {
      dive.statuses.push_back(status_at(t, state));
      dive.statuses.back().reason = reason;
    }
  };
  add(1.0, 2.0, 1, 0);
  add(2.0, 2.5, 2, 1);
  add(2.5, 3.0, 2, 2);
  add(3.0, 3.2, 2, 3);
  add(3.2, 4.0, 1, 0);
  add(9.0, 9.5, 4, 3);
  const auto periods = health_timeline(dive);
  ASSERT_EQ(periods.size(), 5U);
  EXPECT_EQ(periods[1].state, 2);
  EXPECT_NEAR(periods[1].begin_s, 2.0, 1e-6);
  EXPECT_NEAR(periods[1].duration_s(), 1.2, 1e-6);
  EXPECT_EQ(periods[1].frames, 24U);
  EXPECT_EQ(periods[1].reason, "no near texture for 2 s; blurred");
  EXPECT_EQ(periods[3].state, kSilent);
  EXPECT_NEAR(periods[3].begin_s, 3.95, 1e-6);
  EXPECT_NEAR(periods[3].end_s, 9.0, 1e-6);
  EXPECT_EQ(periods[4].state, 4);
  EXPECT_NEAR(time_in(periods, 1), 1.0 + 0.75, 1e-6);
}

TEST(DiveSummary, CountsOverARestart) {
  Dive dive = half_circle();
  for (std::size_t i = 0; i < dive.statuses.size(); ++i) {
    DiveStatus& s = dive.statuses[i];
    s.lost_transport = i < 50 ? 7 + i / 10 : (i - 50) / 25;  // 4 more, then anew: 2
    s.dropped_queue = 3;                                     // all before the recording
    if (i >= 60) s.sequence += 4;                            // four frames are missing
    if (i >= 80) s.session = 6;
    s.latency_s = 0.001 * static_cast<double>(i);
  }
  DivePose& anew = dive.poses.back();  // another odometry, elsewhere
  anew.run = 1;
  anew.T_odom_base = SE3();
  const DiveSummary sum = summarize(dive);
  EXPECT_EQ(sum.segments, 2U);
  EXPECT_EQ(sum.lost_transport, 6U);
  EXPECT_EQ(sum.dropped_queue, 0U);
  EXPECT_EQ(sum.frames, 101U);
  EXPECT_EQ(sum.sent, 105U);
  EXPECT_EQ(sum.metric_poses, 101U);
  EXPECT_NEAR(sum.distance_m, 0.99 * std::hypot(2.0 * 3.1416, 0.1 * 3.1416), 2e-3);
  EXPECT_NEAR(sum.latency_median_s, 0.05, 1e-9);
  EXPECT_NEAR(sum.latency_p95_s, 0.095, 1e-9);
  EXPECT_NEAR(sum.rate_hz, 20.0, 1.0);
  std::uint64_t losses = 0;
  for (const DiveRate& rate : sum.rates) losses += rate.losses;
  EXPECT_EQ(losses, 6U);
}

TEST(DiveEvaluation, LaysTheTruthOverTheDive) {
  const TemporaryFolder folder;
  Dive dive = half_circle();
  StereoCameras cameras;
  cameras.rig.T_base_left = SE3(SO3::exp(Vec3(-1.5, 0.1, -1.6)), Vec3(0.2, 0.05, -0.1));
  dive.cameras = cameras;
  const SE3 world(SO3::exp(Vec3(0.4, -1.0, 2.0)), Vec3(10, -20, 5));
  Trajectory truth;
  for (const DivePose& pose : dive.poses) {
    truth.push_back({pose.stamp_ns, world * pose.T_odom_base * cameras.rig.T_base_left});
  }
  ASSERT_TRUE(write_tum(folder / "truth.txt", truth).ok());
  EvaluationFiles files;
  files.truth = folder / "truth.txt";
  EvaluationOptions options;
  options.frames = 202;
  const auto result = evaluate_dive(dive, files, options);
  ASSERT_TRUE(result.ok()) << result.error();
  EXPECT_NEAR(result->report.rigid.translation.rmse, 0.0, 1e-6);
  EXPECT_NEAR(result->report.completion, 0.5, 1e-9);
  ASSERT_EQ(result->truth.size(), dive.poses.size());
  for (std::size_t i = 0; i < dive.poses.size(); ++i) {
    EXPECT_NEAR((result->truth[i] - dive.poses[i].T_odom_base.translation()).norm(), 0.0, 1e-6);
  }
  files.truth = folder / "nothing.txt";
  EXPECT_TRUE(contains(evaluate_dive(dive, files, options).error(), "nothing.txt"));
}

TEST(DiveMap, PutsPointsWhereTheyWereSeen) {
  Dive dive = half_circle();
  StereoCameras cameras;
  cameras.rig.left = {640, 480, 400.0, 400.0, 319.5, 239.5};
  dive.cameras = cameras;
  DiveKeyframe keyframe;
  keyframe.T_odom_left = SE3(SO3(), Vec3(1, 2, 3));
  keyframe.metric = true;
  keyframe.u = {319.5F, 419.5F, 10.0F};
  keyframe.v = {239.5F, 239.5F, 10.0F};
  keyframe.inverse_depth = {0.5F, 0.25F, 0.5F};
  keyframe.sigma = {0.01F, 0.01F, 0.4F};  // the last one is anywhere
  dive.keyframes.push_back(keyframe);
  keyframe.metric = false;
  dive.keyframes.push_back(keyframe);
  StereoOdometryConfig config;
  const auto points = map_points(dive, config, 100);
  ASSERT_EQ(points.size(), 2U);
  EXPECT_NEAR((points[0] - Vec3(1, 2, 5)).norm(), 0.0, 1e-6);
  EXPECT_NEAR((points[1] - Vec3(2, 2, 7)).norm(), 0.0, 1e-6);
  EXPECT_EQ(map_points(dive, config, 1).size(), 1U);
}

/// Names of all elements of a page, and every attribute with its quotes.
std::set<std::string> elements_of(const std::string& page) {
  const std::regex element(R"(<([!a-zA-Z][a-zA-Z0-9]*)((?:\s+[a-zA-Z-]+(?:="[^"<>]*")?)*)\s*/?>)");
  std::set<std::string> names;
  for (std::sregex_iterator i(page.begin(), page.end(), element), end; i != end; ++i) {
    names.insert((*i)[1]);
  }
  return names;
}

TEST(ReportPage, NothingOfTheRecordingBecomesMarkup) {
  Dive dive = half_circle();
  const std::set<std::string> usual = elements_of(format_report_page(dive, std::nullopt, {}));
  dive.path = std::string("x/") + kHostile;
  dive.vehicle = kHostile;
  dive.reasons.emplace_back(kHostile);
  for (std::size_t i = 20; i < 40; ++i) {
    dive.statuses[i].state = 3;
    dive.statuses[i].reason = 1;
  }
  dive.complaints.push_back({kHostile, 2, kHostile, kBegin, kBegin + kPeriod});
  dive.stages[kHostile] = {1.0, 2.0};
  dive.topics.push_back({kHostile, kHostile, 3, kHostile});
  dive.notes.emplace_back(kHostile);
  const std::string page = format_report_page(dive, std::nullopt, {{Vec3(1, 2, 3), Vec3(2, 3, 4)}});
  EXPECT_TRUE(contains(page, "alert(1)"));
  std::set<std::string> more = elements_of(page);
  for (const std::string& name : usual) more.erase(name);
  for (const char* ours : {"table", "thead", "tbody", "tr", "th", "td", "ul", "li"})
    more.erase(ours);
  EXPECT_TRUE(more.empty()) << *more.begin();
  for (const char* markup : {"<script", "<img", "http:", "https:", "url("}) {
    EXPECT_FALSE(contains(page, markup)) << markup;
  }
  EXPECT_TRUE(contains(page, "default-src 'none'; style-src 'sha256-"));
}

TEST(ReportPage, StandsWithoutPosesOrStatuses) {
  Dive dive = half_circle();
  dive.statuses.clear();
  EXPECT_TRUE(contains(format_report_page(dive, std::nullopt, {}), "No status was recorded"));
  dive = half_circle();
  dive.poses.clear();
  EXPECT_TRUE(contains(format_report_page(dive, std::nullopt, {}), "No pose with a known scale"));
  dive = half_circle();
  for (DivePose& pose : dive.poses) {  // as absurd as a damaged recording can be
    pose.T_odom_base = SE3(SO3(), Vec3(1e300, -1e300, 1e16));
    pose.speed = std::numeric_limits<double>::infinity();
    pose.log_scale = 1e6;
  }
  EXPECT_TRUE(contains(format_report_page(dive, std::nullopt, {}), "</html>"));
}

/// A recording of a few statuses, poses, keyframes and diagnostics.
class ReportFile : public ::testing::Test {
 protected:
  template <class T>
  std::size_t add_topic(const std::string& topic) {
    const bridge::MessageSchema* schema = bridge::find_schema(bridge::MessageTraits<T>::kRosName);
    return writer_->add_topic({topic, schema->ros_name, schema->definition, "", ""});
  }

  template <class T>
  void write(std::size_t topic, int i, const T& message) {
    auto bytes = bridge::encode(message);
    if (damage_) damage(&bytes);
    const std::uint64_t now = kBegin + static_cast<std::uint64_t>(i) * kPeriod;
    ASSERT_TRUE(writer_->write(topic, now, now, bytes).ok());
  }

  /// Some messages become what no odometry writes, in a file that is whole.
  void damage(Bytes* bytes) {
    std::mt19937& random = *damage_;
    if (random() % 2 == 0) return;
    for (int i = 0; i < 3; ++i)
      (*bytes)[random() % bytes->size()] = static_cast<std::uint8_t>(random());
    if (random() % 8 == 0) bytes->resize(random() % bytes->size());
  }

  std::string write_dive(const std::string& ns) {
    RecordingConfig config;
    config.min_free_bytes = 0;
    config.compression = mcap::Compression::kNone;  // what is changed in the file is in a message
    auto created = RecordingWriter::create(folder_ / "dive.mcap", config);
    EXPECT_TRUE(created.ok());
    writer_ = std::move(*created);
    const auto status = add_topic<msg::VoStatus>(ns + "/status");
    const auto odometry = add_topic<msg::ScaledOdometry>(ns + "/scaled_odometry");
    const auto keyframe = add_topic<msg::Keyframe>(ns + "/keyframe");
    for (int i = 0; i < 40; ++i) {
      const msg::StageTiming stage{bridge::borrow("tracking"), 2.0F + static_cast<float>(i), 3, 4};
      const std::vector<msg::StageTiming> stages{stage};
      msg::VoStatus s{};
      s.header.frame_id = bridge::borrow(kHostile);
      s.state = i < 30 ? 1 : 4;
      s.reason = bridge::borrow(i < 30 ? "" : kHostile);
      s.last_command_result = bridge::borrow("");
      s.sequence = static_cast<std::uint64_t>(i);
      bridge::borrow(s.stages, stages);
      write(status, i, s);
      msg::ScaledOdometry o{};
      o.header = {bridge::to_message(static_cast<std::int64_t>(kBegin) + i),
                  bridge::borrow("odom")};
      o.child_frame_id = bridge::borrow(kHostile);
      o.pose.pose = bridge::to_pose(SE3(SO3(), Vec3(0.1 * i, 0, 0)));
      o.scale_valid = true;
      write(odometry, i, o);
    }
    const std::vector<float> floats{1.0F, 2.0F};
    msg::Keyframe k{};
    k.header.frame_id = bridge::borrow("odom");
    k.pose = bridge::to_pose(SE3());
    for (auto* list : {&k.u, &k.v, &k.inverse_depth, &k.sigma}) bridge::borrow(*list, floats);
    write(keyframe, 40, k);
    EXPECT_TRUE(writer_->close().ok());
    return folder_ / "dive.mcap";
  }

  /// Twenty frames and a keyframe, revised; then again by an odometry that was started anew in the
  /// same second, twice as fast.
  std::string write_restarted() {
    RecordingConfig config;
    config.min_free_bytes = 0;
    writer_ = std::move(*RecordingWriter::create(folder_ / "restarted.mcap", config));
    const auto status = add_topic<msg::VoStatus>("/auv1/status");
    const auto odometry = add_topic<msg::ScaledOdometry>("/auv1/scaled_odometry");
    const auto keyframe = add_topic<msg::Keyframe>("/auv1/keyframe");
    const auto write_keyframe = [&](int i, int frame, double x) {
      msg::Keyframe k{};
      k.header = {bridge::to_message(static_cast<std::int64_t>(kBegin) + frame),
                  bridge::borrow("odom")};
      k.pose = bridge::to_pose(SE3(SO3(), Vec3(x, 0, 0)));
      write(keyframe, i, k);
    };
    for (int i = 0; i < 40; ++i) {
      const int since = i % 20;
      const auto stamp = bridge::to_message(static_cast<std::int64_t>(kBegin) + i);
      msg::VoStatus s{};
      s.header = {stamp, bridge::borrow("odom")};
      s.state = 1;
      s.reason = s.last_command_result = bridge::borrow("");
      s.received = static_cast<std::uint64_t>(1 + since);
      msg::ScaledOdometry o{};
      o.header = {stamp, bridge::borrow("odom")};
      o.child_frame_id = bridge::borrow("base_link");
      o.pose.pose = bridge::to_pose(SE3(SO3(), Vec3((i < 20 ? 0.1 : 0.2) * since, 0, 0)));
      o.scale_valid = true;
      if (since == 0) write_keyframe(i, i, i < 20 ? 5.0 : 9.0);  // may come before its status
      write(odometry, i, o);
      write(status, i, s);
      if (i == 10) write_keyframe(i, 0, 7.0);
    }
    EXPECT_TRUE(writer_->close().ok());
    return folder_ / "restarted.mcap";
  }

  TemporaryFolder folder_;
  std::unique_ptr<RecordingWriter> writer_;
  std::optional<std::mt19937> damage_;
};

TEST_F(ReportFile, IsReadAsItWasWritten) {
  const std::string path = write_dive("/auv1");
  const auto dive = read_dive(path, "");
  ASSERT_TRUE(dive.ok()) << dive.error();
  EXPECT_EQ(dive->vehicle, "/auv1");
  EXPECT_EQ(dive->statuses.size(), 40U);
  EXPECT_EQ(dive->poses.size(), 40U);
  EXPECT_EQ(dive->keyframes.size(), 1U);
  EXPECT_EQ(dive->stages.at("tracking").size(), 40U);
  EXPECT_NEAR(summarize(*dive).distance_m, 3.9, 1e-9);
  const std::string page = format_report_page(*dive, std::nullopt, {});
  EXPECT_FALSE(contains(page, "<script"));
  EXPECT_TRUE(contains(page, "&lt;script&gt;"));
  EXPECT_TRUE(read_dive(path, "auv1").ok());
  EXPECT_TRUE(contains(read_dive(path, "auv2").error(), "below /auv1"));
}

TEST_F(ReportFile, KeepsTheRunsOfARestartedOdometryApart) {
  const auto dive = read_dive(write_restarted(), "");
  ASSERT_TRUE(dive.ok()) << dive.error();
  EXPECT_EQ(count_runs(*dive), 2U);
  EXPECT_EQ(dive->keyframes.size(), 2U);  // one revised, and another one of the same number
  const DiveSummary sum = summarize(*dive);
  EXPECT_NEAR(sum.distance_m, 1.9 + 3.8, 1e-9);
  EXPECT_EQ(sum.segments, 2U);
  const std::vector<Dive> runs = runs_of(*dive, 5);
  ASSERT_EQ(runs.size(), 2U);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(runs[k].poses.size(), 20U);
    ASSERT_EQ(runs[k].keyframes.size(), 1U);
    const double x = k == 0 ? 7.0 : 9.0;  // the first one as it was revised
    EXPECT_NEAR(runs[k].keyframes[0].T_odom_left.translation().x(), x, 1e-9);
  }
  EXPECT_EQ(runs_of(*dive, 1).size(), 1U);
  const std::string page = format_report_page(*dive, std::nullopt, {});
  EXPECT_TRUE(contains(page, "was started 2 times"));
  EXPECT_TRUE(contains(page, "Trajectory of base_link in odom, run 2 of 2, 1.0 s to "));
}

TEST_F(ReportFile, WhatCannotBeReadIsSaid) {
  EXPECT_TRUE(contains(read_dive(folder_ / "nothing.mcap", "").error(), "does not exist"));
  EXPECT_FALSE(read_dive(folder_.write("text.mcap", "a text, and a long one at that"), "").ok());
  RecordingConfig config;
  config.min_free_bytes = 0;
  auto created = RecordingWriter::create(folder_ / "foreign.mcap", config);
  ASSERT_TRUE(created.ok());
  writer_ = std::move(*created);
  write(add_topic<msg::Odometry>("/odom"), 0, msg::Odometry{});
  ASSERT_TRUE(writer_->close().ok());
  const auto foreign = read_dive(folder_ / "foreign.mcap", "");
  ASSERT_FALSE(foreign.ok());
  EXPECT_TRUE(contains(foreign.error(), "no odometry in it")) << foreign.error();
}

TEST_F(ReportFile, DamageIsNotedAndNeverFatal) {
  const std::string path = write_dive("/sovo");
  const auto whole = read_text_file(path);
  ASSERT_TRUE(whole.ok());
  std::mt19937 random(7);
  for (int i = 0; i < 100; ++i) {
    std::string bytes = *whole;
    for (int k = 0; k < 8; ++k) bytes[random() % bytes.size()] = static_cast<char>(random());
    if (i % 5 == 0) bytes.resize(random() % bytes.size());
    const auto dive = read_dive(folder_.write("damaged.mcap", bytes), "");
    if (dive) {
      EXPECT_FALSE(dive->notes.empty());
    } else {
      EXPECT_FALSE(dive.error().empty());
    }
  }
}

TEST_F(ReportFile, AbsurdMessagesAreCountedAndNeverFatal) {
  damage_.emplace(11);
  for (int i = 0; i < 100; ++i) {
    const std::string path = write_dive("/sovo");
    const auto dive = read_dive(path, "");
    ASSERT_TRUE(dive.ok()) << dive.error();
    EXPECT_FALSE(dive->notes.empty());
    const auto map = map_points(*dive, {}, 100);
    const std::string page = format_report_page(*dive, std::nullopt, {map});
    EXPECT_FALSE(contains(page, "<script"));
    std::filesystem::remove(path);
  }
}

}  // namespace
}  // namespace sovo::app
