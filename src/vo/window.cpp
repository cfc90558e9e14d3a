#include "sovo/vo/window.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "sovo/vo/plain_product.h"

namespace sovo {

void Keyframe::set_x(const Vec8& value) {
  x = value;
  T_camera_world = SE3::exp(x.head<6>()) * frozen_T_camera_world;
  affine.a = frozen_affine.a + x[6];
  affine.b = frozen_affine.b + x[7];
}

void Keyframe::freeze() {
  frozen_T_camera_world = T_camera_world;
  frozen_affine = affine;
  x.setZero();
}

Keyframe& Window::insert(std::unique_ptr<Keyframe> keyframe) {
  std::array<bool, kMaxSlots> used{};
  for (const auto& k : keyframes_) used[static_cast<std::size_t>(k->slot)] = true;
  keyframe->slot = static_cast<int>(std::find(used.begin(), used.end(), false) - used.begin());
  keyframes_.push_back(std::move(keyframe));
  renumber();

  const int old = static_cast<int>(prior_.b.size());
  MatX H = MatX::Zero(old + 8, old + 8);
  VecX b = VecX::Zero(old + 8);
  H.topLeftCorner(old, old) = prior_.H;
  b.head(old) = prior_.b;
  prior_ = {std::move(H), std::move(b)};
  return *keyframes_.back();
}

void Window::erase(int index) {
  const auto slot = static_cast<std::size_t>(keyframes_[static_cast<std::size_t>(index)]->slot);
  keyframes_.erase(keyframes_.begin() + index);
  for (auto& k : keyframes_) {
    for (Point& p : k->points) p.residuals[slot] = Residual();
  }
  renumber();
}

void Window::renumber() {
  slot_index_.fill(-1);
  for (int i = 0; i < size(); ++i) slot_index_[static_cast<std::size_t>((*this)[i].slot)] = i;
}

void Window::clear() {
  keyframes_.clear();
  prior_ = Prior();
  static_scale_ = 1.0;
  scale_held_ = false;
  keyframes_without_statics_ = 0;
  renumber();
}

void Window::set_rig(const StereoRig& rig, StaticScale scale) {
  rig_ = rig;
  static_scale_free_ = scale == StaticScale::kFree;
  if (!static_scale_free_) static_scale_ = 1.0;
}

void Window::update_scale_held() {
  constexpr std::ptrdiff_t kFewest = 50;
  constexpr int kForgotten = 20;  // keyframes, three times a window's
  std::ptrdiff_t residuals = 0;
  for (const auto& k : keyframes_) {
    if (static_scale_free_) break;
    residuals += std::count_if(k->points.begin(), k->points.end(),
                               [](const Point& p) { return p.static_state == ResidualState::kIn; });
  }
  keyframes_without_statics_ = residuals > 0 ? 0 : keyframes_without_statics_ + 1;
  if (residuals >= kFewest) scale_held_ = true;
  if (keyframes_without_statics_ >= kForgotten) scale_held_ = false;
}

int Window::index_of(std::uint32_t id) const {
  for (int i = 0; i < size(); ++i) {
    if ((*this)[i].id == id) return i;
  }
  return -1;
}

void Window::update_geometry() {
  const Eigen::Matrix3f K = camera_.matrix().cast<float>();
  const Mat3 K_inverse = camera_.matrix().inverse();
  for (int h = 0; h < size(); ++h) {
    for (int t = 0; t < size(); ++t) {
      if (h == t) continue;
      const Keyframe& host = (*this)[h];
      const Keyframe& target = (*this)[t];
      PairGeometry& g = pairs_[static_cast<std::size_t>(h * kMaxSlots + t)];
      const SE3 T = target.T_camera_world * host.T_camera_world.inverse();
      g.RKi = (T.rotation_matrix() * K_inverse).cast<float>();
      g.t = T.translation().cast<float>();
      g.KRKi = plain_product(K, g.RKi);
      g.Kt = plain_product(K, g.t);
      g.distance = T.translation().norm();

      const SE3 T0 = target.frozen_T_camera_world * host.frozen_T_camera_world.inverse();
      g.frozen_RKi = (T0.rotation_matrix() * K_inverse).cast<float>();
      g.frozen_t = T0.translation().cast<float>();

      g.shift = PairViewShift(T0, host.shift, target.shift);

      const BrightnessTransfer now =
          brightness_transfer(host.affine, host.exposure_s, target.affine, target.exposure_s);
      const BrightnessTransfer frozen = brightness_transfer(
          host.frozen_affine, host.exposure_s, target.frozen_affine, target.exposure_s);
      g.gain = static_cast<float>(now.gain);
      g.bias = static_cast<float>(now.bias);
      g.frozen_gain = static_cast<float>(frozen.gain);
      g.frozen_host_b = static_cast<float>(host.frozen_affine.b);

      // exp(x_t) T0 exp(-x_h) = exp(x_t - Ad_T0 x_h + ...) T0; log-gain a_t - a_h; bias
      // b_t - gain * b_h.
      g.adjoint_host.setZero();
      g.adjoint_host.topLeftCorner<6, 6>() = -T0.adjoint();
      g.adjoint_host(6, 6) = -1.0;
      g.adjoint_host(7, 7) = -frozen.gain;
    }
  }
  update_blurred();
}

void Window::set_exposures(double unknown_s, double nearest) {
  for (auto& k : keyframes_) {
    k->exposed.setZero();
    const double seconds = k->exposure_s > 0.0 ? k->exposure_s : unknown_s;
    if (k->velocity) k->exposed = (seconds * *k->velocity).cast<float>();
    k->longest_streak = longest_streak(camera_, k->exposed, nearest);
  }
  update_blurred();
}

void Window::update_blurred() {
  for (int h = 0; h < size(); ++h) {
    for (int t = 0; t < size(); ++t) {
      const Keyframe& host = (*this)[h];
      const Keyframe& target = (*this)[t];
      const double longest = std::max(host.longest_streak, target.longest_streak);
      pairs_[static_cast<std::size_t>(h * kMaxSlots + t)].blurred =
          host.velocity && target.velocity && longest >= static_cast<double>(kVisibleStreak);
    }
  }
}

VecX Window::stacked_x() const {
  VecX x(8 * size());
  for (int i = 0; i < size(); ++i) x.segment<8>(8 * i) = (*this)[i].x;
  return x;
}

int Window::num_active_points() const {
  int n = 0;
  for (const auto& k : keyframes_) n += static_cast<int>(k->points.size());
  return n;
}

double Window::mean_inverse_depth() const {
  std::vector<double> rhos;
  rhos.reserve(static_cast<std::size_t>(num_active_points()));
  for (const auto& k : keyframes_) {
    for (const Point& p : k->points) rhos.push_back(p.rho);
  }
  if (rhos.empty()) return 1.0;
  const auto middle = rhos.begin() + static_cast<std::ptrdiff_t>(rhos.size() / 2);
  std::nth_element(rhos.begin(), middle, rhos.end());
  // Thresholds hang on it: a few points that have gone astray must not move them.
  constexpr double kMostMedians = 5.0;
  const double most = kMostMedians * std::max(*middle, 0.0);
  double sum = 0.0;
  for (const double rho : rhos) sum += std::min(rho, most);
  return sum > 0.0 ? sum / static_cast<double>(rhos.size()) : 1.0;
}

Point point_of(const ImmaturePoint& immature) {
  Point p;
  p.u = immature.u;
  p.v = immature.v;
  p.type = immature.type;
  p.colour = immature.colour;
  p.weight = immature.weight;
  p.blur = immature.blur;
  return p;
}

double depth_information(const Point& point, double rho_unit) {
  if (point.hessian * rho_unit * rho_unit >= kMinRelativeInformation) return point.hessian;
  return std::max(point.hessian, static_cast<double>(point.static_information));
}

void Window::apply_similarity(double scale) {
  const Vec3 centre = newest().T_world_camera().translation();
  Vec8 s;
  s << scale, scale, scale, 1, 1, 1, 1, 1;
  const auto rho_scale = static_cast<float>(1.0 / scale);
  if (static_scale_free_) rescale_statics(scale);
  for (auto& k : keyframes_) {
    SE3& T0 = k->frozen_T_camera_world;
    T0.translation() = scale * T0.translation() - (1.0 - scale) * (T0.rotation() * centre);
    k->set_x(s.asDiagonal() * k->x);
    k->shift.per_row *= scale;
    if (k->velocity) k->velocity->head<3>() *= scale;
    k->exposed.head<3>() *= static_cast<float>(scale);
    for (Point& p : k->points) {
      p.rho /= scale;
      p.hessian *= scale * scale;
      p.static_information *= static_cast<float>(scale * scale);
      p.gradient *= scale;
      for (Residual& r : p.residuals) r.centre_rho *= rho_scale;
    }
    for (ImmaturePoint& p : k->immature) {
      p.rho_min *= rho_scale;
      p.rho_max *= rho_scale;
      p.static_information *= static_cast<float>(scale * scale);
    }
  }
  for (int i = 0; i < size(); ++i) {
    prior_.H.middleRows<3>(8 * i) /= scale;
    prior_.H.middleCols<3>(8 * i) /= scale;
    prior_.b.segment<3>(8 * i) /= scale;
  }
  update_geometry();
}

std::vector<SE3> Window::poses() const {
  std::vector<SE3> out;
  out.reserve(keyframes_.size());
  for (const auto& k : keyframes_) out.push_back(k->T_world_camera());
  return out;
}

int Window::steadiest(const std::vector<SE3>& T_world_camera) const {
  const std::vector<SE3> now = poses();
  const std::size_t older = std::max<std::size_t>(now.size(), 1) - 1;
  std::size_t out = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t held = 0; held < older; ++held) {
    const SE3 move = T_world_camera[held] * now[held].inverse();
    double moved = 0.0;
    for (std::size_t i = 0; i < older; ++i) {
      const Vec3 way = (move * now[i]).translation() - T_world_camera[i].translation();
      moved += std::sqrt(way.norm());  // one that went far is one that moved, no more
    }
    if (moved >= least) continue;
    least = moved;
    out = held;
  }
  return static_cast<int>(out);
}

int Window::steadiest_place(const std::vector<SE3>& T_world_camera,
                            const std::vector<double>& weights) const {
  const auto way = [&](std::size_t i) -> Vec3 {
    return (*this)[static_cast<int>(i)].T_world_camera().translation() -
           T_world_camera[i].translation();
  };
  std::size_t out = 0;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t held = 0; held < weights.size(); ++held) {
    double moved = 0.0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
      moved += weights[i] * std::sqrt((way(i) - way(held)).norm());
    }
    if (moved >= least) continue;
    least = moved;
    out = held;
  }
  return static_cast<int>(out);
}

void Window::hold(int index, const SE3& T_world_camera) {
  const SE3 move = (*this)[index].T_world_camera() * T_world_camera.inverse();
  for (auto& k : keyframes_) {
    k->frozen_T_camera_world = k->frozen_T_camera_world * move;
    k->T_camera_world = k->T_camera_world * move;
  }
  update_geometry();
}

}  // namespace sovo
