#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sovo/image/static_matcher.h"
#include "sovo/vo/monocular_backend.h"
#include "sovo/vo/pixel_selector.h"

namespace sovo {

/// How well the pixels that were selected in a left image are found in the right one.
struct StereoQuality {
  std::size_t good = 0;       ///< Static matches.
  std::size_t in_view = 0;    ///< Pixels whose matches the right image may show.
  bool weak_texture = false;  ///< Pixels had to be selected below the usual gradient.

  /// Of what is in view; 0 where nothing is.
  double good_share() const;
  /// Whether a map can begin with these depths, `least_share` of which must be good.
  bool is_enough(double least_share) const;
  /// Whether noise decides what is selected and matched: a map of it may begin, and breaks at once.
  bool is_noisy() const;
  /// Whether these, in smaller images, are so much better that a map had better begin there.
  bool is_clearer_than(const StereoQuality& whole) const;
  /// For people: why it is not enough.
  std::string problem() const;
  /// And that smaller images are taken for it.
  std::string why_halved(int halvings) const;
};

/// What a map may begin with: pixels of one frame with their depths from static stereo.
struct StereoStart {
  std::vector<StartPoint> points;  ///< Of all pixels; where there is no match the depth is empty.
  StereoQuality quality;
  double scale_sigma = 0.0;  ///< Of the log-scale, by the matching errors alone.
};

/// `matches`: of `pixels`, in their order.
StereoStart stereo_start(const std::vector<SelectedPixel>& pixels,
                         const std::vector<StaticMatch>& matches);

/// The depth of a match, empty where there is none.
DepthProposal proposal_of(const StaticMatch& match);

}  // namespace sovo
