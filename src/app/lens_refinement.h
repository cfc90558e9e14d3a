#pragma once

#include <functional>
#include <optional>

#include "sovo/geometry/lens_change.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/io/result.h"
#include "sovo/vo/lens_fit.h"

namespace sovo::app {

/// What one run over a recording showed.
struct LensPass {
  std::optional<LensFit> fit;  ///< Of the rays of the camera that was followed, as it was given.
};

enum class LensSide { kLeft, kRight };

/// Runs over the recording with a rig, and follows one of its cameras.
using RunLensPass = std::function<Result<LensPass>(const StereoRig& rig, LensSide followed)>;

/// How the search for a lens ended.
enum class LensSearch {
  kSettled,     ///< Keyframes see no more change than what they err by.
  kUntold,      ///< The recording does not tell the lens.
  kOutOfPasses  ///< Keyframes still see another one.
};

/// A rig of which a lens fits a recording.
struct LensRefinement {
  LensSearch end = LensSearch::kOutOfPasses;
  StereoRig rig;
  LensChange change, sigma;  ///< Of the camera's numbers; `sigma` where it has settled.
  int passes = 0;
};

/// Changes a lens until keyframes see no more change. They see a part of it only, for bundle
/// adjustment has bent the world to the lens as it was taken: so each pass runs with the lens that
/// the one before saw, and steps are lengthened as far as the last two were alike (Anderson
/// acceleration over one step). How large that part is shows a last pass, whose focal length is
/// wrong on purpose: where keyframes hardly see that, they did not tell any.
///
/// With the left lens the right one is changed alike, for what is wrong with one, the water that
/// both look into, mostly is with the other. The right one is changed alone.
///
/// `on_pass`: told of each pass with its number, the change that it ran with, and what it saw.
Result<LensRefinement> refine_lens(
    const StereoRig& rig, LensSide side, int max_passes, const RunLensPass& run,
    const std::function<void(int, const LensChange&, const LensFit&)>& on_pass = {});

}  // namespace sovo::app
