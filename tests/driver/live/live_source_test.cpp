#include "sovo/driver/live/live_source.h"

#include <gtest/gtest.h>

#include <atomic>
#include <deque>
#include <functional>
#include <thread>

#include "sovo/driver/live/host_clock.h"
#include "sovo/driver/live/image_pool.h"

namespace sovo {
namespace {

constexpr std::int64_t kScriptPeriod = 10'000'000;

/// What a scripted camera does next.
struct Step {
  CaptureState state = CaptureState::kImage;
  std::int64_t time_ns = 0;
  std::uint64_t skipped = 0;
};

/// Frames that the test has taken. A device that has one stays at most three images ahead, so that
/// the queue of four never drops any, however slow the test is.
using Taken = std::shared_ptr<std::atomic<int>>;

/// A camera that does what a list says, then waits.
class ScriptedDevice : public CaptureDevice {
 public:
  ScriptedDevice(std::deque<Step> steps, bool both, Taken taken)
      : steps_(std::move(steps)), both_(both), taken_(std::move(taken)) {}

  CaptureState next(std::chrono::milliseconds timeout, Capture* capture) override {
    *capture = {};
    if (steps_.empty() || (taken_ && given_ - *taken_ >= 3)) {
      std::this_thread::sleep_for(std::min(timeout, std::chrono::milliseconds(5)));
      return CaptureState::kNone;
    }
    const Step step = steps_.front();
    steps_.pop_front();
    capture->skipped = step.skipped;
    capture->problem = "scripted";
    if (step.state != CaptureState::kImage) return step.state;
    capture->device_ns = step.time_ns;
    capture->clock_device_ns = step.time_ns;
    capture->clock_utc_ns = step.time_ns + 1'000'000'000'000;
    capture->image.valid = true;
    capture->right.valid = both_;
    ++given_;
    return CaptureState::kImage;
  }
  std::string description() const override { return "scripted"; }

 private:
  std::deque<Step> steps_;
  bool both_;
  Taken taken_;
  int given_ = 0;
};

std::deque<Step> images(int first, int count) {
  std::deque<Step> steps;
  for (int n = first; n < first + count; ++n)
    steps.push_back({CaptureState::kImage, n * kScriptPeriod});
  return steps;
}

/// A scripted camera with an image whose bytes tell its time, of both sides or one.
class ColourDevice : public ScriptedDevice {
 public:
  ColourDevice(std::deque<Step> steps, bool both, Taken taken, ColourWanted wanted)
      : ScriptedDevice(std::move(steps), both, std::move(taken)), keeper_(std::move(wanted)) {}

  CaptureState next(std::chrono::milliseconds timeout, Capture* capture) override {
    const CaptureState state = ScriptedDevice::next(timeout, capture);
    if (state != CaptureState::kImage) return state;
    const std::vector<std::uint8_t> bytes(
        16, static_cast<std::uint8_t>(capture->device_ns / kScriptPeriod));
    const ColourImage colour = keeper_.keep({CameraFormat::kYuyv, 4, 2, 8, bytes});
    capture->colour = capture->right.valid ? colour.half(false) : colour;
    if (capture->right.valid) capture->right_colour = colour.half(true);
    return state;
  }

