#include "sovo/place/landmarks.h"

#include <algorithm>

#include "sovo/image/halving.h"

namespace sovo {
namespace {

/// A keypoint of an image that was halved so often, where the whole image has it.
Keypoint in_whole_image(Keypoint keypoint, int halvings) {
  keypoint.u = from_halved(keypoint.u, halvings);
  keypoint.v = from_halved(keypoint.v, halvings);
  keypoint.level = static_cast<std::uint8_t>(keypoint.level + halvings);
  return keypoint;
}

}  // namespace

std::vector<Landmark> find_landmarks(const StereoView& view, const StaticMatcherConfig& matcher,
                                     const StereoRig& rig, const KeypointConfig& keypoints) {
  StereoRig reduced = rig;
  reduced.left = rig.left.at_level(view.halvings);
  reduced.right = rig.right.at_level(view.halvings);
  const StaticMatcher at_exposures(matcher, reduced.moved(view.T_later_left));
  std::vector<Landmark> landmarks;
  for (const Keypoint& keypoint : detect_keypoints(*view.left, view.mask, keypoints)) {
    Landmark landmark{.keypoint = in_whole_image(keypoint, view.halvings)};
    const StaticMatch match = at_exposures.match(*view.left, *view.right, keypoint.u, keypoint.v);
    if (match.state == MatchState::kMatched && match.inverse_depth > 2.0F * match.sigma) {
      landmark.inverse_depth = match.inverse_depth;
      landmark.sigma = match.sigma;
    }
    landmarks.push_back(landmark);
  }
  return landmarks;
}

ImageU8 both_masks(const ImageU8& a, const ImageU8& b) {
  if (a.empty()) return b;
  if (b.empty()) return a;
  ImageU8 out = a;
  for (std::size_t i = 0; i < out.size(); ++i) out.data()[i] = std::min(a.data()[i], b.data()[i]);
  return out;
}

}  // namespace sovo
