#include "sovo/scale/right_turn.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace sovo {

namespace {

constexpr double kUnseenPx = 0.15;  ///< Standard deviation from which on a keyframe tells nothing.
constexpr double kExpectedWeight = 3.0;  ///< Keyframes that `expected_px` counts for.
constexpr int kFewest = 5;               ///< Keyframes before a turn is believed.
constexpr int kMany = 20;                ///< That are enough to know how little they show.
constexpr double kFar = 1.5;             ///< From the mean, over the gate.
constexpr double kInDoubt = 2.5;         ///< Likewise: where a scale is not taken any more.
constexpr int kKnocked = 6;              ///< Keyframes in a row that are far from the mean.
/// How many times a turn must exceed what parts of the images disagree about it.
constexpr double kDisagreements = 12.0;
/// Of lenses that are described well keyframes scatter little: by this [px] before they have shown
/// by how much, and what few of them agree about counts less where they scatter by more.
constexpr double kClearPx = 0.04;
constexpr double kClearSigmas = 3.0;
constexpr double kFewestClear = 6.0;  ///< Keyframes; fewer may scatter little by chance.
/// How many times a turn must exceed what parts of the images disagree about all three axes.
constexpr double kClearDisagreements = 8.0;
constexpr double kStays = 0.85;      ///< Of their distance, which the newest has at least.
constexpr double kLeast = 0.25;      ///< Of the threshold, once it was exceeded.
constexpr double kSurePx = 0.25;     ///< What lenses look like at most, where they always do.
constexpr double kSureSigmas = 1.3;  ///< Nine of ten keyframes lie on this side of it.
/// Weight of a keyframe that hardly fits the map. Light that moves over what is seen bends the
/// depths of a young map, which looks like a yaw of up to two pixels.
constexpr double kDoubtfulWeight = 0.25;

}  // namespace

RightTurn::RightTurn(const RightTurnConfig& config, double focal)
    : config_(config), focal_(focal) {}

void RightTurn::note(const RightTurnEstimate& found, const SO3& given) {
  if (!found.valid || !found.turn.allFinite() || !found.disagreement.allFinite()) return;
  const Vec3 total = focal_ * (SO3::exp(found.turn) * given).log();
  for (int i = 0; i < 3; ++i) {
    Axis& axis = axes_[static_cast<std::size_t>(i)];
    axis.in_doubt = false;
    if (focal_ * found.sigma[i] < kUnseenPx) {
      const double weight = found.doubtful ? kDoubtfulWeight : 1.0;
      note({total[i], focal_ * found.disagreement[i], weight}, &axis);
    }
  }
  const bool before = decalibrated_;
  decalibrated_ = config_.undo && exceeds(before ? kLeast : 1.0);
  // With another turn the map becomes another one, which shows it better.
  if (decalibrated_ && !before) {
    for (Axis& axis : axes_) axis.turns.averaged = std::min(axis.turns.averaged, 1.0);
  }
  turn_ = decalibrated_ ? SO3::exp(certain_px() / focal_) : SO3();
}

/// Whether the turn about one of the axes exceeds this part of its threshold.
bool RightTurn::exceeds(double part) const {
  return std::any_of(axes_.begin(), axes_.end(), [part, this](const Axis& axis) {
    return axis.turns.count >= kFewest && std::abs(axis.turns.mean) > part * threshold(axis.turns);
  });
}

/// The means, fading where they are small parts of their thresholds, lest anything comes and goes.
Vec3 RightTurn::certain_px() const {
  Vec3 px = mean_px();
  for (int i = 0; i < 3; ++i) {
    const Turns& turns = axes_[static_cast<std::size_t>(i)].turns;
    const double part = turns.count > 0 ? std::abs(turns.mean) / threshold(turns) : 0.0;
    px[i] *= std::clamp(part / kLeast - 1.0, 0.0, 1.0);
  }
  return px;
}

bool RightTurn::in_doubt() const {
  return config_.undo &&
         std::any_of(axes_.begin(), axes_.end(), [](const Axis& axis) { return axis.in_doubt; });
}

void RightTurn::note(const KeyframeTurn& seen, Axis* axis) const {
  const double px = seen.px;
  const double away = std::abs(px - axis->turns.mean) /
                      (config_.gate_sigmas * spread(axis->turns, config_.expected_px));
  const bool known = axis->turns.count >= kFewest && std::abs(px - axis->turns.mean) > kSurePx;
  axis->in_doubt = known && away > kInDoubt;
  if (!known || away < kFar) {
    axis->turns.add(seen, config_.memory);
    axis->astray = {};
    return;
  }
  axis->astray.add(seen, config_.memory);
  const double moved = std::abs(axis->astray.mean - axis->turns.mean);
  // Those that do not agree with each other either are the scatter of another place, and what
  // goes back again comes of a map that is being mended.
  const bool stays = std::abs(px - axis->turns.mean) > kStays * moved;
  const bool knocked = axis->astray.count >= kKnocked && moved > threshold(axis->astray) && stays;
  if (knocked || axis->astray.count >= 2 * kKnocked) {
    axis->turns = std::exchange(axis->astray, {});
    axis->in_doubt = false;
  }
}

void RightTurn::Turns::add(const KeyframeTurn& seen, int memory) {
  count = std::min(count + seen.weight, 1.0 * memory);
  averaged = std::min(averaged + seen.weight, 1.0 * memory);
  const double share = seen.weight / averaged;
  const double innovation = seen.px - mean;
  mean += share * innovation;
  variance = (1.0 - share) * (variance + share * innovation * innovation);
  disagreement += share * (seen.disagreement_px * seen.disagreement_px - disagreement);
}

Vec3 RightTurn::mean_px() const {
  return {axes_[0].turns.mean, axes_[1].turns.mean, axes_[2].turns.mean};
}

/// Of a keyframe's turn about the mean: what is expected, and what was seen.
double RightTurn::spread(const Turns& turns, double expected_px) {
  return std::sqrt((kExpectedWeight * expected_px * expected_px + turns.count * turns.variance) /
                   (kExpectedWeight + turns.count));
}

/// Few keyframes know little of how they scatter. Where static depths hold the map, keyframes show
/// more or less of a turn, but hardly any of many shows as little as `kSurePx`.
double RightTurn::threshold(const Turns& turns) const {
  const double scatter = (1.0 + 2.0 / turns.count) * spread(turns, config_.expected_px);
  const double gate = std::max(config_.min_px, config_.gate_sigmas * scatter);
  const double bound = turns.count < kMany ? gate : std::min(gate, kSurePx + kSureSigmas * scatter);
  const double any_lens = std::max(bound, kDisagreements * std::sqrt(turns.disagreement));
  return std::min(any_lens, clear_threshold(turns));
}

/// Of lenses that are described well. One that is not shows it about some axis, most often as a
/// roll, when it looks like a turn about another.
double RightTurn::clear_threshold(const Turns& turns) const {
  double disagreement = 0.0;
  for (const Axis& axis : axes_) {
    if (axis.turns.count < kFewestClear) return std::numeric_limits<double>::infinity();
    disagreement += axis.turns.disagreement;
  }
  const double scatter = (1.0 + 2.0 / turns.count) * spread(turns, kClearPx);
  const double usual = kClearPx * std::sqrt(turns.count / kFewestClear);
  const double gate = kClearSigmas * scatter * std::max(1.0, scatter / usual);
  return std::max({config_.clear_px, gate, kClearDisagreements * std::sqrt(disagreement)});
}

}  // namespace sovo
