#include "sovo/driver/sim/sensor.h"

#include <algorithm>
#include <cmath>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

constexpr int kResponseSteps = 4096;

/// Sums of bytes of random bits come near enough to a Gaussian of deviation 1.
float gaussian(std::uint64_t bits) {
  int sum = 0;
  for (int i = 0; i < 8; ++i) sum += static_cast<int>(bits >> (8 * i) & 0xFFU);
  // Eight bytes: mean 1020, variance 8 * (256^2 - 1) / 12.
  return (static_cast<float>(sum) - 1020.0F) * (1.0F / 209.021F);
}

}  // namespace

ExposureControl::ExposureControl(const SensorConfig& config, double suited_s)
    : config_(config),
      suited_s_(suited_s),
      exposure_s_(config.exposure_ms > 0.0 ? 1e-3 * config.exposure_ms : suited_s),
      gain_db_(config.gain_db) {}

double ExposureControl::sensitivity() const {
  return exposure_s_ / suited_s_ * std::pow(10.0, gain_db_ / 20.0);
}

void ExposureControl::scale_by(double factor) {
  // Exposure first; gain only where exposure ends.
  const double total = exposure_s_ * std::pow(10.0, gain_db_ / 20.0) * factor;
  exposure_s_ = std::clamp(total, 2e-5, 1e-3 * config_.max_exposure_ms);
  gain_db_ = std::clamp(20.0 * std::log10(total / exposure_s_), 0.0, config_.max_gain_db);
}

void ExposureControl::settle(const ImageF& light) {
  if (!config_.auto_exposure) return;
  double sum = 0.0;
  for (std::size_t i = 0; i < light.size(); ++i) sum += double{std::min(light.data()[i], 2.0F)};
  const double mean = sum / static_cast<double>(light.size()) * sensitivity();
  const double wanted = std::pow(config_.target_grey / 255.0, config_.response_gamma);
  scale_by(wanted / std::max(1e-4, mean));
}

void ExposureControl::observe(const std::vector<std::uint8_t>& pixels) {
  if (!config_.auto_exposure || pixels.empty()) return;
  double sum = 0.0;
  for (const std::uint8_t p : pixels) sum += p;
  const double mean = std::max(2.0, sum / static_cast<double>(pixels.size()));
  const double error = config_.target_grey / mean;
  scale_by(std::pow(error, config_.exposure_speed * config_.response_gamma));
}

float light_factor(const SensorConfig& config, double since_s) {
  const bool changed = since_s >= config.light_from_s && since_s < config.light_until_s;
  return static_cast<float>(changed ? config.light_factor : 1.0);
}

void change_light(const SensorConfig& config, double since_s, ImageF* light) {
  constexpr float kVeilLight = 0.4F;  // about the mean of the worlds
  const float factor = light_factor(config, since_s);
  const auto veil = static_cast<float>(config.veil);
  if (veil == 0.0F && factor == 1.0F) return;
  for (std::size_t i = 0; i < light->size(); ++i) {
    float& l = light->data()[i];
    l = factor * (l + veil * (kVeilLight - l));
  }
}

Sensor::Sensor(const SensorConfig& config, int width, int height) : config_(config) {
  vignette_.resize(width, height);
  const double cx = 0.5 * (width - 1);
  const double cy = 0.5 * (height - 1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double r2 = ((x - cx) * (x - cx) + (y - cy) * (y - cy)) / (cx * cx + cy * cy);
      vignette_.at(x, y) = static_cast<float>(1.0 - config.vignette * r2);
    }
  }
  response_.resize(kResponseSteps + 1);
  for (int i = 0; i <= kResponseSteps; ++i) {
    const double grey =
        255.0 * std::pow(static_cast<double>(i) / kResponseSteps, 1.0 / config.response_gamma);
    response_[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(std::lround(grey));
  }
}

std::vector<std::uint8_t> Sensor::expose(const ImageF& light, const ExposureControl& exposure,
                                         bool dark, std::uint64_t seed) const {
  std::vector<std::uint8_t> pixels(light.size());
  const auto sensitivity = dark ? 0.0F : static_cast<float>(exposure.sensitivity());
  const double gain = std::pow(10.0, exposure.gain_db() / 20.0);
  // Variances in units of full scale; gain amplifies what the photons and the circuit do.
  const auto read = static_cast<float>(std::pow(config_.read_noise * gain / 255.0, 2));
  const auto shot = static_cast<float>(std::pow(config_.shot_noise / 255.0, 2) * gain);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const float clean = light.data()[i] * vignette_.data()[i] * sensitivity;
    const float noise = gaussian(scramble(seed + i)) * std::sqrt(read + shot * clean);
    const float level = std::clamp(clean + noise, 0.0F, 1.0F) * static_cast<float>(kResponseSteps);
    pixels[i] = response_[static_cast<std::size_t>(level + 0.5F)];
  }
  return pixels;
}

PhotometricCalibration Sensor::photometric() const {
  PhotometricCalibration calibration;
  if (!config_.calibrated) return calibration;
  if (config_.response_gamma != 1.0) {
    for (int i = 0; i < 256; ++i) {
      calibration.inverse_response.push_back(
          static_cast<float>(255.0 * std::pow(i / 255.0, config_.response_gamma)));
    }
  }
  if (config_.vignette > 0.0) calibration.vignette = vignette_;
  return calibration;
}

}  // namespace sovo::sim