 private:
  ColourKeeper keeper_;
};

LiveCamera colour_camera(int count, bool both, const Taken& taken, const ColourWanted& wanted) {
  LiveCamera result;
  result.config.stall = std::chrono::minutes(10);
  result.config.frame_rate = 100.0;
  result.config.shared_clock = true;
  result.open = [=]() -> Result<std::unique_ptr<CaptureDevice>> {
    return std::unique_ptr<CaptureDevice>(
        std::make_unique<ColourDevice>(images(0, count), both, taken, wanted));
  };
  return result;
}

/// Takes `count` frames; whether colour came with each, all of it of the frame's own instant.
std::vector<bool> take_coloured(LiveSource* source, int count, const Taken& taken) {
  std::vector<bool> coloured;
  for (int tries = 0; static_cast<int>(coloured.size()) < count && tries < 2000; ++tries) {
    const auto next = source->next(std::chrono::milliseconds(50));
    if (next.state != SourceState::kFrame) {
      EXPECT_FALSE(source->colour().left.bytes) << "of an older frame";
      continue;
    }
    ++*taken;
    const auto number = (next.frame.stamp_ns - 1'000'000'000'000) / kScriptPeriod;
    const StereoColour& colour = source->colour();
    for (const ColourImage* side : {&colour.left, &colour.right}) {
      if (side->bytes) {
        EXPECT_EQ(side->bytes->at(0), static_cast<std::uint8_t>(number));
      }
    }
    coloured.push_back(colour.left.bytes && colour.right.bytes);
    EXPECT_EQ(colour.left.bytes != nullptr,
              colour.right.bytes != nullptr || !next.frame.right.valid)
        << number;
  }
  return coloured;
}

/// Opens one scripted device after the other; an empty script is a failure to open.
LiveCamera camera(std::vector<std::deque<Step>> scripts, bool both, const Taken& taken = nullptr) {
  LiveCamera result;
  result.config.name = "scripted";
  result.config.backoff = std::chrono::milliseconds(1);
  result.config.longest = std::chrono::milliseconds(4);
  result.config.stall = std::chrono::milliseconds(200);
  result.config.frame_rate = 100.0;
  result.config.shared_clock = true;
  const auto turn = std::make_shared<std::size_t>(0);
  result.open = [turn, scripts, both, taken]() -> Result<std::unique_ptr<CaptureDevice>> {
    if (*turn >= scripts.size()) return Error{"no more scripts"};
    const auto& script = scripts[(*turn)++];
    if (script.empty()) return Error{"not there"};
    return std::unique_ptr<CaptureDevice>(std::make_unique<ScriptedDevice>(script, both, taken));
  };
  return result;
}

std::vector<StereoFrame> take(LiveSource* source, std::size_t count, const Taken& taken = nullptr) {
  std::vector<StereoFrame> frames;
  for (int tries = 0; frames.size() < count && tries < 2000; ++tries) {
    auto next = source->next(std::chrono::milliseconds(50));
    if (next.state != SourceState::kFrame) continue;
    frames.push_back(std::move(next.frame));
    if (taken) ++*taken;
  }
  return frames;
}

/// The report once `done` says so, or after a while.
LiveReport report_when(const LiveSource& source,
                       const std::function<bool(const LiveReport&)>& done) {
  LiveReport report = source.report();
  for (int tries = 0; !done(report) && tries < 1000; ++tries) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    report = source.report();
  }
  return report;
}

TEST(LiveSource, EveryMishapIsCountedAndTheSequenceShowsIt) {
  auto steps = images(0, 2);
  steps.push_back({CaptureState::kDamaged, 0, 0});
  steps.push_back({CaptureState::kShort, 0, 0});
  steps.push_back({CaptureState::kImage, 4 * kScriptPeriod, 0});
  steps.push_back({CaptureState::kImage, 7 * kScriptPeriod, 2});
  std::vector<LiveCamera> cameras;
  cameras.push_back(camera({steps}, true));
  LiveSource source({}, {}, std::move(cameras));
  const auto frames = take(&source, 4);
  ASSERT_EQ(frames.size(), 4U);
  const std::uint64_t sequences[] = {0, 1, 4, 7};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(frames[i].sequence, sequences[i]);
    EXPECT_TRUE(frames[i].left.valid && frames[i].right.valid);
    EXPECT_EQ(frames[i].stamp_ns,
              static_cast<std::int64_t>(sequences[i]) * kScriptPeriod + 1'000'000'000'000);
  }
  EXPECT_EQ(frames[3].left.dropped, 4U);
  const CameraCounts counts = source.report().cameras.at(0).counts;
  EXPECT_EQ(counts.images, 4U);
  EXPECT_EQ(counts.damaged, 1U);
  EXPECT_EQ(counts.short_images, 1U);
  EXPECT_EQ(counts.skipped, 2U);
  EXPECT_EQ(counts.dropped(), 4U);
}

TEST(LiveSource, ALostDeviceIsOpenedAnew) {
  auto first = images(0, 2);
  first.push_back({CaptureState::kGone, 0, 0});
  std::vector<LiveCamera> cameras;
  cameras.push_back(camera({first, {}, {}, images(50, 2)}, true));
  LiveSource source({}, {}, std::move(cameras));
  const auto frames = take(&source, 4);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_GT(frames[2].sequence, frames[1].sequence + 1);
  const auto report = report_when(source, [](const LiveReport& r) {
    return r.cameras[0].counts.stalls >= 1 && r.cameras[0].state == CameraState::kLost;
  });
  const CameraReport& camera_report = report.cameras.at(0);
  EXPECT_EQ(camera_report.counts.disconnects, 1U);
  EXPECT_EQ(camera_report.counts.reconnects, 1U);
  EXPECT_GE(camera_report.counts.open_failures, 2U);
  // The second device fell silent.
  EXPECT_EQ(camera_report.counts.stalls, 1U);
  EXPECT_EQ(camera_report.state, CameraState::kLost);
  EXPECT_FALSE(camera_report.message.empty());
}

