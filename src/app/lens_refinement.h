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
  std::optional<LensFit> fit;  ///< Of the rays of the left camera as it was given.
  SO3 right_turn;              ///< StereoOdometry::right_turn.
};

/// Runs over the recording with a rig.
using RunLensPass = std::function<Result<LensPass>(const StereoRig& rig)>;

/// How the search for a lens ended.
enum class LensSearch {
  kSettled,     ///< Keyframes see no more change than what they err by.
  kUntold,      ///< The recording does not tell the lens.
  kOutOfPasses  ///< Keyframes still see another one.
};

/// A rig whose lenses fit a recording.
struct LensRefinement {
  LensSearch end = LensSearch::kOutOfPasses;
  StereoRig rig;             ///< With the right camera as it was found to be turned, too.
  LensChange change, sigma;  ///< Of the numbers of both cameras; `sigma` where it has settled.
  int passes = 0;
};

/// Changes the lenses of both cameras alike until keyframes see no more change. They see a part of
/// it only, for bundle adjustment has bent the world to the lens as it was taken: so each pass runs
/// with the lens that the one before saw, and steps are lengthened as far as the last two were
/// alike (Anderson acceleration over one step). How large that part is shows a last pass, whose
/// focal length is wrong on purpose: where keyframes hardly see that, they did not tell any.
///
/// `on_pass`: told of each pass with its number, the change that it ran with, and what it saw.
Result<LensRefinement> refine_lens(
    const StereoRig& rig, int max_passes, const RunLensPass& run,
    const std::function<void(int, const LensChange&, const LensFit&)>& on_pass = {});

}  // namespace sovo::app
