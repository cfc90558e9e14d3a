#include "sovo/loop/loop_closer.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/geometry/pose_covariance.h"
#include "sovo/image/halving.h"

namespace sovo {
namespace {

/// Where a segment ended nothing is known of the motion [m, rad].
constexpr double kLostMetres = 100.0;
constexpr double kLostRadians = 2.0;
/// What a step of the odometry and a loop err by at least, of the way or depth, and in angle [rad]:
/// what calibration and rolling shutters leave is in no covariance.
constexpr double kLeastStep = 1e-4;
constexpr double kLeastStepAngle = 1e-5;
constexpr double kLeastLoop = 1e-3;
constexpr double kLeastLoopAngle = 3e-4;
/// Squared error of 6 numbers that one in 10,000 right ones exceeds; covariances may be too small
/// by three times in each.
constexpr double kImpossible = 9.0 * 27.9;

Mat6 floor_of(double metres, double radians) {
  Vec6 variances;
  variances << Vec3::Constant(metres * metres), Vec3::Constant(radians * radians);
  return variances.asDiagonal();
}

/// The symmetric matrix without what is negative in it, which rounding and later estimates of the
/// scale leave in a difference of covariances.
Mat6 without_negative(const Mat6& covariance) {
  const SymmetricEigen eigen = symmetric_eigen(covariance);
  return eigen.vectors * eigen.values.cwiseMax(0.0).asDiagonal() * eigen.vectors.transpose();
}

Mat6 inverse_of(const Mat6& covariance) {
  return solve_symmetric_columns(covariance, MatX::Identity(6, 6));
}

/// Covariance of e where the true motion between two places of a segment is exp(e) T_a_b.
Mat6 odometry_covariance(const Place& a, const Place& b) {
  const Vec3 step = b.T_odom_left.translation() - a.T_odom_left.translation();
  const Mat6 grown = carried(b.covariance, -step) - a.covariance;
  return without_negative(rotated(a.T_odom_left.rotation().inverse(), grown)) +
         floor_of(kLeastStep * step.norm(), kLeastStepAngle);
}

double squared_error(const Vec6& e, const Mat6& covariance) {
  return e.dot(VecX(solve_symmetric(covariance, e)));
}

double median_of(std::vector<float> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double angle_between(const SE3& a, const SE3& b) {
  return (a.rotation().inverse() * b.rotation()).log().norm();
}

}  // namespace

LoopCloser::LoopCloser(const LoopConfig& config, const StaticMatcherConfig& matcher,
                       const StereoRig& rig, ImageU8 mask)
    : config_(config), matcher_config_(matcher), rig_(rig), mask_(std::move(mask)) {}

const ImageU8& LoopCloser::mask(int halvings) {
  const auto found = masks_.find(halvings);
  if (found != masks_.end()) return found->second;
  return masks_.emplace(halvings, reduced_mask(mask_, 1 << halvings)).first->second;
}

bool LoopCloser::is_place(const KeyframeOutput& keyframe) const {
  if (!keyframe.scale_valid || !keyframe.left || !keyframe.right) return false;
  if (nodes_.empty() || nodes_.back().place.segment != keyframe.segment) return true;
  const Place& last = nodes_.back().place;
  const double way = (keyframe.T_odom_left.translation() - last.T_odom_left.translation()).norm();
  return way > config_.place_step * last.median_depth ||
         angle_between(last.T_odom_left, keyframe.T_odom_left) >
             config_.place_turn_deg * std::numbers::pi / 180.0;
}

LoopCloser::Node LoopCloser::make_node(const KeyframeOutput& keyframe) {
  Node made;
  Place& place = made.place;
  place.segment = keyframe.segment;
  place.keyframe_id = keyframe.id;
  place.stamp_ns = keyframe.stamp_ns;
  place.T_odom_left = keyframe.T_odom_left;
  place.covariance = keyframe.covariance;
  const double rho = median_of(keyframe.inverse_depth);
  place.median_depth = rho > 0.0 ? 1.0 / rho : 1.0;
  StereoView view{keyframe.left, keyframe.right, keyframe.T_later_left, keyframe.halvings,
                  mask(keyframe.halvings)};
  if (keyframe.co_moving_mask) view.mask = both_masks(view.mask, *keyframe.co_moving_mask);
  place.landmarks = find_landmarks(view, matcher_config_, rig_, config_.keypoints);
  made.T_map_left = T_map_odom() * place.T_odom_left;
  return made;
}

std::optional<LoopClosure> LoopCloser::add(const KeyframeOutput& keyframe) {
  if (keyframe.revised) {
    revise(keyframe);
    return std::nullopt;
  }
  if (!is_place(keyframe)) return std::nullopt;
  const std::uint32_t number = end();
  nodes_.push_back(make_node(keyframe));
  numbers_[{keyframe.segment, keyframe.id}] = number;
  ++counts_.places;
  find_loops(number);
  index_.add(number, node(number).place.landmarks);
  auto closure = close(number);
  if (nodes_.size() > static_cast<std::size_t>(std::max(2, config_.max_places))) forget_oldest();
  return closure;
}

void LoopCloser::revise(const KeyframeOutput& keyframe) {
  const auto found = numbers_.find({keyframe.segment, keyframe.id});
  if (found == numbers_.end()) return;
  node(found->second).T_odom_refined = keyframe.T_odom_left;
  revised_ = true;
}

/// Of the places before `end` the one whose camera was nearest and looked the same way, in `map`.
std::optional<std::uint32_t> LoopCloser::nearest_place(const Node& from, std::uint32_t end) const {
  constexpr double kReach = 0.7;  // of the depth; farther away little of it is seen again
  constexpr double kMostTurned = 0.6;
  const Vec3 axis = from.T_map_left.rotation() * Vec3::UnitZ();
  double nearest = kReach * from.place.median_depth;
  std::optional<std::uint32_t> found;
  for (std::uint32_t i = first_; i < end; ++i) {
    const SE3& T_map_left = node(i).T_map_left;
    const double distance = (T_map_left.translation() - from.T_map_left.translation()).norm();
    if (distance >= nearest) continue;
    const Vec3 other_axis = T_map_left.rotation() * Vec3::UnitZ();
    if (other_axis.dot(axis) < std::cos(kMostTurned)) continue;
    nearest = distance;
    found = i;
  }
  return found;
}

/// Those that look alike, and the one that should.
std::vector<std::uint32_t> LoopCloser::candidates(std::uint32_t newer) const {
  const auto gap = static_cast<std::uint32_t>(config_.min_gap);
  if (newer - first_ <= gap) return {};
  const Place& place = node(newer).place;
  std::vector<std::uint32_t> found;
  if (const auto nearest = nearest_place(node(newer), newer - gap)) found.push_back(*nearest);
  for (const PlaceIndex::Votes& votes : index_.find(place.landmarks, newer - gap, config_.min_votes,
                                                    config_.max_candidates, config_.min_gap)) {
    if (std::find(found.begin(), found.end(), votes.place) == found.end()) {
      found.push_back(votes.place);
    }
  }
  return found;
}

void LoopCloser::find_loops(std::uint32_t newer) {
  const Place& place = node(newer).place;
  for (const std::uint32_t older : candidates(newer)) {
    const auto match = match_places(rig_.left, node(older).place, place, config_.matching);
    if (!match) continue;
    ++counts_.matched;
    Loop loop{older, newer, *match};
    loop.match.covariance += floor_of(kLeastLoop * node(older).place.median_depth, kLeastLoopAngle);
    if (is_possible(loop)) {
      loops_.push_back(loop);
    } else {
      ++counts_.refused;
    }
  }
}

/// Whether the odometry's covariance allows the loop.
bool LoopCloser::is_possible(const Loop& loop) const {
  const Place& a = node(loop.older).place;
  const Place& b = node(loop.newer).place;
  // Things look alike: parked cars, tiles. Only a whole view is one of a kind.
  if (a.segment != b.segment) return loop.match.support >= config_.lost_support;
  const Vec6 e = (a.T_odom_left.inverse() * b.T_odom_left * loop.match.T_a_b.inverse()).log();
  return squared_error(e, odometry_covariance(a, b) + loop.match.covariance) < kImpossible;
}

/// Whether two loops of the same segments say the same: from one older place by one loop to the
/// newer one, on to the other newer one, and back by the other loop.
bool LoopCloser::agree(const Loop& a, const Loop& b) const {
  const Place& old_a = node(a.older).place;
  const Place& old_b = node(b.older).place;
  const Place& new_a = node(a.newer).place;
  const Place& new_b = node(b.newer).place;
  if (old_a.segment != old_b.segment || new_a.segment != new_b.segment) return false;
  const SE3 T_old = old_a.T_odom_left.inverse() * old_b.T_odom_left;
  const SE3 T_new = new_a.T_odom_left.inverse() * new_b.T_odom_left;
  const SE3 around = a.match.T_a_b * T_new * b.match.T_a_b.inverse() * T_old.inverse();
  const auto between = [](const Place& p, const Place& q) {
    return p.stamp_ns <= q.stamp_ns ? odometry_covariance(p, q) : odometry_covariance(q, p);
  };
  // All in the axes of a's older place; the four are near each other.
  const Mat6 covariance =
      a.match.covariance + T_old.adjoint() * b.match.covariance * T_old.adjoint().transpose() +
      between(old_a, old_b) +
      a.match.T_a_b.adjoint() * between(new_a, new_b) * a.match.T_a_b.adjoint().transpose();
  return squared_error(around.log(), covariance) < kImpossible;
}

std::optional<LoopClosure> LoopCloser::close(std::uint32_t newer) {
  constexpr std::uint32_t kNear = 10;  // places from one loop to one that confirms it
  std::erase_if(loops_,
                [&](const Loop& loop) { return !loop.closed && newer - loop.newer > kNear; });
  const SE3 before = node(newer).T_map_left;
  const Loop* closing = nullptr;
  for (Loop& loop : loops_) {
    if (loop.newer != newer) continue;
    for (Loop& other : loops_) {
      if (&other == &loop || other.newer == newer || newer - other.newer > kNear) continue;
      if (!agree(other, loop)) continue;
      for (Loop* one : {&other, &loop}) {
        if (!one->closed) bring_segment_home(*one);
        if (std::exchange(one->closed, true)) continue;
        ++counts_.closures;
        ++new_loops_;
      }
      if (closing == nullptr || loop.match.inliers > closing->match.inliers) closing = &loop;
    }
  }
  if (closing == nullptr) return std::nullopt;
  LoopClosure closure;
  closure.older_stamp_ns = node(closing->older).place.stamp_ns;
  closure.newer_stamp_ns = node(closing->newer).place.stamp_ns;
  closure.T_older_newer = closing->match.T_a_b;
  closure.inliers = closing->match.inliers;
  // In a long graph one more loop changes little, and costs much.
  constexpr std::size_t kPlacesALoop = 200;
  if (new_loops_ * kPlacesALoop >= nodes_.size()) optimize();
  closure.moved_m = (node(newer).T_map_left.translation() - before.translation()).norm();
  return closure;
}

/// A segment that nothing else connects is moved as a whole to where its first loop has it: the
/// graph is not to find its way there from anywhere.
void LoopCloser::bring_segment_home(const Loop& loop) {
  const std::uint32_t segment = node(loop.newer).place.segment;
  const auto connects = [&](const Loop& other) {
    return other.closed && node(other.newer).place.segment >= segment &&
           node(other.older).place.segment < segment;
  };
  if (node(loop.older).place.segment == segment ||
      std::any_of(loops_.begin(), loops_.end(), connects)) {
    return;
  }
  const SE3 T_map_left = node(loop.older).T_map_left * loop.match.T_a_b;
  const SE3 correction = T_map_left * node(loop.newer).T_map_left.inverse();
  for (Node& n : nodes_) {
    if (n.place.segment >= segment) n.T_map_left = correction * n.T_map_left;
  }
}

/// The odometry's step from a place to the next one; where one segment ends and another begins,
/// hardly anything is known.
GraphEdge LoopCloser::step_edge(std::uint32_t from) const {
  const Node& a = node(from);
  const Node& b = node(from + 1);
  const bool refined = a.T_odom_refined && b.T_odom_refined;
  GraphEdge edge;
  edge.i = from - first_;
  edge.j = edge.i + 1;
  edge.T_i_j = refined ? a.T_odom_refined->inverse() * *b.T_odom_refined
                       : a.place.T_odom_left.inverse() * b.place.T_odom_left;
  edge.information =
      inverse_of(a.place.segment == b.place.segment ? odometry_covariance(a.place, b.place)
                                                    : floor_of(kLostMetres, kLostRadians));
  return edge;
}

void LoopCloser::optimize() {
  std::vector<GraphEdge> edges;
  for (std::uint32_t i = first_; i + 1 < end(); ++i) edges.push_back(step_edge(i));
  for (const Loop& loop : loops_) {
    if (!loop.closed) continue;
    edges.push_back({loop.older - first_, loop.newer - first_, loop.match.T_a_b,
                     inverse_of(loop.match.covariance), true});
  }
  std::vector<SE3> poses;
  for (const Node& n : nodes_) poses.push_back(n.T_map_left);
  optimize_graph(edges, &poses);
  for (std::size_t i = 0; i < poses.size(); ++i) nodes_[i].T_map_left = poses[i];
  revised_ = false;
  new_loops_ = 0;
}

void LoopCloser::forget_oldest() {
  constexpr std::size_t kAtOnce = 10;  // of a hundred: a bucket is cleaned as a whole
  const std::size_t count = std::max<std::size_t>(1, nodes_.size() * kAtOnce / 100);
  for (std::size_t i = 0; i < count; ++i) {
    numbers_.erase({nodes_[i].place.segment, nodes_[i].place.keyframe_id});
  }
  nodes_.erase(nodes_.begin(), nodes_.begin() + static_cast<std::ptrdiff_t>(count));
  first_ += static_cast<std::uint32_t>(count);
  index_.forget_before(first_);
  std::erase_if(loops_, [this](const Loop& loop) { return loop.older < first_; });
}

void LoopCloser::finish() {
  if ((revised_ || new_loops_ > 0) && counts_.closures > 0) optimize();
}

SE3 LoopCloser::T_map_odom() const {
  if (nodes_.empty() || counts_.closures == 0) return {};
  return nodes_.back().T_map_left * nodes_.back().place.T_odom_left.inverse();
}

std::vector<TrajectoryPose> LoopCloser::corrected_places() const {
  std::vector<TrajectoryPose> poses;
  for (const Node& n : nodes_) poses.push_back({n.place.stamp_ns, n.T_map_left});
  return poses;
}

std::vector<TrajectoryPose> LoopCloser::corrected(std::vector<TrajectoryPose> trajectory) const {
  if (counts_.closures == 0) return trajectory;
  // Places that are frames of the trajectory, with their poses there.
  struct Pin {
    const Node* node;
    SE3 T_left_odom;
  };
  std::vector<Pin> pins;
  std::map<std::int64_t, SE3> poses;
  for (const TrajectoryPose& p : trajectory) poses[p.stamp_ns] = p.T_odom_left;
  for (const Node& n : nodes_) {
    const auto found = poses.find(n.place.stamp_ns);
    if (found != poses.end()) pins.push_back({&n, found->second.inverse()});
  }
  if (pins.empty()) return trajectory;
  const auto seen_from = [](const Pin& pin, const SE3& T_odom_left) {
    return pin.node->T_map_left * (pin.T_left_odom * T_odom_left);
  };
  for (TrajectoryPose& p : trajectory) {
    const auto after = std::upper_bound(
        pins.begin(), pins.end(), p.stamp_ns,
        [](std::int64_t stamp, const Pin& pin) { return stamp < pin.node->place.stamp_ns; });
    const Pin& last = after == pins.begin() ? *after : *std::prev(after);
    const SE3 by_last = seen_from(last, p.T_odom_left);
    const bool between = after != pins.begin() && after != pins.end() &&
                         after->node->place.segment == last.node->place.segment;
    if (!between) {
      p.T_odom_left = by_last;
      continue;
    }
    const Place& begin = last.node->place;
    const auto span = static_cast<double>(after->node->place.stamp_ns - begin.stamp_ns);
    const double share = static_cast<double>(p.stamp_ns - begin.stamp_ns) / span;
    const SE3 difference = by_last.inverse() * seen_from(*after, p.T_odom_left);
    p.T_odom_left = by_last * SE3::exp(share * difference.log());
  }
  return trajectory;
}

}  // namespace sovo
