#include <spdlog/fmt/fmt.h>
#include <unistd.h>

#include <chrono>
#include <iostream>
#include <memory>
#include <optional>
#include <string>

#include "sovo/app/commands.h"
#include "sovo/app/config_options.h"
#include "sovo/app/failure.h"
#include "sovo/app/message_json.h"
#include "sovo/app/status_view.h"
#include "sovo/app/stop_signal.h"
#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"

namespace sovo::app {
namespace {

using bridge::msg::RecorderStatus;
using bridge::msg::ScaledOdometry;
using ReplayClock = bridge::msg::Clock;
using bridge::msg::StereoCalibration;
using bridge::msg::VoStatus;
using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kStatusPatience(5);

struct StatusOptions {
  bool once = false;
  bool json = false;
  bool line = false;
  std::string truth;
};

void show(const VoStatus& status, const StatusSurroundings& surroundings,
          const StatusOptions& options) {
  if (options.json) {
    std::cout << to_json(status).dump() << std::endl;
    return;
  }
  const bool redraw = !options.once && isatty(STDOUT_FILENO) == 1;
  std::cout << (redraw ? "\x1b[H\x1b[J" : "")
            << status_screen(status, surroundings.text(status, Clock::now(), dds_time()))
            << std::endl;
}

std::string silence_on(const std::string& topic) {
  return fmt::format(
      "nothing on {} for {} s; is sovo vo running, in the same domain and namespace?", topic,
      kStatusPatience.count());
}

/// The topics that stand beside the odometry's state.
class SurroundingsFeed {
 public:
  static Result<SurroundingsFeed> open(const bridge::Participant& participant) {
    namespace topics = bridge::topics;
    auto odometry = bridge::Reader<ScaledOdometry>::open(participant, topics::kScaledOdometry,
                                                         topics::kScaledOdometryQos);
    if (!odometry) return odometry.failure();
    auto recorder = bridge::Reader<RecorderStatus>::open(participant, topics::kRecordStatus,
                                                         topics::kRecordStatusQos);
    if (!recorder) return recorder.failure();
    auto clock = bridge::Reader<ReplayClock>::open(participant, topics::kClock, topics::kClockQos);
    if (!clock) return clock.failure();
    return SurroundingsFeed(std::move(*odometry), std::move(*recorder), std::move(*clock));
  }

  void update(StatusSurroundings* to) {
    const auto now = Clock::now();
    (void)odometry_.take_each([&](const ScaledOdometry& m, const auto&) { to->add(m); });
    (void)recorder_.take_each([&](const RecorderStatus& m, const auto&) { to->add(m, now); });
    (void)clock_.take_each([&](const ReplayClock& m, const auto&) { to->add(m, now); });
  }

 private:
  SurroundingsFeed(bridge::Reader<ScaledOdometry> odometry, bridge::Reader<RecorderStatus> recorder,
                   bridge::Reader<ReplayClock> clock)
      : odometry_(std::move(odometry)), recorder_(std::move(recorder)), clock_(std::move(clock)) {}

  bridge::Reader<ScaledOdometry> odometry_;
  bridge::Reader<RecorderStatus> recorder_;
  bridge::Reader<ReplayClock> clock_;
};

/// Every status, or five a second for people.
int watch(const AppConfig& config, const StatusOptions& options) {
  StopSignal stop;
  auto participant = bridge::Participant::open(config.dds, "status");
  if (!participant) return fail(kFailed, participant.error());
  auto reader = bridge::Reader<VoStatus>::open(*participant, bridge::topics::kStatus,
                                               bridge::topics::kStatusQos);
  if (!reader) return fail(kFailed, reader.error());
  auto feed = SurroundingsFeed::open(*participant);
  if (!feed) return fail(kFailed, feed.error());
  StatusSurroundings surroundings;

  auto last = Clock::now();
  auto last_shown = last - kStatusPatience;
  while (!stop.requested()) {
    reader->wait(std::chrono::milliseconds(200));
    bool done = false;
    feed->update(&surroundings);
    const auto taken = reader->take_each([&](const VoStatus& status, const auto&) {
      last = Clock::now();
      surroundings.add(status, last);
      const bool due = options.json || last - last_shown > std::chrono::milliseconds(200);
      if (done || !due) return;
      show(status, surroundings, options);
      last_shown = last;
      done = options.once;
    });
    if (!taken) return fail(kFailed, taken.error());
    if (done) return kOk;
    if (Clock::now() - last < kStatusPatience) continue;
    if (options.once) return fail(kFailed, silence_on(reader->topic()));
    spdlog::warn("{}", silence_on(reader->topic()));
    last = Clock::now();
  }
  return kOk;
}

/// The topics that a status line is made of.
class LineFeed {
 public:
  static Result<LineFeed> open(const bridge::Participant& participant) {
    auto status = bridge::Reader<VoStatus>::open(participant, bridge::topics::kStatus,
                                                 bridge::topics::kStatusQos);
    if (!status) return status.failure();
    auto odometry = bridge::Reader<ScaledOdometry>::open(
        participant, bridge::topics::kScaledOdometry, bridge::topics::kScaledOdometryQos);
    if (!odometry) return odometry.failure();
    auto calibration = bridge::Reader<StereoCalibration>::open(
        participant, bridge::topics::kCalibration, bridge::topics::kCalibrationQos);
    if (!calibration) return calibration.failure();
    return LineFeed(std::move(*status), std::move(*odometry), std::move(*calibration));
  }

