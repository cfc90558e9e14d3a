#include "sovo/vo/co_moving_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "sovo/image/interpolation.h"
#include "sovo/vo/likeness.h"

namespace sovo {

namespace {

constexpr float kMostVotes = 24.0F;  ///< Of a cell; then it keeps half of them.
constexpr float kNoise = 0.7F;       ///< Of a pattern, in RMS of what has moved as expected.
constexpr int kChangesToGiveUp = 3;
constexpr int kSurrounded = 5;      ///< Of the eight cells around.
constexpr double kMostShare = 0.5;  ///< Of the image; with more, poses are wrong, not the world.

/// RMS difference of a pattern from what is seen at a place, but for its mean: the light that falls
/// on what moves along changes [grey levels].
float difference_at(const ImageF& image, const HostGeometry& host, const ImmaturePoint& p,
                    const Eigen::Vector2f& place) {
  std::array<float, kPatternSize> r{};
  float mean = 0.0F;
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    r[i] = sample(image, place.x() + kPattern[i].x, place.y() + kPattern[i].y) -
           host.gain * p.colour[i];
    mean += r[i] / kPatternSize;
  }
  float squares = 0.0F;
  for (const float value : r) squares += (value - mean) * (value - mean);
  return std::sqrt(squares / kPatternSize);
}

/// Where a point may be seen by the inverse depths of its interval, or up to `nearest` where that
/// is unknown, from the farthest on; it ends where it would lie behind the camera [px].
struct PossiblePlaces {
  static constexpr int kCount = 9;
  PossiblePlaces(const HostGeometry& host, const ImmaturePoint& p, float nearest) {
    const bool known = std::isfinite(p.rho_max);
    const float from = known ? p.rho_min : 0.0F;
    const float to = known ? p.rho_max : nearest;
    const Eigen::Vector3f ray = host.KRKi * Eigen::Vector3f(p.u, p.v, 1.0F);
    for (int k = 0; k < kCount; ++k) {
      const float rho = from + (to - from) * static_cast<float>(k) / (kCount - 1);
      const Eigen::Vector3f at = ray + rho * host.Kt;
      if (!(at.z() > 0.0F)) break;
      places[static_cast<std::size_t>(count++)] = at.hnormalized();
    }
  }
  std::array<Eigen::Vector2f, kCount> places;
  int count = 0;
};

/// RMS change of brightness in a point's place that its motion to any of the places brings at
/// least, were its gradients to hold so far; 0 where it may come to lie in its place again
/// [grey levels].
float expected_change(const PossiblePlaces& possible, const ImmaturePoint& p) {
  float least = std::numeric_limits<float>::infinity();
  Eigen::Vector2f before = Eigen::Vector2f::Zero();
  for (int k = 0; k < possible.count; ++k) {
    const Eigen::Vector2f d =
        possible.places[static_cast<std::size_t>(k)] - Eigen::Vector2f(p.u, p.v);
    const Eigen::Vector2f Gd(p.gxx * d.x() + p.gxy * d.y(), p.gxy * d.x() + p.gyy * d.y());
    if (k > 0 && !(Gd.dot(before) > 0.0F)) return 0.0F;
    least = std::min(least, std::sqrt(std::max(0.0F, Gd.dot(d)) / kPatternSize));
    before = d;
  }
  return std::isfinite(least) ? least : 0.0F;
}

/// The least RMS difference, but for its mean, from what is seen at one of the places; infinite
/// where none of them is in view [grey levels].
float best_match(const ImageF& image, const HostGeometry& host, const PossiblePlaces& possible,
                 const ImmaturePoint& p) {
  float best = std::numeric_limits<float>::infinity();
  for (int k = 0; k < possible.count; ++k) {
    const Eigen::Vector2f& at = possible.places[static_cast<std::size_t>(k)];
    if (in_image(image, at.x(), at.y(), kPatternBorder)) {
      best = std::min(best, difference_at(image, host, p, at));
    }
  }
  return best;
}

}  // namespace

