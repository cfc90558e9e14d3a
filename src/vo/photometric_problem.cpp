#include "sovo/vo/photometric_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sovo/image/lanes.h"
#include "sovo/vo/linearization.h"
#include "sovo/vo/static_residual.h"

namespace sovo {

namespace {

/// Points whose patterns are projected, and their images asked for, before the first is sampled.
constexpr std::size_t kAhead = 4;

std::size_t pair_index(int host, int target) {
  return static_cast<std::size_t>(host) * kMaxSlots + static_cast<std::size_t>(target);
}

Residual known_residual(const StoredResidual& r) {
  return {r.state, r.energy, r.centre_u, r.centre_v, r.centre_rho};
}

void store(const LinearizedResidual& r, StoredResidual* out) {
  out->cross = r.cross;
  out->energy = r.energy;
  out->raw_energy = r.raw_energy;
  out->centre_u = r.centre_u;
  out->centre_v = r.centre_v;
  out->centre_rho = r.centre_rho;
  out->depth = depth_part(r);
  out->state = r.state;
  out->textured = is_textured(r);
}

/// In single precision, as residuals want them, in the memory of what `out` was.
void round_to(const std::vector<Vec8>& displacements, std::vector<std::array<float, 8>>* out) {
  out->resize(displacements.size());
  for (std::size_t i = 0; i < out->size(); ++i) {
    for (std::size_t k = 0; k < 8; ++k) {
      (*out)[i][k] = static_cast<float>(displacements[i][static_cast<Eigen::Index>(k)]);
    }
  }
}

/// `relative_displacements` in the memory of what `out` was.
void displace_pairs(const Window& window, const VecX& x, std::vector<Vec8>* out) {
  out->assign(static_cast<std::size_t>(kMaxSlots) * kMaxSlots, Vec8::Zero());
  for (int h = 0; h < window.size(); ++h) {
    for (int t = 0; t < window.size(); ++t) {
      if (h == t) continue;
      (*out)[pair_index(h, t)] =
          x.segment<8>(8 * t) + window.pair(h, t).adjoint_host * x.segment<8>(8 * h);
    }
  }
}

}  // namespace

std::vector<PointRef> collect_points(Window* window) {
  std::vector<PointRef> refs;
  refs.reserve(static_cast<std::size_t>(window->num_active_points()));
  for (int i = 0; i < window->size(); ++i) {
    for (Point& p : (*window)[i].points) refs.push_back({i, &p});
  }
  return refs;
}

std::vector<Vec8> relative_displacements(const Window& window, const VecX& x) {
  std::vector<Vec8> relative;
  displace_pairs(window, x, &relative);
  return relative;
}

void PhotometricProblem::pose(std::vector<PointRef> points, Window* window) {
  points_ = std::move(points);
  window_ = window;
  first_.assign(1, 0);
  damping_.clear();
  blocks_.clear();
  states_.clear();
  const double depth_damping = config_.depth_damping / std::pow(window->mean_inverse_depth(), 2);
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const PointRef& ref = points_[i];
    add_damping(ref, depth_damping);
    std::size_t count = 0;
    for (const Residual& r : ref.point->residuals) {
      count += r.state != ResidualState::kAbsent ? 1 : 0;
    }
    first_.push_back(first_.back() + count);
    const bool full = !blocks_.empty() && i - blocks_.back().begin == kPointBlock;
    if (blocks_.empty() || full || blocks_.back().host != ref.host) {
      blocks_.push_back({ref.host, i, i});
    }
    blocks_.back().end = i + 1;
  }
  sums_.resize(blocks_.size());
  ++problem_;
  if (sampled_.size() < first_.back()) sampled_.resize(first_.back());
  if (window->rig() != nullptr && sampled_statics_.size() < points_.size()) {
    sampled_statics_.resize(points_.size());
  }
}

/// A pixel of parallax or less is lost in blur, and in what else moves all points of an image
/// alike: there the depth that stereo gave is the better one, and keeps its weight.
void PhotometricProblem::add_damping(const PointRef& ref, double depth_damping) {
  double baseline = 0.0;
  for (int t = 0; t < window_->size(); ++t) {
    const auto slot = static_cast<std::size_t>((*window_)[t].slot);
    if (ref.point->residuals[slot].state != ResidualState::kAbsent) {
      baseline = std::max(baseline, window_->pair(ref.host, t).distance);
    }
  }
  const double parallax = window_->camera().fx * baseline * ref.point->rho;
  const bool unseen = parallax < config_.min_parallax;
  damping_.push_back(depth_damping +
                     (unseen ? static_cast<double>(ref.point->static_information) : 0.0));
}

