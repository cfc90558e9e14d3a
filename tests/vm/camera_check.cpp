// Takes frames of a side-by-side V4L2 camera that shows the pattern of pattern.h, looks at every
// pixel of them, and prints what came as one line of JSON.
//
//     camera_check CALIBRATION FRAMES SECONDS KEY=VALUE...
//
// KEY=VALUE are keys of V4l2Options and, with "live.", of LiveOptions; "pattern=false" looks at no
// pixel, "colour=true" asks for colour and compares it, "reconnects=N" goes on until there were so
// many.

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <iostream>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/v4l2/v4l2_source.h"
#include "sovo/io/text.h"
#include "sovo/io/yaml_config.h"
#include "vm/pattern.h"

namespace sovo::test {
namespace {

struct CheckOptions {
  v4l2::V4l2Options v4l2;
  LiveOptions live;
  bool pattern = true;
  bool colour = false;
  int reconnects = 0;

  template <class Visitor>
  void visit(Visitor& v) {
    v4l2.visit(v);
    v("live", live, "");
    v("pattern", pattern, "");
    v("colour", colour, "");
    v("reconnects", reconnects, "");
  }
};

/// What is wrong with the frames.
struct Verdict {
  std::uint64_t frames = 0;
  std::uint64_t torn = 0;         ///< Not one frame's pixels, or not of this side.
  std::uint64_t mixed = 0;        ///< Left and right of different frames.
  std::uint64_t missing = 0;      ///< Numbers between two frames that never came.
  std::uint64_t uncounted = 0;    ///< Steps of the number that `sequence` does not have.
  std::uint64_t not_rising = 0;   ///< Stamps.
  std::uint64_t coloured = 0;     ///< Frames with colour on both sides.
  std::uint64_t miscoloured = 0;  ///< Colours of the pattern are grey: all else.
  double downtime_s = 0.0;        ///< Longest.
};

class Checker {
 public:
  void look(const StereoFrame& frame, std::uint64_t reconnects, bool pattern) {
    ++verdict_.frames;
    if (frame.stamp_ns <= last_stamp_) ++verdict_.not_rising;
    last_stamp_ = frame.stamp_ns;
    if (!pattern) return;
    const auto left = number_of(frame.left, false);
    const auto right = number_of(frame.right, true);
    if (!left || !right) {
      ++verdict_.torn;
      return;
    }
    if (*left != *right) ++verdict_.mixed;
    // A camera that was plugged in anew counts from the beginning.
    if (last_number_ && reconnects == reconnects_ && *left > *last_number_) {
      const std::uint64_t step = *left - *last_number_;
      verdict_.missing += step - 1;
      if (step != frame.sequence - last_sequence_) ++verdict_.uncounted;
    }
    last_number_ = *left;
    last_sequence_ = frame.sequence;
    reconnects_ = reconnects;
  }

  /// Colour where it came, which is compared now and then: that takes an emulated machine long. The
  /// pattern is grey: each value is the luma.
  void look(const StereoFrame& frame, const StereoColour& colour) {
    if (!colour.left.bytes || !colour.right.bytes) return;
    if (verdict_.coloured++ % 8 != 0) return;
    if (!is_grey(frame.left, colour.left) || !is_grey(frame.right, colour.right)) {
      ++verdict_.miscoloured;
    }
  }

  const Verdict& verdict() const { return verdict_; }

 private:
  static std::optional<std::uint32_t> number_of(const SideImage& side, bool right) {
    if (!side.valid || side.step != side.width) return std::nullopt;
    return read_pattern(side.data->data(), side.width, side.height, right);
  }

  bool is_grey(const SideImage& side, const ColourImage& colour) {
    if (!reader_.read(colour, &rgb_) || rgb_.size() != 3 * side.data->size()) return false;
    for (std::size_t i = 0; i < rgb_.size(); ++i) {
      if (rgb_[i] != (*side.data)[i / 3]) return false;
    }
    return true;
  }

  ColourReader reader_;
  std::vector<std::uint8_t> rgb_;
  Verdict verdict_;
  std::int64_t last_stamp_ = 0;
  std::optional<std::uint32_t> last_number_;
  std::uint64_t last_sequence_ = 0;
  std::uint64_t reconnects_ = 0;
};

void print(const Verdict& v, const LiveReport& report) {
  const CameraReport& camera = report.cameras.at(0);
  const CameraCounts& c = camera.counts;
  std::cout << "RESULT {\"frames\":" << v.frames << ",\"torn\":" << v.torn
            << ",\"mixed\":" << v.mixed << ",\"missing\":" << v.missing
            << ",\"coloured\":" << v.coloured << ",\"miscoloured\":" << v.miscoloured
            << ",\"uncounted\":" << v.uncounted << ",\"not_rising\":" << v.not_rising
            << ",\"images\":" << c.images << ",\"skipped\":" << c.skipped
            << ",\"damaged\":" << c.damaged << ",\"short\":" << c.short_images
            << ",\"no_room\":" << c.no_room << ",\"queue_dropped\":" << report.queue_dropped
            << ",\"disconnects\":" << c.disconnects << ",\"stalls\":" << c.stalls
            << ",\"reconnects\":" << c.reconnects << ",\"downtime_s\":" << v.downtime_s
            << ",\"exposure_ms\":" << 1e3 * report.exposure_s << "}" << std::endl;
}

/// As /proc/uptime has it.
double uptime_s() {
  timespec time{};
  ::clock_gettime(CLOCK_BOOTTIME, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

int run(const CheckOptions& options, const std::string& calibration, std::uint64_t frames,
        double seconds) {
  auto opened = v4l2::open_v4l2(options.v4l2, options.live, calibration);
  if (!opened) {
    std::cerr << "camera_check: " << opened.error() << std::endl;
    return 1;
  }
  opened->source->want_colour(options.colour);
  Checker checker;
  Verdict worst;
  std::uint64_t reconnects = 0;
  const auto begin = std::chrono::steady_clock::now();
  const auto enough = [&](const CameraCounts& c) {
    return checker.verdict().frames >= frames &&
           c.reconnects >= static_cast<std::uint64_t>(options.reconnects);
  };
  while (std::chrono::steady_clock::now() - begin < std::chrono::duration<double>(seconds)) {
    const SourceResult next = opened->source->next(std::chrono::milliseconds(100));
    const CameraReport camera = opened->source->report().cameras.at(0);
    worst.downtime_s = std::max(worst.downtime_s, camera.downtime_s);
    if (next.state != SourceState::kFrame) continue;
    if (camera.counts.reconnects != reconnects) {
      reconnects = camera.counts.reconnects;
      std::cout << "BACK " << reconnects << " " << uptime_s() << std::endl;
    }
    checker.look(next.frame, camera.counts.reconnects, options.pattern);
    checker.look(next.frame, opened->source->colour());
    if (checker.verdict().frames == 1) std::cout << "FIRST FRAME " << camera.device << std::endl;
    if (enough(camera.counts)) break;
  }
  Verdict verdict = checker.verdict();
  verdict.downtime_s = worst.downtime_s;
  print(verdict, opened->source->report());
  return 0;
}

}  // namespace
}  // namespace sovo::test

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  sovo::test::CheckOptions options;
  for (int i = 4; i < argc; ++i) {
    if (auto set = sovo::apply_override(&options, argv[i]); !set) {
      std::cerr << "camera_check: " << set.error() << std::endl;
      return 2;
    }
  }
  return sovo::test::run(options, argv[1], std::strtoull(argv[2], nullptr, 10), std::atof(argv[3]));
}
