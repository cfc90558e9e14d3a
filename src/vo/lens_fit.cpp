#include "sovo/vo/lens_fit.h"

#include <array>
#include <cstddef>

namespace sovo {

namespace {

/// What a keyframe errs by whatever its noise: patterns are not points, and images not sharp.
constexpr double kFocalError = 1e-3;
constexpr double kRadialError = 1e-3;

/// A keyframe is as sure as it can be.
LensEvidence tempered(const LensEvidence& keyframe) {
  const Vec2 variance(kFocalError * kFocalError, kRadialError * kRadialError);
  const Mat2 less = (Mat2::Identity() + keyframe.H * variance.asDiagonal()).inverse();
  return {less * keyframe.H, less * keyframe.b};
}

Vec2 solved(const LensEvidence& sum) { return -sum.H.inverse() * sum.b; }

}  // namespace

std::optional<LensFit> fit_lens(std::span<const LensEvidence> keyframes) {
  constexpr std::size_t kParts = 10;
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
  std::array<Vec2, kParts> without;
  Vec2 mean = Vec2::Zero();
  for (std::size_t i = 0; i < kParts; ++i) {
    without[i] = solved({all.H - parts[i].H, all.b - parts[i].b});
    mean += without[i] / kParts;
  }
  Vec2 variance = Vec2::Zero();
  for (const Vec2& value : without) variance += (value - mean).cwiseAbs2();
  const Vec2 sigma = ((kParts - 1.0) / kParts * variance).cwiseSqrt();
  const Vec2 value = solved(all);
  if (!value.allFinite() || !sigma.allFinite()) return std::nullopt;
  return LensFit{{value[0], value[1]}, {sigma[0], sigma[1]}};
}

}  // namespace sovo