void PhotometricProblem::stored(WindowLinearization* out) const {
  out->residuals.clear();
  out->depths.clear();
  out->statics.clear();
  for (const PointRef& ref : points_) {
    out->depths.push_back({ref.point->hessian, ref.point->gradient});
    out->statics.push_back({.state = ref.point->static_state});
    for (int t = 0; t < window_->size(); ++t) {
      const Residual& r = ref.point->residuals[static_cast<std::size_t>((*window_)[t].slot)];
      if (r.state == ResidualState::kAbsent) continue;
      StoredResidual s;
      s.energy = r.energy;
      s.centre_u = r.centre_u;
      s.centre_v = r.centre_v;
      s.centre_rho = r.centre_rho;
      s.state = r.state;
      s.target = static_cast<std::uint8_t>(t);
      out->residuals.push_back(s);
    }
  }
}

void PhotometricProblem::remember_poses() {
  states_.push_back(window_->stacked_x());
  if (moved_.size() < states_.size()) moved_.resize(states_.size());
  for (std::size_t i = 0; i < states_.size(); ++i) {
    displace_pairs(*window_, states_.back() - states_[i], &displaced_);
    round_to(displaced_, &moved_[i]);
  }
}

/// Whether a residual was in view when it was sampled for this problem.
bool PhotometricProblem::is_sampled(std::size_t residual) const {
  return sampled_[residual].problem == problem_ && sampled_[residual].linearization >= 0;
}

/// How far a sampled residual's pattern has moved since, to first order.
PatternShift PhotometricProblem::moved_since(const PointRef& ref, std::size_t residual,
                                             int target) const {
  const SampledResidual& at = sampled_[residual];
  const auto rho_change = static_cast<float>(ref.point->rho - at.rho);
  return pattern_shift(
      at.linearized,
      moved_[static_cast<std::size_t>(at.linearization)][pair_index(ref.host, target)], rho_change);
}

/// Whether a residual may be taken along its Jacobian from where it was sampled, and how far.
bool PhotometricProblem::is_settled(const Block& block, std::size_t point, std::size_t residual,
                                    int target, PatternShift* shift) const {
  if (!is_sampled(residual) || config_.resample_px <= 0.0) return false;
  *shift = moved_since({block.host, points_[point].point}, residual, target);
  const auto limit = static_cast<float>(config_.resample_px);
  return shift->u * shift->u + shift->v * shift->v <= limit * limit;
}

void PhotometricProblem::linearize_block(const Block& block, const WindowLinearization& known,
                                         const Request& request, WindowLinearization* out,
                                         HostSums* sums, double* energy) {
  std::array<Step, kAhead * kMaxSlots> steps;
  std::array<TargetResidual, kMaxSlots> residuals;
  std::array<LinearizedResidual, kMaxSlots> moved;
  const auto wanted = [&](std::size_t k) {
    return (request.targets >> known.residuals[k].target & 1U) != 0;
  };
  sums->clear(window_->size());
  *energy = 0.0;
  for (std::size_t begin = block.begin; begin < block.end; begin += kAhead) {
    const std::size_t end = std::min(block.end, begin + kAhead);
    Step* step = steps.data();
    for (std::size_t i = begin; i < end; ++i) {
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
        if (wanted(k)) prepare(block, i, k, known.residuals[k].target, step++);
      }
    }
    step = steps.data();
    for (std::size_t i = begin; i < end; ++i) {
      std::size_t count = 0;
      PointDepth depth;
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
        if (!wanted(k)) continue;
        const int target = known.residuals[k].target;
        const LinearizedResidual* r =
            evaluate(block, i, k, known.residuals[k], *step++, &moved[count]);
        *energy += static_cast<double>(r->energy);
        if (r->state == ResidualState::kIn && request.at_frozen_poses) {
          moved[count] = *r;
          shift_residual(shifts_[pair_index(block.host, target)], &moved[count]);
          r = &moved[count];
        }
        out->residuals[k].target = known.residuals[k].target;
        store(*r, &out->residuals[k]);
        depth.add(out->residuals[k]);
        residuals[count++] = {target, r};
      }
      if (request.statics && known.statics[i].state != ResidualState::kAbsent) {
        evaluate_static(block, i, known.statics[i], &out->statics[i]);
        *energy += static_cast<double>(out->statics[i].energy);
        depth.add(out->statics[i]);
      } else {
        out->statics[i] = known.statics[i];
      }
      out->depths[i] = depth;
      if (request.system) {
        // What is folded into the prior is the information as it is.
        const double hessian = depth.hessian + (request.at_frozen_poses ? 0.0 : damping_[i]);
        sums->add({residuals.data(), count}, hessian, depth.gradient);
      }
    }
  }
}

