#include "sovo/eval/kitti_metric.h"

#include <algorithm>
#include <cmath>

namespace sovo {
namespace {

/// Distances in single precision, as the devkit sums them: at a borderline it decides which frame a
/// piece ends at.
std::vector<float> devkit_distances(std::span<const SE3> poses) {
  std::vector<float> distances(poses.size(), 0.0F);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Vec3 difference = poses[i - 1].translation() - poses[i].translation();
    const Eigen::Vector3f step = difference.cast<float>();
    const float squared = step.x() * step.x() + step.y() * step.y() + step.z() * step.z();
    const double length = std::sqrt(static_cast<double>(squared));
    distances[i] = static_cast<float>(static_cast<double>(distances[i - 1]) + length);
  }
  return distances;
}

/// The first frame farther than `length` beyond `first`, or -1.
int last_frame_of(std::span<const float> distances, int first, double length) {
  const auto begin = distances.begin() + first;
  const float end = distances[first] + static_cast<float>(length);
  const auto it = std::upper_bound(begin, distances.end(), end);
  return it == distances.end() ? -1 : static_cast<int>(it - distances.begin());
}

SegmentError segment_error(std::span<const SE3> truth, std::span<const SE3> estimate, int first,
                           int last, double length) {
  const SE3 true_motion = truth[first].inverse() * truth[last];
  const SE3 motion = estimate[first].inverse() * estimate[last];
  const SE3 error = motion.inverse() * true_motion;
  SegmentError out{first, last, length};
  out.translation = error.translation().norm() / length;
  out.rotation = error.rotation().log().norm() / length;
  const Vec3 moved = motion.translation();
  const Vec3 true_moved = true_motion.translation();
  // The rotation of E leaves lengths alone: |trans E| = |t_true - t_estimate|.
  if (moved.squaredNorm() > 0.0) out.best_scale = moved.dot(true_moved) / moved.squaredNorm();
  out.translation_best = (true_moved - out.best_scale * moved).norm() / length;
  return out;
}

}  // namespace

std::vector<double> kitti_lengths() { return {100, 200, 300, 400, 500, 600, 700, 800}; }

std::vector<double> travelled_distances(std::span<const SE3> poses) {
  std::vector<double> distances(poses.size(), 0.0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    const Vec3 step = poses[i].translation() - poses[i - 1].translation();
    distances[i] = distances[i - 1] + step.norm();
  }
  return distances;
}

std::vector<SegmentError> kitti_segments(std::span<const SE3> truth, std::span<const SE3> estimate,
                                         std::span<const double> lengths, int step) {
  const std::vector<float> distances = devkit_distances(truth);
  const int count = static_cast<int>(std::min(truth.size(), estimate.size()));
  std::vector<SegmentError> segments;
  for (int first = 0; first < count; first += std::max(1, step)) {
    for (const double length : lengths) {
      const int last = last_frame_of(distances, first, length);
      if (last < 0 || last >= count) continue;
      segments.push_back(segment_error(truth, estimate, first, last, length));
    }
  }
  return segments;
}

SegmentSummary summarize(std::span<const SegmentError> segments) {
  SegmentSummary sum;
  sum.count = static_cast<int>(segments.size());
  if (segments.empty()) return sum;
  for (const SegmentError& s : segments) {
    sum.translation_mean += s.translation;
    sum.translation_rms += s.translation * s.translation;
    sum.rotation_mean += s.rotation;
    sum.rotation_rms += s.rotation * s.rotation;
    sum.translation_best_mean += s.translation_best;
  }
  const double n = static_cast<double>(segments.size());
  sum.translation_mean /= n;
  sum.translation_rms = std::sqrt(sum.translation_rms / n);
  sum.rotation_mean /= n;
  sum.rotation_rms = std::sqrt(sum.rotation_rms / n);
  sum.translation_best_mean /= n;
  return sum;
}

std::vector<SegmentSummary> summarize_by_length(std::span<const SegmentError> segments,
                                                std::span<const double> lengths) {
  std::vector<SegmentSummary> out;
  for (const double length : lengths) {
    std::vector<SegmentError> of_length;
    std::copy_if(segments.begin(), segments.end(), std::back_inserter(of_length),
                 [&](const SegmentError& s) { return s.length == length; });
    if (of_length.empty()) continue;
    out.push_back(summarize(of_length));
    out.back().length = length;
  }
  return out;
}

}  // namespace sovo