TEST(LiveSource, TwoDevicesArePairedByTime) {
  auto left = images(0, 12);
  auto right = images(0, 12);
  left.erase(left.begin() + 5);
  right.erase(right.begin() + 8);
  LiveSourceConfig config;
  config.pair_tolerance_ns = kScriptPeriod / 4;
  config.max_waiting = 12;  // the threads may run far apart
  std::vector<LiveCamera> cameras;
  const auto taken = std::make_shared<std::atomic<int>>(0);
  cameras.push_back(camera({left}, false, taken));
  cameras.push_back(camera({right}, false, taken));
  for (LiveCamera& each : cameras) each.config.stall = std::chrono::minutes(10);
  LiveSource source({}, config, std::move(cameras));
  for (const StereoFrame& frame : take(&source, 11, taken)) {
    EXPECT_EQ(frame.pair_error_s, 0.0);
    EXPECT_EQ(frame.right.valid, frame.stamp_ns != 8 * kScriptPeriod + 1'000'000'000'000);
  }
  const PairerCounts counts = source.report().pairs;
  EXPECT_EQ(counts.pairs, 10U);
  EXPECT_EQ(counts.unpaired_left, 1U);
  EXPECT_EQ(counts.unpaired_right, 1U);
}

TEST(LiveSource, ASlowCallerLosesTheOldestFramesAndIsTold) {
  std::vector<LiveCamera> cameras;
  cameras.push_back(camera({images(0, 20)}, true));
  LiveSource source({}, {}, std::move(cameras));
  report_when(source, [](const LiveReport& r) { return r.cameras[0].counts.images == 20; });
  const auto frames = take(&source, 4);
  ASSERT_EQ(frames.size(), 4U);
  EXPECT_EQ(frames.back().sequence, 19U);
  EXPECT_EQ(source.report().queue_dropped, 16U);
}

TEST(LiveSource, ColourComesWithItsFrameWhileItIsWanted) {
  const auto taken = std::make_shared<std::atomic<int>>(0);
  LiveSourceConfig config;
  config.colour_wanted = std::make_shared<std::atomic<bool>>(false);
  std::vector<LiveCamera> cameras;
  cameras.push_back(colour_camera(100, true, taken, config.colour_wanted));
  LiveSource source({}, config, std::move(cameras));
  const std::vector<bool> before = take_coloured(&source, 10, taken);
  EXPECT_EQ(before, std::vector<bool>(10, false));
  source.want_colour(true);
  take_coloured(&source, 10, taken);  // some were captured before
  EXPECT_EQ(take_coloured(&source, 10, taken), std::vector<bool>(10, true));
  source.want_colour(false);
  take_coloured(&source, 10, taken);
  EXPECT_EQ(take_coloured(&source, 10, taken), std::vector<bool>(10, false));
}

TEST(LiveSource, ColoursOfTwoDevicesArePairedWithTheirImages) {
  const auto taken = std::make_shared<std::atomic<int>>(0);
  LiveSourceConfig config;
  config.pair_tolerance_ns = kScriptPeriod / 4;
  config.max_waiting = 12;  // the threads may run far apart
  config.colour_wanted = std::make_shared<std::atomic<bool>>(true);
  std::vector<LiveCamera> cameras;
  cameras.push_back(colour_camera(30, false, taken, config.colour_wanted));
  cameras.push_back(colour_camera(30, false, taken, config.colour_wanted));
  LiveSource source({}, config, std::move(cameras));
  EXPECT_EQ(take_coloured(&source, 30, taken), std::vector<bool>(30, true));
}

TEST(ImagePool, GivesABufferOnlyWhenNobodyHoldsIt) {
  ImagePool pool(2, 16);
  auto a = pool.take();
  auto b = pool.take();
  ASSERT_TRUE(a && b);
  EXPECT_NE(a, b);
  EXPECT_EQ(pool.take(), nullptr);
  const void* memory = a->data();
  a.reset();
  EXPECT_EQ(pool.take()->data(), memory);
}

TEST(Backoff, GrowsToItsBoundAndForgets) {
  Backoff backoff(std::chrono::milliseconds(100), std::chrono::milliseconds(1000));
  EXPECT_EQ(backoff.next().count(), 100);
  EXPECT_EQ(backoff.next().count(), 160);
  for (int i = 0; i < 20; ++i) backoff.next();
  EXPECT_EQ(backoff.next().count(), 1000);
  backoff.reset();
  EXPECT_EQ(backoff.next().count(), 100);
}

TEST(HostClock, ReadsBothClocksForwards) {
  const HostClock a = read_host_clock();
  const HostClock b = read_host_clock();
  EXPECT_GE(b.monotonic_ns, a.monotonic_ns);
  EXPECT_GT(b.utc_ns, 1'600'000'000'000'000'000);
}

}  // namespace
}  // namespace sovo
