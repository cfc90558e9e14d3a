#include "sovo/odometry/stereo_start.h"

#include <cmath>

namespace sovo {

double StereoQuality::good_share() const {
  return in_view > 0 ? static_cast<double>(good) / static_cast<double>(in_view) : 0.0;
}

bool StereoQuality::is_enough(double least_share) const {
  // Depths of weak texture are rougher: it takes more of them.
  const std::size_t fewest = weak_texture ? 200 : 100;
  return good >= fewest && good_share() >= least_share;
}

bool StereoQuality::is_noisy() const {
  constexpr double kNoisy = 0.45;
  return weak_texture && good_share() < kNoisy;
}

bool StereoQuality::is_clearer_than(const StereoQuality& whole) const {
  // Halving a clear image brings a tenth to a fifth more, a noisy one half as many again and more.
  constexpr double kClearer = 1.5;
  return good_share() > kClearer * whole.good_share();
}

std::string StereoQuality::problem() const {
  return "only " + std::to_string(good) + " of " + std::to_string(in_view) +
         " static stereo matches are good: too little texture, repetitive texture, or a "
         "wrong calibration (sovo calib check)";
}

std::string StereoQuality::why_halved(int halvings) const {
  return "images are reduced to 1/" + std::to_string(1 << halvings) +
         " of their size, for in whole ones " + problem();
}

StereoStart stereo_start(const std::vector<SelectedPixel>& pixels,
                         const std::vector<StaticMatch>& matches) {
  StereoStart start;
  start.points.resize(pixels.size());
  double scale_information = 0.0;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const DepthProposal depth = proposal_of(matches[i]);
    start.points[i] = {pixels[i], depth};
    const bool good = depth.sigma > 0.0F;
    const bool tells = !pixels[i].sparse;
    if (tells && matches[i].state != MatchState::kOutOfView) ++start.quality.in_view;
    if (tells && good) ++start.quality.good;
    if (!good) continue;
    scale_information += std::pow(depth.rho / depth.sigma, 2);
  }
  start.quality.weak_texture = !pixels.empty() && pixels.front().threshold_share < 1.0F;
  start.scale_sigma = 1.0 / std::sqrt(scale_information);
  return start;
}

DepthProposal proposal_of(const StaticMatch& match) {
  if (match.state != MatchState::kMatched) return {};
  return {match.inverse_depth, match.sigma};
}

}  // namespace sovo