  /// Gives the line what has come within 200 ms.
  Result<void> update(StatusLine* line) {
    status_.wait(std::chrono::milliseconds(200));
    const auto calibrations =
        calibration_.take_each([line](const StereoCalibration& m, const auto&) { line->add(m); });
    if (!calibrations) return calibrations.failure();
    const auto poses =
        odometry_.take_each([line](const ScaledOdometry& m, const auto&) { line->add(m); });
    if (!poses) return poses.failure();
    const auto states =
        status_.take_each([line](const VoStatus& m, const auto&) { line->add(m, Clock::now()); });
    if (!states) return states.failure();
    if (*states > 0) last_ = Clock::now();
    return {};
  }

  Clock::duration silence() const { return Clock::now() - last_; }
  const std::string& topic() const { return status_.topic(); }

 private:
  LineFeed(bridge::Reader<VoStatus> status, bridge::Reader<ScaledOdometry> odometry,
           bridge::Reader<StereoCalibration> calibration)
      : status_(std::move(status)),
        odometry_(std::move(odometry)),
        calibration_(std::move(calibration)) {}

  bridge::Reader<VoStatus> status_;
  bridge::Reader<ScaledOdometry> odometry_;
  bridge::Reader<StereoCalibration> calibration_;
  Clock::time_point last_ = Clock::now();
};

/// A line a second while frames come.
int watch_line(const AppConfig& config, const StatusOptions& options) {
  Trajectory truth;
  if (!options.truth.empty()) {
    auto read = read_trajectory(options.truth, "");
    if (!read) return fail(kBadInput, read.error());
    truth = std::move(*read);
  }
  StopSignal stop;
  auto participant = bridge::Participant::open(config.dds, "status");
  if (!participant) return fail(kFailed, participant.error());
  auto feed = LineFeed::open(*participant);
  if (!feed) return fail(kFailed, feed.error());
  StatusLine line(std::move(truth));
  auto last_shown = Clock::now();
  while (!stop.requested()) {
    if (auto done = feed->update(&line); !done) return fail(kFailed, done.error());
    if (options.once && feed->silence() > kStatusPatience) {
      return fail(kFailed, silence_on(feed->topic()));
    }
    const auto text = line.text();
    const bool fresh = feed->silence() < std::chrono::seconds(1);
    if (!text || !fresh || Clock::now() - last_shown < std::chrono::seconds(1)) continue;
    std::cout << *text << std::endl;
    if (options.once) return kOk;
    last_shown = Clock::now();
  }
  return kOk;
}

}  // namespace

void add_status_command(const Command& program) {
  const Command command = program.add_command("status", "Show the state of the odometry process");
  auto status = std::make_shared<StatusOptions>();
  command.flag("--once", "Show the next state and end", &status->once);
  command.flag("--json", "One line of JSON a state", &status->json);
  command.flag("--line", "One line of text a second, with the scale and its sigma", &status->line);
  command
      .option("--truth", "With --line: drift against this trajectory of the left camera",
              &status->truth)
      .type("FILE");
  auto options = std::make_shared<ConfigOptions>(command);
  add_dds_options(*options);
  command.action([options, status] {
    const auto config = options->load();
    if (!config) return fail(kUsage, config.error());
    if (!status->truth.empty() && !status->line) return fail(kUsage, "--truth goes with --line");
    return status->line ? watch_line(*config, *status) : watch(*config, *status);
  });
}

}  // namespace sovo::app
