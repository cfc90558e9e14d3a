#include "sovo/vo/epipolar_search.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "sovo/image/interpolation.h"
#include "sovo/image/lanes.h"
#include "sovo/vo/plain_product.h"

namespace sovo {

namespace {

constexpr float kSearchBorder = 4.0F;
constexpr int kMaxSteps = 100;
constexpr int kRefinements = 3;
constexpr float kMaxRefinement = 0.5F;   // px an iteration
constexpr float kStopRefinement = 0.1F;  // px
constexpr int kUniquenessRadius = 2;     // samples around the best that do not count as second
constexpr float kMaxPixelError = 10.0F;
constexpr float kPixelErrorBase = 0.2F;
constexpr float kMinDepthRatio = 0.75F;
constexpr float kMaxDepthRatio = 1.5F;
constexpr float kMostScale = 3.0F;  // of a pattern that can still be compared
// [px]; within the border together with the pixels for the gradient.
constexpr float kMaxPatternOffset = 2.9F;

bool inside(const ImageF& image, float u, float v) {
  return u > kSearchBorder && v > kSearchBorder &&
         u < static_cast<float>(image.width()) - kSearchBorder - 1.0F &&
         v < static_cast<float>(image.height()) - kSearchBorder - 1.0F;
}

/// The segment of the image on which the point must lie, and what is needed to come back from a
/// position on it to inverse depth.
struct Segment {
  Eigen::Vector3f ray;  ///< K R K^-1 (u, v, 1).
  float u_min, v_min;   ///< At rho_min.
  float u_max, v_max;   ///< At rho_max, or a search length away.
  float length;
};

TraceState finish(ImmaturePoint* p, TraceState state) {
  if (state == TraceState::kOutOfView) p->interval_px = 0.0F;
  p->state = state;
  return state;
}

/// Determines the segment. Returns kUntraced when there is one to search.
TraceState find_segment(const ImageF& image, const HostGeometry& g, const PointConfig& config,
                        const ImmaturePoint& p, Segment* s) {
  s->ray = plain_product(g.KRKi, Eigen::Vector3f(p.u, p.v, 1.0F));
  const Eigen::Vector3f near_infinity = s->ray + g.Kt * p.rho_min;
  if (!(near_infinity.z() > 0.0F)) return TraceState::kOutOfView;
  s->u_min = near_infinity.x() / near_infinity.z();
  s->v_min = near_infinity.y() / near_infinity.z();
  if (!inside(image, s->u_min, s->v_min)) return TraceState::kOutOfView;

  const auto max_search =
      static_cast<float>(config.max_search) * static_cast<float>(image.width() + image.height());
  const bool bounded = std::isfinite(p.rho_max);
  const Eigen::Vector3f far_end = s->ray + g.Kt * (bounded ? p.rho_max : 0.01F + p.rho_min);
  if (!(far_end.z() > 0.0F)) return TraceState::kOutOfView;
  s->u_max = far_end.x() / far_end.z();
  s->v_max = far_end.y() / far_end.z();
  s->length = std::hypot(s->u_max - s->u_min, s->v_max - s->v_min);
  if (!bounded) {
    if (s->length < 1e-6F) return TraceState::kBadCondition;
    const float scale = max_search / s->length;
    s->u_max = s->u_min + (s->u_max - s->u_min) * scale;
    s->v_max = s->v_min + (s->v_max - s->v_min) * scale;
    s->length = max_search;
  } else if (s->length < static_cast<float>(config.min_interval_px)) {
    return TraceState::kSkipped;
  }
  if (!inside(image, s->u_max, s->v_max)) return TraceState::kOutOfView;
  const float depth_ratio = near_infinity.z();  // z_target / z_host for a far point
  if (p.rho_min > 0.0F && (depth_ratio < kMinDepthRatio || depth_ratio > kMaxDepthRatio)) {
    // The pattern of the search is not scaled; the one that the window compares is. What stereo
    // knows well enough needs no search.
    const bool comparable = depth_ratio * kMostScale > 1.0F && depth_ratio < kMostScale;
    return p.from_static_match() && comparable ? TraceState::kSkipped : TraceState::kOutOfView;
  }
  return TraceState::kUntraced;
}

bool fits_border(const SearchPattern& pattern) {
  const Lane limit = lane_of(kMaxPatternOffset);
  return all_of((abs_lane(pattern.x[0]) < limit) & (abs_lane(pattern.x[1]) < limit) &
                (abs_lane(pattern.y[0]) < limit) & (abs_lane(pattern.y[1]) < limit));
}

/// Huber energy of the pattern at (u, v).
float pattern_energy(const ImageF& image, const SearchPattern& pattern, float huber, float u,
                     float v) {
  Lane energy{};
  for (std::size_t k = 0; k < 2; ++k) {
    const Lane r = sample_lanes(image, u + pattern.x[k], v + pattern.y[k]) - pattern.colour[k];
    const Lane hw = min_lane(lane_of(1.0F), huber / abs_lane(r));
    energy += hw * r * r * (2.0F - hw);
  }
  return sum_lane(energy);
}

/// Normal equation of a displacement along the line, and the weighted energy.
struct LineStep {
  float H = 1.0F, b = 0.0F, energy = 0.0F;
};

LineStep linearize_line(const ImageF& image, const SearchPattern& pattern, float huber, float dx,
                        float dy, float u, float v) {
  Lane H{};
  Lane b{};
  Lane energy{};
  const LineResiduals line = line_residuals(image, pattern, u, v, dx, dy);
  for (std::size_t k = 0; k < 2; ++k) {
    const Lane r = line.r[k];
    const Lane slope = line.slope[k];
    const Lane hw = min_lane(lane_of(1.0F), huber / abs_lane(r));
    H += hw * slope * slope;
    b += hw * r * slope;
    energy += pattern.squared_weight[k] * hw * r * r * (2.0F - hw);
  }
  return {1.0F + sum_lane(H), sum_lane(b), sum_lane(energy)};
}

/// Gauss-Newton along the line from (*u, *v). Returns the best energy.
float refine(const ImageF& image, const SearchPattern& pattern, float huber, float dx, float dy,
             float start_energy, float* u, float* v) {
  float best = start_energy;
  float best_u = *u;
  float best_v = *v;
  float step_back = 0.0F;
  float factor = 1.0F;
  for (int it = 0; it < kRefinements; ++it) {
    if (!inside(image, *u, *v)) break;
    const LineStep at = linearize_line(image, pattern, huber, dx, dy, *u, *v);
    float step;
    if (at.energy > best && it > 0) {
      factor *= 0.5F;
      step = factor * step_back;
      *u = best_u;
      *v = best_v;
    } else {
      best = at.energy;
      best_u = *u;
      best_v = *v;
      step = std::clamp(-factor * at.b / at.H, -kMaxRefinement, kMaxRefinement);
      step_back = step;
    }
    if (!std::isfinite(step)) step = 0.0F;
    *u += step * dx;
    *v += step * dy;
    if (std::abs(step) < kStopRefinement) break;
  }
  *u = best_u;
  *v = best_v;
  return best;
}

/// Second-best over best energy outside the neighbourhood of the best.
float uniqueness(const std::array<float, kMaxSteps>& energies, int n, int best, float best_energy) {
  float second = 1e10F;
  for (int i = 0; i < n; ++i) {
    if (std::abs(i - best) > kUniquenessRadius) {
      second = std::min(second, energies[static_cast<std::size_t>(i)]);
    }
  }
  return second / std::max(best_energy, 1e-6F);
}

/// New interval from the position and its pixel error (the axis with more parallax decides).
void update_interval(const Segment& s, const HostGeometry& g, float u, float v, float dx, float dy,
                     float error, ImmaturePoint* p) {
  const bool use_u = dx * dx > dy * dy;
  const float ray = use_u ? s.ray.x() : s.ray.y();
  const float kt = use_u ? g.Kt.x() : g.Kt.y();
  const float centre = use_u ? u : v;
  const float delta = error * (use_u ? dx : dy);
  const auto rho_at = [&](float c) { return (s.ray.z() * c - ray) / (kt - g.Kt.z() * c); };
  p->rho_min = rho_at(centre - delta);
  p->rho_max = rho_at(centre + delta);
  if (p->rho_min > p->rho_max) std::swap(p->rho_min, p->rho_max);
}

}  // namespace

HostGeometry host_geometry(const CameraModel& camera, const SE3& T_target_host,
                           const BrightnessTransfer& transfer) {
  const Mat3 K = camera.matrix();
  HostGeometry g;
  g.KRKi = (K * T_target_host.rotation_matrix() * K.inverse()).cast<float>();
  g.Kt = (K * T_target_host.translation()).cast<float>();
  g.gain = static_cast<float>(transfer.gain);
  g.bias = static_cast<float>(transfer.bias);
  return g;
}

SearchPattern search_pattern(const HostGeometry& g, const ImmaturePoint& p) {
  SearchPattern out;
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    const std::size_t k = i / kLanes;
    const std::size_t lane = i % kLanes;
    out.x[k][lane] = g.KRKi(0, 0) * kPattern[i].x + g.KRKi(0, 1) * kPattern[i].y;
    out.y[k][lane] = g.KRKi(1, 0) * kPattern[i].x + g.KRKi(1, 1) * kPattern[i].y;
    out.colour[k][lane] = g.gain * p.colour[i] + g.bias;
    out.squared_weight[k][lane] = p.weight[i] * p.weight[i];
  }
  return out;
}

