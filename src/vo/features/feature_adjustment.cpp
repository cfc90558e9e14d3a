#include "sovo/vo/features/feature_adjustment.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/geometry/linear_solvers.h"
#include "sovo/vo/features/reprojection.h"
#include "sovo/vo/features/residual_spread.h"

namespace sovo {

namespace {

constexpr double kHuber = 2.0;               ///< Of residuals in their standard deviations.
constexpr double kLeastInverseDepth = 1e-4;  ///< Of the mean.
/// Residuals of a landmark share the pixels of its host.
constexpr double kSharedHost = 4.0;

struct HuberTerm {
  double energy;
  double weight;
};

HuberTerm huber(double e) {
  if (e <= kHuber) return {0.5 * e * e, 1.0};
  return {kHuber * (e - 0.5 * kHuber), kHuber / e};
}

/// T_target_host of all pairs of a window's keyframes, which many landmarks share.
class PairPoses {
 public:
  explicit PairPoses(const FeatureWindow& window) : n_(window.keyframes.size()) {
    for (const FeatureKeyframe& target : window.keyframes) {
      for (const FeatureKeyframe& host : window.keyframes) {
        T_target_host_.push_back(target.T_camera_world * host.T_camera_world.inverse());
      }
    }
  }
  const SE3& operator()(std::size_t target, std::size_t host) const {
    return T_target_host_[target * n_ + host];
  }