void PhotometricProblem::prepare(const Block& block, std::size_t point, std::size_t residual,
                                 int target, Step* step) const {
  step->settled = is_settled(block, point, residual, target, &step->shift);
  if (step->settled) return;
  project_pattern(*window_, block.host, target, *points_[point].point, &step->projection);
  prefetch_pattern(*window_, target, step->projection);
}

const LinearizedResidual* PhotometricProblem::evaluate(const Block& block, std::size_t point,
                                                       std::size_t residual,
                                                       const StoredResidual& known,
                                                       const Step& step,
                                                       LinearizedResidual* moved) {
  SampledResidual& at = sampled_[residual];
  if (step.settled) {
    *moved = at.linearized;
    move_residual(step.shift, moved);
    const Verdict verdict = judge((*window_)[block.host], (*window_)[known.target],
                                  moved->raw_energy, is_textured(*moved));
    moved->state = verdict.state;
    moved->energy = verdict.energy;
    return moved;
  }
  if (at.problem != problem_) at.blur.known = false;
  at.problem = problem_;
  const Point& p = *points_[point].point;
  linearize_projected(*window_, config_, block.host, known.target, p, known_residual(known),
                      step.projection, &at.blur, &at.linearized);
  at.rho = p.rho;
  const bool in_view = at.linearized.state != ResidualState::kOutOfView;
  at.linearization = in_view ? static_cast<int>(states_.size()) - 1 : -1;
  return &at.linearized;
}

StoredStatic PhotometricProblem::stored_static(const Keyframe& host,
                                               const LinearizedResidual& r) const {
  StoredStatic out;
  const auto weight = static_cast<float>(static_weight(config_, *window_));
  const auto scale = static_cast<float>(static_scale_);  // of the inverse depth looked at
  const DepthPart part = depth_part(r);
  out.raw_energy = r.raw_energy;
  out.depth = {weight * scale * scale * part.hessian, weight * scale * part.gradient};
  out.textured = is_textured(r);
  const Verdict verdict = judge(host, host, r.raw_energy, out.textured);
  out.state = verdict.state;
  out.energy = weight * verdict.energy;
  return out;
}

void PhotometricProblem::evaluate_static(const Block& block, std::size_t point,
                                         const StoredStatic& known, StoredStatic* out) {
  *out = known;
  if (known.state == ResidualState::kOutOfView) return;
  SampledResidual& at = sampled_statics_[point];
  const Point& p = *points_[point].point;
  const Keyframe& host = (*window_)[block.host];
  const double rho = static_scale_ * p.rho;
  const auto rho_change = static_cast<float>(rho - at.rho);
  const PatternShift shift = {at.linearized.du_rho * rho_change, at.linearized.dv_rho * rho_change,
                              0.0F, 0.0F};
  const auto limit = static_cast<float>(config_.resample_px);
  if (at.problem == problem_ && at.linearization >= 0 &&
      shift.u * shift.u + shift.v * shift.v <= limit * limit) {
    LinearizedResidual moved = at.linearized;
    move_residual(shift, &moved);
    *out = stored_static(host, moved);
    return;
  }
  at.problem = problem_;
  linearize_static(*window_->rig(), config_, host, p, rho, &at.linearized);
  at.rho = rho;
  const bool in_view = at.linearized.state != ResidualState::kOutOfView;
  at.linearization = in_view ? 0 : -1;
  if (in_view) {
    *out = stored_static(host, at.linearized);
  } else {
    out->state = ResidualState::kOutOfView;  // with the energy that it had: leaving is no gain
  }
}

void PhotometricProblem::linearize(const WindowLinearization& known, const Request& request,
                                   WindowLinearization* out) {
  out->residuals.resize(known.residuals.size());
  out->statics.resize(known.statics.size());
  out->depths.resize(known.depths.size());
  std::vector<double> energies(blocks_.size());
  static_scale_ = request.at_frozen_poses ? 1.0 : window_->static_scale();
  remember_poses();
  if (request.at_frozen_poses) shifts_ = relative_displacements(*window_, states_.back());
  pool_->run(static_cast<int>(blocks_.size()), [&](int i) {
    const auto k = static_cast<std::size_t>(i);
    linearize_block(blocks_[k], known, request, out, &sums_[k], &energies[k]);
  });
  out->energy = 0.0;
  for (const double e : energies) out->energy += e;
  if (!request.system) return;
  out->system = empty_system(*window_);
  for (std::size_t begin = 0; begin < blocks_.size();) {
    std::size_t end = begin;
    while (end < blocks_.size() && blocks_[end].host == blocks_[begin].host) ++end;
    add_host(*window_, blocks_[begin].host, {&sums_[begin], end - begin}, &out->system);
    begin = end;
  }
}