LineResiduals line_residuals(const ImageF& image, const SearchPattern& pattern, float u, float v,
                             float dx, float dy) {
  LineResiduals out;
  for (std::size_t k = 0; k < 2; ++k) {
    const LaneSample s = sample_lanes_with_gradient(image, u + pattern.x[k], v + pattern.y[k]);
    out.r[k] = s.value - pattern.colour[k];
    out.slope[k] = dx * s.gx + dy * s.gy;
  }
  return out;
}

namespace {

/// What blur along an axis adds to a grey level, as `ColourBlur` has it [grey levels].
struct AddedBlur {
  float narrow, wide;
};

/// Along steps of (du, dv) pixels. The narrow kernel is (1, 2, 1) / 4; the wide one is that again,
/// with three spread over every second pixel. Beyond its edge an image goes on as it ends.
AddedBlur added_blur(const ImageF& image, float u, float v, float du, float dv) {
  constexpr float kOuter = (kWideBlur - kNarrowBlur) / 8.0F;  // of the three, 4 px^2 off each
  const auto right = static_cast<float>(image.width() - 1) - 1e-3F;
  const auto bottom = static_cast<float>(image.height() - 1) - 1e-3F;
  const auto at = [&](float step) {
    return sample(image, std::clamp(u + step * du, 0.0F, right),
                  std::clamp(v + step * dv, 0.0F, bottom));
  };
  const float middle = at(0.0F);
  const float one = at(-1.0F) + at(1.0F);
  const float two = at(-2.0F) + at(2.0F);
  const float three = at(-3.0F) + at(3.0F);
  const float narrow = 0.25F * one - 0.5F * middle;
  const float outer = kOuter * (0.25F * (one + three) + 0.5F * two);
  return {narrow, outer - 2.0F * kOuter * (narrow + middle)};
}

}  // namespace

