// Takes frames of two V4L2 cameras that show the two sides of the pattern of pattern.h, the number
// of each image that of the instant it was exposed at (emulated_camera), looks at every pixel, and
// prints what came as one line of JSON.
//
//     pair_check CALIBRATION SECONDS KEY=VALUE...
//
// KEY=VALUE are keys of V4l2Options and, with "live.", of LiveOptions. It goes on until all of
// these have come, or the seconds are over: "alone=N" left images without a right one, "dropped=N"
// right images without a left one, "reconnects=N" of the right camera, and then "pairs=N".
// "right_late_ms=T": the right camera exposes so much later, and no pair is a right one.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <iostream>
#include <optional>
#include <string>

#include "sovo/driver/live/host_clock.h"
#include "sovo/driver/v4l2/v4l2_source.h"
#include "sovo/io/yaml_config.h"
#include "vm/pattern.h"

namespace sovo::test {
namespace {

struct PairOptions {
  v4l2::V4l2Options v4l2;
  LiveOptions live;
  int alone = 0;
  int dropped = 0;
  int reconnects = 0;
  int pairs = 0;
  double right_late_ms = 0.0;

  template <class Visitor>
  void visit(Visitor& v) {
    v4l2.visit(v);
    v("live", live, "");
    v("alone", alone, "");
    v("dropped", dropped, "");
    v("reconnects", reconnects, "");
    v("pairs", pairs, "");
    v("right_late_ms", right_late_ms, "");
  }
};

/// What came.
struct Verdict {
  int frames = 0;
  int alone = 0;  ///< Left images without a right one.
  int pairs = 0;
  int torn = 0;        ///< Not one image's pixels, or not of this side.
  int mixed = 0;       ///< Left and right of different instants.
  int late = 0;        ///< The same, but one was stamped late: the emulated bus stood still.
  int not_rising = 0;  ///< Stamps.
  double largest_error_ms = 0.0;
};

class PairChecker {
 public:
  PairChecker(double frame_rate, double right_late_ms)
      : period_ns_(std::llround(1e9 / frame_rate)),
        right_late_ns_(std::llround(1e6 * right_late_ms)),
        clock_(read_host_clock()) {}

  void look(const StereoFrame& frame) {
    ++verdict_.frames;
    if (frame.stamp_ns <= last_stamp_) ++verdict_.not_rising;
    last_stamp_ = frame.stamp_ns;
    verdict_.largest_error_ms = std::max(verdict_.largest_error_ms, 1e3 * frame.pair_error_s);
    const auto left = number_of(frame.left, false);
    if (!frame.right.valid) {
      ++verdict_.alone;
      if (!left) ++verdict_.torn;
      return;
    }
    ++verdict_.pairs;
    const auto right = number_of(frame.right, true);
    if (!left || !right) {
      ++verdict_.torn;
    } else if (*left != *right || right_late_ns_ != 0) {
      const std::int64_t right_ns = frame.stamp_ns + frame.right.stamp_offset_ns;
      const bool late =
          is_late(*left, frame.stamp_ns) || is_late(*right, right_ns - right_late_ns_);
      ++(late ? verdict_.late : verdict_.mixed);
    }
  }

  const Verdict& verdict() const { return verdict_; }

 private:
  static std::optional<std::uint32_t> number_of(const SideImage& side, bool right) {
    if (!side.valid || side.step != side.width) return std::nullopt;
    return read_pattern(side.data->data(), side.width, side.height, right);
  }

  /// Whether the driver's stamp is not that of the instant, but of when it heard of the image.
  bool is_late(std::uint32_t number, std::int64_t stamp_ns) const {
    const std::int64_t instant = std::int64_t{number} * period_ns_;
    return std::abs(stamp_ns - (clock_.utc_ns - clock_.monotonic_ns) - instant) > period_ns_ / 4;
  }

  std::int64_t period_ns_;
  std::int64_t right_late_ns_;
  HostClock clock_;
  Verdict verdict_;
  std::int64_t last_stamp_ = 0;
};

void print(const char* name, const CameraCounts& c) {
  std::cout << ",\"" << name << "\":{\"images\":" << c.images << ",\"skipped\":" << c.skipped
            << ",\"bad\":" << c.damaged + c.short_images + c.no_room
            << ",\"disconnects\":" << c.disconnects << ",\"stalls\":" << c.stalls
            << ",\"reconnects\":" << c.reconnects << "}";
}

void print(const Verdict& v, const LiveReport& report) {
  const PairerCounts& pairs = report.pairs;
  std::cout << "RESULT {\"frames\":" << v.frames << ",\"alone\":" << v.alone
            << ",\"torn\":" << v.torn << ",\"mixed\":" << v.mixed << ",\"late\":" << v.late
            << ",\"not_rising\":" << v.not_rising << ",\"largest_error_ms\":" << v.largest_error_ms
            << ",\"pairs\":" << pairs.pairs << ",\"unpaired_left\":" << pairs.unpaired_left
            << ",\"unpaired_right\":" << pairs.unpaired_right
            << ",\"out_of_order\":" << pairs.out_of_order
            << ",\"queue_dropped\":" << report.queue_dropped;
  print("left", report.cameras.at(0).counts);
  print("right", report.cameras.at(1).counts);
  std::cout << "}" << std::endl;
}

/// Whether all has come that the pairs at the end are to follow.
bool is_over(const PairOptions& options, const Verdict& v, const LiveReport& report) {
  return v.alone >= options.alone &&
         report.pairs.unpaired_right >= static_cast<std::uint64_t>(options.dropped) &&
         report.cameras.at(1).counts.reconnects >= static_cast<std::uint64_t>(options.reconnects);
}

int run(const PairOptions& options, const std::string& calibration, double seconds) {
  auto opened = v4l2::open_v4l2(options.v4l2, options.live, calibration);
  if (!opened) {
    std::cerr << "pair_check: " << opened.error() << std::endl;
    return 1;
  }
  for (const std::string& note : opened->notes) std::cout << "note: " << note << std::endl;
  PairChecker checker(options.v4l2.frame_rate, options.right_late_ms);
  const auto begin = std::chrono::steady_clock::now();
  std::optional<int> pairs_before;  // all that was waited for had come
  while (std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(seconds)) {
    const SourceResult next = opened->source->next(std::chrono::milliseconds(100));
    if (next.state != SourceState::kFrame) continue;
    checker.look(next.frame);
    const Verdict& verdict = checker.verdict();
    if (next.frame.right.valid && verdict.pairs == 1) std::cout << "FIRST FRAME" << std::endl;
    if (!pairs_before && is_over(options, verdict, opened->source->report())) {
      pairs_before = verdict.pairs;
    }
    if (pairs_before && verdict.pairs - *pairs_before >= options.pairs) break;
  }
  std::cout << "PAIRS AT THE END "
            << checker.verdict().pairs - pairs_before.value_or(checker.verdict().pairs)
            << std::endl;
  print(checker.verdict(), opened->source->report());
  return 0;
}

}  // namespace
}  // namespace sovo::test

int main(int argc, char** argv) try {
  if (argc < 3) return 2;
  sovo::test::PairOptions options;
  for (int i = 3; i < argc; ++i) {
    if (auto set = sovo::apply_override(&options, argv[i]); !set) {
      std::cerr << "pair_check: " << set.error() << std::endl;
      return 2;
    }
  }
  return sovo::test::run(options, argv[1], std::atof(argv[2]));
} catch (const std::exception& e) {
  std::cerr << "pair_check: " << e.what() << std::endl;
  return 1;
}
