#include "sovo/driver/live/auto_exposure.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace sovo {
namespace {

constexpr int kStride = 8;          // pixels looked at: every eighth of every eighth row
constexpr int kSaturated = 250;     // grey level
constexpr double kDecibels = 20.0;  // of an amplitude ten times as large

struct GreySum {
  double sum = 0.0;
  double count = 0.0;
};

/// Pixels that are saturated hide how bright it is: they count as twice as bright.
void add(const SideImage& side, GreySum* total) {
  if (!side.valid || !side.data || side.format != PixelFormat::kMono8) return;
  for (int y = 0; y < side.height; y += kStride) {
    const std::uint8_t* row = side.data->data() + static_cast<std::ptrdiff_t>(y) * side.step;
    for (int x = 0; x < side.width; x += kStride) {
      total->sum += row[x] >= kSaturated ? 2.0 * row[x] : row[x];
      total->count += 1.0;
    }
  }
}

}  // namespace

std::optional<Exposure> AutoExposure::observe(const StereoFrame& frame) {
  GreySum total;
  add(frame.left, &total);
  add(frame.right, &total);
  if (total.count == 0.0) return std::nullopt;
  mean_grey_ = total.sum / total.count;
  if (!begun_) {
    begun_ = true;
    wait_ = config_.settle_frames;
    return now_;
  }
  if (wait_ > 0) {
    --wait_;
    return std::nullopt;
  }
  const double ratio = config_.target_grey / std::max(1.0, mean_grey_);
  if (std::abs(ratio - 1.0) < config_.dead_band) return std::nullopt;
  const double wanted = std::pow(ratio, config_.speed);
  const Exposure before = now_;
  scale_light(std::clamp(wanted, 1.0 / (1.0 + config_.max_step), 1.0 + config_.max_step));
  if (now_.exposure_s == before.exposure_s && now_.gain_db == before.gain_db) return std::nullopt;
  wait_ = config_.settle_frames;
  return now_;
}

void AutoExposure::scale_light(double factor) {
  if (factor < 1.0 && now_.gain_db > 0.0) {
    const double gain = std::max(0.0, now_.gain_db + kDecibels * std::log10(factor));
    factor *= std::pow(10.0, (now_.gain_db - gain) / kDecibels);
    now_.gain_db = gain;
  }
  const double exposure =
      std::clamp(now_.exposure_s * factor, config_.min_exposure_s, config_.max_exposure_s);
  factor *= now_.exposure_s / exposure;
  now_.exposure_s = exposure;
  if (factor > 1.0) {
    now_.gain_db =
        std::clamp(now_.gain_db + kDecibels * std::log10(factor), 0.0, config_.max_gain_db);
  }
}

}  // namespace sovo