CoMovingVote co_moving_vote(const CoMovingConfig& config, const ImageF& image,
                            const HostGeometry& host, const ImmaturePoint& point, float nearest,
                            double rmse) {
  const float gradient = std::sqrt((point.gxx + point.gyy) / kPatternSize);
  if (!(gradient > static_cast<float>(config.min_gradient))) return CoMovingVote::kNone;
  if (!in_image(image, point.u, point.v, kPatternBorder)) return CoMovingVote::kNone;
  const float in_place = difference_at(image, host, point, {point.u, point.v});
  // As much as a displacement would bring, but for noise.
  const float displaced = (in_place - kNoise * static_cast<float>(rmse)) / gradient;
  if (displaced > static_cast<float>(config.moves_above)) return CoMovingVote::kMoves;
  const PossiblePlaces possible(host, point, nearest);
  const float moved = best_match(image, host, possible, point);
  const auto share = static_cast<float>(config.better_match);
  if (moved < share * in_place) return CoMovingVote::kMoves;
  const float expected = expected_change(possible, point) / gradient;
  const bool stays = displaced < static_cast<float>(config.stays_below) &&
                     in_place < share * moved &&
                     expected > static_cast<float>(config.min_displacement);
  return stays ? CoMovingVote::kStays : CoMovingVote::kNone;
}

CoMovingCells::CoMovingCells(const CoMovingConfig& config, int width, int height)
    : config_(config),
      cells_(config.cell, width, height),
      votes_(cells_.size()),
      found_(cells_.size(), 0) {}

double CoMovingCells::share() const {
  return static_cast<double>(num_found_) / static_cast<double>(found_.size());
}

void CoMovingCells::vote(const ImageF& image, const HostGeometry& host,
                         std::span<const ImmaturePoint> points, float nearest, double rmse) {
  ChosenCells stays(cells_.size(), 0);
  for (const ImmaturePoint& p : points) {
    const CoMovingVote vote = co_moving_vote(config_, image, host, p, nearest, rmse);
    if (vote == CoMovingVote::kNone) continue;
    const std::size_t cell = cells_.at(p.u, p.v);
    Votes& v = votes_[cell];
    if (vote == CoMovingVote::kStays) {
      v.stays += 1.0F;
      stays[cell] = 1;
    } else {
      v.moves += 1.0F;
    }
    if (v.stays + v.moves > kMostVotes) {
      v.stays *= 0.5F;
      v.moves *= 0.5F;
    }
  }
  for (std::size_t i = 0; i < stays.size(); ++i) votes_[i].keyframes += stays[i];
  decide();
}

void CoMovingCells::decide() {
  for (std::size_t i = 0; i < votes_.size(); ++i) {
    const Votes& v = votes_[i];
    if (found_[i] != 0 || v.stays < static_cast<float>(config_.majority) * v.moves) continue;
    // Beside what was found half of them will do: its edges have pixels of the world, too.
    const int needed = cells_.beside(i, found_) ? (config_.keyframes + 1) / 2 : config_.keyframes;
    if (v.keyframes < needed) continue;
    found_[i] = 1;
    ++num_found_;
  }
  fill_gaps();
}

/// A body has parts without texture: what it surrounds, or cuts off at the image's edge, is found,
/// too, where it has no more votes to have moved than to stay.
void CoMovingCells::fill_gaps() {
  bool filled = any();
  while (filled) {
    filled = false;
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (found_[i] != 0 || votes_[i].moves > votes_[i].stays) continue;
      if (cells_.num_around(i, found_) < kSurrounded) continue;
      found_[i] = 1;
      ++num_found_;
      filled = true;
    }
  }
  if (share() > kMostShare) clear();
}

void CoMovingCells::clear() {
  votes_.assign(votes_.size(), Votes());
  found_.assign(found_.size(), 0);
  num_found_ = 0;
}

void CoMovingCells::add(const ChosenCells& chosen) {
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (chosen[i] == 0 || found_[i] != 0) continue;
    found_[i] = 1;
    ++num_found_;
  }
  fill_gaps();
}

void CoMovingCells::compare(const ImageF& before, const ImageF& image, double rmse) {
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (found_[i] == 0) continue;
    const Likeness l = likeness(before, image, cells_.left(i), cells_.top(i), cells_.side);
    Votes& v = votes_[i];
    if (l.is_same()) v.changed = 0;
    if (l.is_different(rmse)) ++v.changed;
    if (v.changed < kChangesToGiveUp) continue;
    v = {.moves = 1.0F};
    found_[i] = 0;
    --num_found_;
  }
}

ImageU8 CoMovingCells::mask(const ImageU8& base) const {
  ImageU8 out = base;
  if (out.empty()) {
    out.resize(cells_.width, cells_.height);
    std::fill(out.data(), out.data() + out.size(), std::uint8_t{255});
  }
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (found_[i] == 0) continue;
    const int columns = std::min(cells_.side, cells_.width - cells_.left(i));
    const int bottom = std::min(cells_.top(i) + cells_.side, cells_.height);
    for (int y = cells_.top(i); y < bottom; ++y) {
      std::fill_n(out.row(y) + cells_.left(i), columns, std::uint8_t{0});
    }
  }
  return out;
}

}  // namespace sovo
