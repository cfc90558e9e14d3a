#include "sovo/vo/lens_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <vector>

namespace sovo {

namespace {

/// What a keyframe errs by whatever its noise: patterns are not points, and images not sharp.
constexpr double kFocalError = 1e-3;
constexpr double kRadialError = 1e-3;

bool turns_enough(const LensEvidence& keyframe) {
  return keyframe.turn >= std::max(kLeastLensTurn, kLeastLensTurnOnWay * keyframe.way);
}

/// A keyframe is as sure as it can be.
LensEvidence tempered(const LensEvidence& keyframe) {
  const Vec2 variance(kFocalError * kFocalError, kRadialError * kRadialError);
  const Mat2 less = (Mat2::Identity() + keyframe.H * variance.asDiagonal()).inverse();
  return {less * keyframe.H, less * keyframe.b};
}

Vec2 solved(const LensEvidence& sum) { return -sum.H.inverse() * sum.b; }

constexpr std::size_t kParts = 10;

/// Least squares over keyframes, and the same without one tenth of them after the other.
struct Jackknife {
  Vec2 value = Vec2::Zero(), sigma = Vec2::Zero();
  std::array<Vec2, kParts> without;

  /// The focal length is off by more, in the same direction, whichever tenth is left out.
  bool focal_exceeds(double least) const {
    return std::all_of(without.begin(), without.end(), [&](const Vec2& v) {
      return v[0] * value[0] > 0.0 && std::abs(v[0]) > least;
    });
  }
};

/// Of a sequence of LensEvidence.
template <class Keyframes>
std::optional<Jackknife> jackknife(const Keyframes& keyframes) {
  if (keyframes.size() < kParts) return std::nullopt;
  std::array<LensEvidence, kParts> parts;
  LensEvidence all;
  for (std::size_t i = 0; i < keyframes.size(); ++i) {
    const LensEvidence keyframe = tempered(keyframes[i]);
    LensEvidence& part = parts[i * kParts / keyframes.size()];
    part.H += keyframe.H;
    part.b += keyframe.b;
    all.H += keyframe.H;
    all.b += keyframe.b;
  }
  Jackknife out;
  Vec2 mean = Vec2::Zero();
  for (std::size_t i = 0; i < kParts; ++i) {
    out.without[i] = solved({all.H - parts[i].H, all.b - parts[i].b});
    mean += out.without[i] / kParts;
  }
  Vec2 variance = Vec2::Zero();
  for (const Vec2& value : out.without) variance += (value - mean).cwiseAbs2();
  out.sigma = ((kParts - 1.0) / kParts * variance).cwiseSqrt();
  out.value = solved(all);
  if (!out.value.allFinite() || !out.sigma.allFinite()) return std::nullopt;
  return out;
}

}  // namespace

std::optional<LensFit> fit_lens(std::span<const LensEvidence> keyframes) {
  std::vector<LensEvidence> telling;
  std::ranges::copy_if(keyframes, std::back_inserter(telling), turns_enough);
  const auto fit = jackknife(telling);
  if (!fit) return std::nullopt;
  return LensFit{LensChange::of(fit->value), LensChange::of(fit->sigma)};
}

void LensWatch::note(const LensEvidence& keyframe) {
  constexpr std::size_t kFewest = 12;
  constexpr std::size_t kMost = 60;
  // Keyframes err alike, those of good lenses by up to 0.3 % together; of 2 % they see 1.1 to 1.7.
  constexpr double kClear = 1e-2;
  constexpr double kSigmas = 4.0;
  if (!turns_enough(keyframe)) return;
  keyframes_.push_back(keyframe);
  if (keyframes_.size() > kMost) keyframes_.pop_front();
  if (keyframes_.size() < kFewest) return;
  const auto seen = jackknife(keyframes_);
  if (!seen || !seen->focal_exceeds(kClear)) return;
  if (std::abs(seen->value[0]) < kSigmas * seen->sigma[0]) return;
  const std::lock_guard lock(mutex_);
  focal_error_ = seen->value[0];
}

double LensWatch::focal_error() const {
  const std::lock_guard lock(mutex_);
  return focal_error_;
}

}  // namespace sovo