 private:
  std::size_t n_;
  std::vector<SE3> T_target_host_;
};

/// Calls `f(landmark index, landmark, observation)` for every one that takes part.
template <class Window, class F>
void for_each_inlier(Window& window, const F& f) {
  for (std::size_t i = 0; i < window.landmarks.size(); ++i) {
    auto& landmark = window.landmarks[i];
    if (!landmark.has_depth) continue;
    for (auto& o : landmark.observations) {
      if (o.inlier) f(i, landmark, o);
    }
  }
}

void note_touched(Eigen::Index row, std::vector<Eigen::Index>* touched) {
  if (std::find(touched->begin(), touched->end(), row) == touched->end()) touched->push_back(row);
}

/// What eliminating the inverse depths leaves: H - w (H_rho + D)^-1 w^T of each, and the same of b.
void eliminate_depths(const FeatureAdjuster::System& s, MatX* H, VecX* b) {
  *H = s.H;
  *b = s.b;
  for (std::size_t i = 0; i < s.H_rho.size(); ++i) {
    const double h = s.H_rho[i] + s.damping[i];
    if (!(h > 0.0)) continue;
    const auto w = s.H_rho_frame.col(static_cast<Eigen::Index>(i));
    for (const Eigen::Index row : s.touched[i]) {
      const Vec6 scaled = w.segment<6>(row) / h;
      b->segment<6>(row) -= s.b_rho[i] * scaled;
      for (const Eigen::Index column : s.touched[i]) {
        H->block<6, 6>(row, column) -= scaled * w.segment<6>(column).transpose();
      }
    }
  }
}

}  // namespace

std::size_t FeatureAdjuster::first_free(const FeatureWindow& window) const {
  const auto free = static_cast<std::size_t>(std::max(1, config_.free_keyframes));
  const std::size_t n = window.keyframes.size();
  if (n > free + 1) return n - free;
  return n > 2 ? 2 : 1;
}

double FeatureAdjuster::damping_of(const FeatureLandmark& landmark, double mean_rho) const {
  double damping = config_.depth_damping / (mean_rho * mean_rho);
  if (landmark.static_sigma > 0.0 && landmark.parallax < config_.min_parallax) {
    damping += 1.0 / (landmark.static_sigma * landmark.static_sigma);
  }
  return damping;
}

FeatureAdjuster::System FeatureAdjuster::linearize(const FeatureWindow& window) const {
  const std::size_t first = first_free(window);
  const auto size = static_cast<Eigen::Index>(6 * (window.keyframes.size() - first));
  const double mean_rho = window.mean_inverse_depth();
  System s;
  s.H = MatX::Zero(size, size);
  s.b = VecX::Zero(size);
  s.H_rho.assign(window.landmarks.size(), 0.0);
  s.b_rho.assign(window.landmarks.size(), 0.0);
  s.touched.resize(window.landmarks.size());
  s.H_rho_frame = MatX::Zero(size, static_cast<Eigen::Index>(window.landmarks.size()));
  const PairPoses pairs(window);
  for (const FeatureLandmark& l : window.landmarks) s.damping.push_back(damping_of(l, mean_rho));
  for_each_inlier(window, [&](std::size_t i, const FeatureLandmark& l, const Observation& o) {
    Reprojection p;
    const std::size_t target = window.index_of(o.keyframe_id);
    const std::size_t host = window.index_of(l.host_id);
    if (!reproject(window.camera, pairs(target, host), l.ray, l.rho, &p)) return;
    const Vec2 r = o.pixel - p.pixel;
    const HuberTerm term = huber(r.norm() / o.sigma);
    const double w = term.weight / (o.sigma * o.sigma);
    s.energy += term.energy;
    s.H_rho[i] += w * p.d_rho.squaredNorm();
    s.b_rho[i] += w * p.d_rho.dot(r);
    const auto column = static_cast<Eigen::Index>(i);
    const auto row = [&](std::size_t k) { return static_cast<Eigen::Index>(6 * (k - first)); };
    if (target >= first) {
      s.H.block<6, 6>(row(target), row(target)) += w * p.d_target.transpose() * p.d_target;
      s.b.segment<6>(row(target)) += w * p.d_target.transpose() * r;
      s.H_rho_frame.block<6, 1>(row(target), column) += w * p.d_target.transpose() * p.d_rho;
      note_touched(row(target), &s.touched[i]);
    }
    if (host >= first) {
      s.H.block<6, 6>(row(host), row(host)) += w * p.d_host.transpose() * p.d_host;
      s.b.segment<6>(row(host)) += w * p.d_host.transpose() * r;
      s.H_rho_frame.block<6, 1>(row(host), column) += w * p.d_host.transpose() * p.d_rho;
      note_touched(row(host), &s.touched[i]);
    }
    if (target >= first && host >= first) {
      const Mat6 cross = w * p.d_target.transpose() * p.d_host;
      s.H.block<6, 6>(row(target), row(host)) += cross;
      s.H.block<6, 6>(row(host), row(target)) += cross.transpose();
    }
  });
  return s;
}

double FeatureAdjuster::energy_of(const FeatureWindow& window) const {
  double energy = 0.0;
  const PairPoses pairs(window);
  for_each_inlier(window, [&](std::size_t, const FeatureLandmark& l, const Observation& o) {
    Vec2 pixel;
    // What would come to lie behind the camera has gone too far.
    constexpr double kBehind = 1e6;
    const bool visible =
        reproject(window.camera, pairs(window.index_of(o.keyframe_id), window.index_of(l.host_id)),
                  l.ray, l.rho, &pixel);
    energy += visible ? huber((o.pixel - pixel).norm() / o.sigma).energy : kBehind;
  });
  return energy;
}

void FeatureAdjuster::take_step(const VecX& frames, const VecX& depths,
                                FeatureWindow* window) const {
  const std::size_t first = first_free(*window);
  const double least = kLeastInverseDepth * window->mean_inverse_depth();
  for (std::size_t k = first; k < window->keyframes.size(); ++k) {
    const Vec6 x = frames.segment<6>(static_cast<Eigen::Index>(6 * (k - first)));
    SE3& T = window->keyframes[k].T_camera_world;
    T = SE3::exp(x) * T;
  }
  for (std::size_t i = 0; i < window->landmarks.size(); ++i) {
    FeatureLandmark& l = window->landmarks[i];
    if (l.has_depth) l.rho = std::max(least, l.rho + depths[static_cast<Eigen::Index>(i)]);
  }
}

/// Marks what does not fit; returns the residuals' spread over what is expected.
double FeatureAdjuster::mark_outliers(FeatureWindow* window) const {
  std::vector<double> errors;
  std::vector<Observation*> observations;
  for (FeatureLandmark& l : window->landmarks) {
    if (!l.has_depth) continue;
    for (Observation& o : l.observations) {
      Vec2 pixel;
      const bool visible = reproject(
          window->camera, window->T_target_host(o.keyframe_id, l.host_id), l.ray, l.rho, &pixel);
      errors.push_back(visible ? (o.pixel - pixel).norm() / o.sigma
                               : std::numeric_limits<double>::infinity());
      observations.push_back(&o);
    }
  }
  const double spread = residual_spread(errors);
  for (std::size_t i = 0; i < errors.size(); ++i) {
    observations[i]->inlier = errors[i] < config_.outlier_sigmas * spread_for_outliers(spread);
  }
  return spread;
}

/// What the observations tell of each depth, all poses held, and how far it moves them.
void FeatureAdjuster::measure_landmarks(FeatureWindow* window) const {
  for (FeatureLandmark& l : window->landmarks) l.information = l.parallax = 0.0;
  for_each_inlier(*window, [&](std::size_t, FeatureLandmark& l, const Observation& o) {
    Reprojection p;
    if (!reproject(window->camera, window->T_target_host(o.keyframe_id, l.host_id), l.ray, l.rho,
                   &p)) {
      return;
    }
    l.information += p.d_rho.squaredNorm() / (o.sigma * o.sigma);
    l.parallax = std::max(l.parallax, l.rho * p.d_rho.norm());
  });
}

/// Of the newest keyframe as seen from the one before, which is held like those that bundle
/// adjustment holds; for residuals of unit spread.
Mat6 FeatureAdjuster::newest_covariance(const FeatureWindow& window) const {
  const System s = linearize(window);
  MatX H;
  VecX b;
  eliminate_depths(s, &H, &b);
  const Eigen::Index n = H.rows();
  if (n >= 12) {
    H.middleRows(n - 12, 6).setZero();
    H.middleCols(n - 12, 6).setZero();
    H.diagonal().segment(n - 12, 6).setOnes();
  }
  H.diagonal().array() += 1e-9 * H.diagonal().maxCoeff();
  MatX newest = MatX::Zero(n, 6);
  newest.bottomRows(6).setIdentity();
  const Mat6 covariance = solve_symmetric_columns(H, newest).bottomRows(6);
  return 0.5 * (covariance + covariance.transpose());
}

BundleResult FeatureAdjuster::optimize(FeatureWindow* window) {
  BundleResult result;
  double lambda = 1e-4;
  double energy = energy_of(*window);
  for (int i = 0; i < config_.max_iterations_window; ++i) {
    const System s = linearize(*window);
    MatX H;
    VecX b;
    eliminate_depths(s, &H, &b);
    H.diagonal() *= 1.0 + lambda;
    const VecX frames = solve_symmetric(H, b);
    const VecX coupled = s.H_rho_frame.transpose() * frames;
    VecX depths(coupled.size());
    for (Eigen::Index k = 0; k < coupled.size(); ++k) {
      const auto l = static_cast<std::size_t>(k);
      const double h = s.H_rho[l] + s.damping[l];
      depths[k] = h > 0.0 ? (s.b_rho[l] - coupled[k]) / h : 0.0;  // what nothing tells of stays
    }
    result.finite = frames.allFinite() && depths.allFinite();
    if (!result.finite) return result;
    ++result.iterations;
    const auto keyframes_before = window->keyframes;
    std::vector<double> rho_before;
    for (const FeatureLandmark& l : window->landmarks) rho_before.push_back(l.rho);
    take_step(frames, depths, window);
    const double after = energy_of(*window);
    if (!(after <= energy)) {
      window->keyframes = keyframes_before;
      for (std::size_t k = 0; k < rho_before.size(); ++k) window->landmarks[k].rho = rho_before[k];
      lambda *= 100.0;
      continue;
    }
    constexpr double kConverged = 1e-4;
    const bool converged = energy - after < kConverged * energy;
    energy = after;
    lambda *= 0.1;
    if (converged) break;
  }
  const double spread = mark_outliers(window);
  measure_landmarks(window);
  double sum = 0.0;
  for_each_inlier(*window, [&](std::size_t, const FeatureLandmark& l, const Observation& o) {
    Vec2 pixel;
    if (!reproject(window->camera, window->T_target_host(o.keyframe_id, l.host_id), l.ray, l.rho,
                   &pixel)) {
      return;
    }
    sum += (o.pixel - pixel).squaredNorm();
    ++result.residuals;
  });
  result.points = window->num_with_depth();
  result.rmse = result.residuals > 0 ? std::sqrt(sum / result.residuals) : 0.0;
  result.newest_covariance =
      kSharedHost * std::pow(spread_for_covariance(spread), 2) * newest_covariance(*window);
  return result;
}

}  // namespace sovo