bool make_immature_point(const ImageF& image, float u, float v, std::uint8_t type,
                         const PointConfig& config, double gradient_constant, ImmaturePoint* out) {
  if (!in_image(image, u, v, kPatternBorder)) return false;
  const auto c2 = static_cast<float>(gradient_constant * gradient_constant);
  ImmaturePoint p;
  p.u = u;
  p.v = v;
  p.type = type;
  for (std::size_t i = 0; i < kPatternSize; ++i) {
    const Sample s = sample_with_gradient(image, u + kPattern[i].x, v + kPattern[i].y);
    if (!std::isfinite(s.value)) return false;
    p.colour[i] = s.value;
    p.weight[i] = std::sqrt(c2 / (c2 + s.gx * s.gx + s.gy * s.gy));
    const AddedBlur along_u = added_blur(image, u + kPattern[i].x, v + kPattern[i].y, 1.0F, 0.0F);
    const AddedBlur along_v = added_blur(image, u + kPattern[i].x, v + kPattern[i].y, 0.0F, 1.0F);
    p.blur.narrow_u[i] = along_u.narrow;
    p.blur.narrow_v[i] = along_v.narrow;
    p.blur.wide_u[i] = along_u.wide;
    p.blur.wide_v[i] = along_v.wide;
    p.gxx += s.gx * s.gx;
    p.gxy += s.gx * s.gy;
    p.gyy += s.gy * s.gy;
  }
  p.energy_threshold = static_cast<float>(kPatternSize * config.outlier_energy);
  *out = p;
  return true;
}

