#include "sovo/odometry/pixel_matching.h"

#include <algorithm>
#include <utility>

namespace sovo {

namespace {

constexpr std::size_t kMatchBlock = 64;

/// Every how many pixels one is a scout: one in eight, or more where that would make fewer than
/// sixty, of whom too few would be matched to tell the range.
std::size_t scout_stride(std::size_t num_pixels) {
  constexpr std::size_t kEnough = 60;
  return std::clamp<std::size_t>(num_pixels / kEnough, 1, 8);
}

/// The scouts are matched over the whole range; the others then no nearer than half as far as the
/// nearest of those: a long search costs most of the time, and may go astray.
std::pair<float, float> range_of_scouts(const std::vector<StaticMatch>& matches,
                                        const std::vector<std::size_t>& scouts,
                                        std::pair<float, float> whole) {
  constexpr int kFewest = 30;
  constexpr float kNearer = 2.0F;
  float nearest = 0.0F;
  int matched = 0;
  for (const std::size_t i : scouts) {
    if (matches[i].state != MatchState::kMatched) continue;
    nearest = std::max(nearest, matches[i].inverse_depth);
    ++matched;
  }
  if (matched < kFewest) return whole;
  return {whole.first, std::clamp(kNearer * nearest, whole.first, whole.second)};
}

}  // namespace

std::vector<StaticMatch> match_pixels(const StaticMatcher& matcher, const ImagePyramid& left,
                                      const ImagePyramid& right,
                                      const std::vector<SelectedPixel>& pixels, WorkerPool* pool) {
  std::vector<StaticMatch> matches(pixels.size());
  const auto match_some = [&](const std::vector<std::size_t>& which, const MatchRequest& common) {
    const std::size_t blocks = (which.size() + kMatchBlock - 1) / kMatchBlock;
    pool->run(static_cast<int>(blocks), [&](int block) {
      const std::size_t begin = static_cast<std::size_t>(block) * kMatchBlock;
      for (std::size_t i = begin; i < std::min(which.size(), begin + kMatchBlock); ++i) {
        const SelectedPixel& pixel = pixels[which[i]];
        MatchRequest request = common;
        request.gradient_share = pixel.threshold_share;
        matches[which[i]] = matcher.match(left, right, pixel.x, pixel.y, request);
      }
    });
  };
  std::vector<std::size_t> scouts;
  std::vector<std::size_t> others;
  const std::size_t stride = scout_stride(pixels.size());
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    (i % stride == 0 ? scouts : others).push_back(i);
  }
  match_some(scouts, {});
  match_some(others,
             {.inverse_depth_range = range_of_scouts(matches, scouts, matcher.whole_range())});
  return matches;
}

}  // namespace sovo