void PhotometricProblem::reclassify(WindowLinearization* at) const {
  for (const Block& block : blocks_) {
    for (std::size_t i = block.begin; i < block.end; ++i) {
      PointDepth depth;
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
        StoredResidual& r = at->residuals[k];
        if (r.state == ResidualState::kOutOfView) continue;
        const Verdict verdict =
            judge((*window_)[block.host], (*window_)[r.target], r.raw_energy, r.textured);
        r.state = verdict.state;
        r.energy = verdict.energy;
        depth.add(r);
      }
      StoredStatic& s = at->statics[i];
      if (s.state == ResidualState::kIn || s.state == ResidualState::kOutlier) {
        const Keyframe& host = (*window_)[block.host];
        const Verdict verdict = judge(host, host, s.raw_energy, s.textured);
        s.state = verdict.state;
        s.energy = static_cast<float>(static_weight(config_, *window_)) * verdict.energy;
        depth.add(s);
      }
      at->depths[i] = depth;
    }
  }
}

void PhotometricProblem::step_depths(const WindowLinearization& at, const VecX& dx, double lambda) {
  displace_pairs(*window_, dx, &displaced_);
  round_to(displaced_, &steps_);
  for (const Block& block : blocks_) {
    for (std::size_t i = block.begin; i < block.end; ++i) {
      const PointDepth& depth = at.depths[i];
      if (depth.hessian <= kMinDepthHessian) continue;
      double b = depth.gradient;
      for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
        const StoredResidual& r = at.residuals[k];
        if (r.state != ResidualState::kIn) continue;
        const std::array<float, 8>& step = steps_[pair_index(block.host, r.target)];
        b += static_cast<double>(sum_lane(load_lane(&r.cross[0]) * load_lane(&step[0]) +
                                          load_lane(&r.cross[4]) * load_lane(&step[4])));
      }
      points_[i].point->rho -= b / ((depth.hessian + damping_[i]) * (1.0 + lambda));
    }
  }
}

double PhotometricProblem::gradient_scatter(const WindowLinearization& at, int target) const {
  double squared_gradients = 0.0;
  double hessians = 0.0;
  double energy = 0.0;
  double count = 0.0;
  for (std::size_t i = 0; i < at.residuals.size(); ++i) {
    const StoredResidual& stored = at.residuals[i];
    if (stored.target != target || stored.state != ResidualState::kIn) continue;
    if (!is_sampled(i)) continue;
    const ShiftPart part = shift_part(sampled_[i].linearized);
    squared_gradients += static_cast<double>(part.squared_gradient);
    hessians += static_cast<double>(part.hessian);
    energy += static_cast<double>(sampled_[i].linearized.rr);
    count += 1.0;
  }
  if (energy * hessians <= 0.0) return 1.0;
  // Of independent errors with variance s^2 the expected square of a gradient is s^2 times the
  // trace of its Hessian.
  const double variance = energy / (kPatternSize * count);
  return squared_gradients / (variance * hessians);
}

void PhotometricProblem::visit_inliers(const WindowLinearization& at,
                                       const InlierVisitor& visit) const {
  std::array<LinearizedResidual, kMaxSlots> moved;
  std::array<TargetResidual, kMaxSlots> inliers;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    std::size_t count = 0;
    for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
      const StoredResidual& stored = at.residuals[k];
      if (stored.state != ResidualState::kIn || !is_sampled(k)) continue;
      moved[count] = sampled_[k].linearized;
      move_residual(moved_since(points_[i], k, stored.target), &moved[count]);
      inliers[count] = {stored.target, &moved[count]};
      ++count;
    }
    if (count > 0) visit(points_[i], damping_[i], {inliers.data(), count});
  }
}

void PhotometricProblem::write_back(const WindowLinearization& from) {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Point& p = *points_[i].point;
    p.hessian = from.depths[i].hessian;
    p.gradient = from.depths[i].gradient;
    p.static_state = from.statics[i].state;
    for (std::size_t k = first_[i]; k < first_[i + 1]; ++k) {
      const StoredResidual& r = from.residuals[k];
      p.residuals[static_cast<std::size_t>((*window_)[r.target].slot)] = known_residual(r);
    }
  }
}

}  // namespace sovo