namespace {

/// With what a rolling shutter or a port does to a point of this depth.
HostGeometry moved_by_shift(const HostGeometry& g, const ImageF& image, const ImmaturePoint& p) {
  const float rho = std::isfinite(p.rho_max) ? 0.5F * (p.rho_min + p.rho_max) : p.rho_min;
  const Eigen::Vector3f seen = plain_product(g.KRKi, Eigen::Vector3f(p.u, p.v, 1.0F)) + g.Kt * rho;
  HostGeometry out = g;
  const auto moved = g.shift.at({p.u, p.v}, seen, image.width(), image.height());
  out.Kt = plain_product(g.K, moved.applied(g.t));
  return out;
}

TraceState search(const ImageF& image, const HostGeometry& g, const PointConfig& config,
                  ImmaturePoint* point) {
  ImmaturePoint& p = *point;
  Segment s;
  const TraceState early = find_segment(image, g, config, p, &s);
  if (early == TraceState::kSkipped) p.interval_px = s.length;
  if (early != TraceState::kUntraced) return finish(&p, early);

  float dx = (s.u_max - s.u_min) / s.length;
  float dy = (s.v_max - s.v_min) / s.length;
  const float along = p.gxx * dx * dx + 2.0F * p.gxy * dx * dy + p.gyy * dy * dy;
  const float across = p.gxx * dy * dy - 2.0F * p.gxy * dx * dy + p.gyy * dx * dx;
  float error = kPixelErrorBase + kPixelErrorBase * (along + across) / std::max(along, 1e-6F);
  if (error * 2.0F > s.length && std::isfinite(p.rho_max)) {
    p.interval_px = s.length;
    return finish(&p, TraceState::kBadCondition);
  }
  error = std::min(error, kMaxPixelError);

  const auto huber = static_cast<float>(config.huber);
  const SearchPattern pattern = search_pattern(g, p);
  if (!fits_border(pattern)) return finish(&p, TraceState::kBadCondition);
  const int steps = std::min(static_cast<int>(1.9999F + s.length), kMaxSteps - 1);
  std::array<float, kMaxSteps> energies;
  int best = -1;
  float best_energy = 1e10F;
  for (int i = 0; i < steps; ++i) {
    const float t = static_cast<float>(i);
    const float u = s.u_min + t * dx;
    const float v = s.v_min + t * dy;
    float energy = 1e5F;
    if (inside(image, u, v)) energy = pattern_energy(image, pattern, huber, u, v);
    energies[static_cast<std::size_t>(i)] = energy;
    if (energy < best_energy) {
      best_energy = energy;
      best = i;
    }
  }
  if (best < 0) return finish(&p, TraceState::kOutOfView);
  const float quality = uniqueness(energies, steps, best, best_energy);
  if (quality < p.quality || steps > 10) p.quality = quality;

  float u = s.u_min + static_cast<float>(best) * dx;
  float v = s.v_min + static_cast<float>(best) * dy;
  const float refined = refine(image, pattern, huber, dx, dy, best_energy, &u, &v);
  if (!(refined < p.energy_threshold * 1.2F)) {
    const bool twice = p.state == TraceState::kOutlier;
    return finish(&p, twice ? TraceState::kOutOfView : TraceState::kOutlier);
  }
  update_interval(s, g, u, v, dx, dy, error, &p);
  if (!std::isfinite(p.rho_min) || !std::isfinite(p.rho_max) || p.rho_max < 0.0F) {
    return finish(&p, TraceState::kOutlier);
  }
  p.interval_px = 2.0F * error;
  return finish(&p, TraceState::kGood);
}

}  // namespace

TraceState trace(const ImageF& image, const HostGeometry& geometry, const PointConfig& config,
                 ImmaturePoint* point) {
  if (point->state == TraceState::kOutOfView) return point->state;
  if (geometry.shift.none()) return search(image, geometry, config, point);
  return search(image, moved_by_shift(geometry, image, *point), config, point);
}

}  // namespace sovo
