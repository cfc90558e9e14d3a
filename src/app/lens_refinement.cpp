#include "sovo/app/lens_refinement.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo::app {
namespace {

/// A recording that leaves the focal length more uncertain (a logarithm) does not tell it, unless
/// it is off by ten times that.
constexpr double kMostFocalSigma = 3e-3;
constexpr double kMostOfChange = 0.1;
/// Less is not worth another pass.
constexpr double kLeastFocal = 2e-4;
constexpr double kLeastRadial = 4e-4;
/// At once the lens is changed by so much at most.
constexpr double kMostAtOnce = 0.05;
/// Keyframes err more alike than leaving out tenths of them shows, as measured.
constexpr double kTooSure = 2.0;
/// By so much the focal length is wrong on purpose, and so much of it keyframes must see.
constexpr double kProbe = 0.01;
constexpr double kLeastSeen = 0.15;

/// Finds where the step that a pass sees vanishes.
class StepAcceleration {
 public:
  /// The next place after `at`, where `step` was seen.
  Vec2 next(const Vec2& at, const Vec2& step) {
    Vec2 change = step;
    if (last_) {
      const Vec2 turned = step - last_->second;
      const double squared = turned.squaredNorm();
      const double share = squared > 0.0 ? turned.dot(step) / squared : 0.0;
      change -= share * (at - last_->first + turned);
    }
    // Never against what was seen, and not too far.
    constexpr double kLongest = 4.0;
    if (change.dot(step) <= 0.0) change = step;
    const double most = std::min(kMostAtOnce, kLongest * step.norm());
    if (const double norm = change.norm(); norm > most) change *= most / norm;
    last_ = {at, step};
    return at + change;
  }

 private:
  std::optional<std::pair<Vec2, Vec2>> last_;
};

const CameraModel& camera_of(const StereoRig& rig, LensSide side) {
  return side == LensSide::kLeft ? rig.left : rig.right;
}

StereoRig with_lens(const StereoRig& rig, LensSide side, const Vec2& at) {
  const LensChange numbers = LensChange::of(at);
  StereoRig out = rig;
  if (side == LensSide::kLeft) out.left = with_changed_numbers(rig.left, numbers);
  out.right = with_changed_numbers(rig.right, numbers);
  return out;
}

/// What a pass sees, in the numbers of the cameras that it ran with.
struct SeenNumbers {
  Vec2 step, sigma;

  bool is_small() const {
    return std::abs(step[0]) < std::max(kLeastFocal, sigma[0]) &&
           std::abs(step[1]) < std::max(kLeastRadial, sigma[1]);
  }
  /// Far from the lens as it is keyframes agree less about it.
  bool tells_direction() const {
    return sigma.allFinite() && sigma[0] < std::max(kMostFocalSigma, 0.5 * std::abs(step[0]));
  }
};

SeenNumbers in_numbers(const LensFit& fit, const CameraModel& camera) {
  const Mat2 to_numbers = change_of_rays(camera).inverse();
  return {to_numbers * fit.change.vector(), to_numbers.cwiseAbs() * fit.sigma.vector()};
}

/// Share of a wrong focal length that keyframes see; zero where they tell none.
Result<double> seen_share(const StereoRig& rig, LensSide side, const Vec2& at,
                          const LensFit& settled, const RunLensPass& run) {
  const StereoRig found = with_lens(rig, side, at);
  const Vec2 wrong = at + change_of_rays(camera_of(found, side)).inverse() * Vec2(kProbe, 0.0);
  const auto pass = run(with_lens(rig, side, wrong), side);
  if (!pass) return pass.failure();
  if (!pass->fit) return 0.0;
  return (settled.change.focal - pass->fit->change.focal) / kProbe;
}

}  // namespace

Result<LensRefinement> refine_lens(
    const StereoRig& rig, LensSide side, int max_passes, const RunLensPass& run,
    const std::function<void(int, const LensChange&, const LensFit&)>& on_pass) {
  LensRefinement out;
  StepAcceleration acceleration;
  Vec2 at = Vec2::Zero();
  while (out.passes < max_passes) {
    out.rig = with_lens(rig, side, at);
    const auto pass = run(out.rig, side);
    if (!pass) return pass.failure();
    ++out.passes;
    out.change = LensChange::of(at);
    out.end = LensSearch::kUntold;
    if (!pass->fit) return out;
    if (on_pass) on_pass(out.passes, out.change, *pass->fit);
    const SeenNumbers seen = in_numbers(*pass->fit, camera_of(out.rig, side));
    if (!seen.tells_direction()) return out;
    if (seen.is_small()) {
      const auto share = seen_share(rig, side, at, *pass->fit, run);
      if (!share) return share.failure();
      out.sigma = LensChange::of(kTooSure * seen.sigma / std::max(*share, 1e-6));
      const double most = std::max(kMostFocalSigma, kMostOfChange * std::abs(out.change.focal));
      const bool tells = *share > kLeastSeen && out.sigma.focal < most;
      if (tells) out.end = LensSearch::kSettled;
      return out;
    }
    at = acceleration.next(at, seen.step);
    out.end = LensSearch::kOutOfPasses;
  }
  return out;
}

}  // namespace sovo::app
