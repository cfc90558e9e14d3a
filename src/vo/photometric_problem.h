#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "sovo/image/image.h"
#include "sovo/vo/direct_config.h"
#include "sovo/vo/linearization.h"
#include "sovo/vo/normal_equations.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// A point and where it lives.
struct PointRef {
  int host = 0;  ///< Index in the window.
  Point* point = nullptr;
};

/// All active points of the window, by host, in their order.
std::vector<PointRef> collect_points(Window* window);

/// How many points of one host a block of work holds.
inline constexpr int kPointBlock = 64;

/// What is kept of a linearized residual: one cache line.
struct alignas(64) StoredResidual {
  std::array<float, 8> cross{};  ///< J_state^T J_rho, relative coordinates; of inliers.
  float energy = 0.0F;
  float raw_energy = 0.0F;
  float centre_u = 0.0F, centre_v = 0.0F, centre_rho = 0.0F;
  DepthPart depth;  ///< Counts where the residual is an inlier.
  ResidualState state = ResidualState::kAbsent;
  std::uint8_t target = 0;  ///< Index in the window.
  bool textured = false;
};
static_assert(sizeof(StoredResidual) == 64);

/// A residual as it was last sampled. What is left of an earlier problem says so itself: to go over
/// all of them before the first is sampled would take as long as an iteration.
struct SampledResidual {
  LinearizedResidual linearized;
  PatternBlur blur;
  double rho = 0.0;           ///< Inverse depth of its point then.
  int linearization = -1;     ///< Which one that was; -1: none, or out of view.
  std::uint32_t problem = 0;  ///< In which all of this was found out; 0: none.
};

/// What is kept of a point's linearized residual in its host's right image.
struct StoredStatic {
  float energy = 0.0F;  ///< As it counts, weighted.
  float raw_energy = 0.0F;
  DepthPart depth{};  ///< Weighted; counts where the residual is an inlier.
  ResidualState state = ResidualState::kAbsent;
  bool textured = false;
};

/// A point's own H_rho_rho and b_rho.
struct PointDepth {
  double hessian = 0.0, gradient = 0.0;

  void add(const StoredStatic& r) {
    if (r.state != ResidualState::kIn) return;
    hessian += static_cast<double>(r.depth.hessian);
    gradient += static_cast<double>(r.depth.gradient);
  }

  /// Adds the part of an inlier.
  void add(const StoredResidual& r) {
    if (r.state != ResidualState::kIn) return;
    hessian += static_cast<double>(r.depth.hessian);
    gradient += static_cast<double>(r.depth.gradient);
  }
};

/// All residuals of some points, linearized.
struct WindowLinearization {
  AlignedVector<StoredResidual> residuals;  ///< By point.
  std::vector<StoredStatic> statics;        ///< Of each point.
  std::vector<PointDepth> depths;
  NormalEquations system;
  double energy = 0.0;
};

/// The photometric residuals of some points of a window, in the order in which they are worked on:
/// blocks of fixed size, so that results do not depend on the number of threads.
class PhotometricProblem {
 public:
  /// Poses nothing yet.
  PhotometricProblem(const WindowConfig& config, WorkerPool* pool) : config_(config), pool_(pool) {}
  PhotometricProblem(const WindowConfig& config, std::vector<PointRef> points, Window* window,
                     WorkerPool* pool)
      : PhotometricProblem(config, pool) {
    pose(std::move(points), window);
  }

  /// Begins anew with these points, by host, in the memory that there is: fresh pages cost as much
  /// as an iteration.
  void pose(std::vector<PointRef> points, Window* window);

  /// The residuals as the points have them.
  void stored(WindowLinearization* out) const;
  WindowLinearization stored() const {
    WindowLinearization out;
    stored(&out);
    return out;
  }

  struct Request {
    bool system = true;  ///< Whether the normal equations of the inliers are wanted.
    /// Move residuals to the frozen poses; the depths keep their present values as linearization
    /// point. Residuals into right images look where the depths are in metres, whether or not
    /// their scale is free: what is folded into the prior keeps the scale that stereo sees.
    bool at_frozen_poses = false;
    bool statics = true;  ///< Whether residuals into right images are linearized.
    /// Bit i: whether residuals into keyframe i are linearized; others stay as they are in `out`.
    std::uint32_t targets = std::numeric_limits<std::uint32_t>::max();
  };

  /// Linearizes at the present estimate. `known`: states so far; what is out of view stays so. A
  /// residual is sampled again where its pattern has moved by more than `resample_px` since it was;
  /// otherwise it is taken along its own Jacobian. Between the older keyframes little moves in one
  /// bundle adjustment, and sampling is most of the work.
  /// `out` may be `known`.
  void linearize(const WindowLinearization& known, const Request& request,
                 WindowLinearization* out);

  /// States, energies and depth information by the present outlier thresholds, from the residuals
  /// as they were measured.
  void reclassify(WindowLinearization* at) const;

  /// Moves the depths by back-substitution of the poses' step `dx`, damped by `lambda`.
  void step_depths(const WindowLinearization& at, const VecX& dx, double lambda);

  /// Writes states, projections and information into the points.
  void write_back(const WindowLinearization& from);

  /// How many times as much the energy's gradients by the shift of a whole pattern scatter as they
  /// would if its pixels erred independently: 1 for noise, up to 8 for what moves a whole pattern;
  /// below 1 where errors of neighbours cancel. Of inliers in keyframe `target`; 1 when there are
  /// none. `at`: as linearized last.
  double gradient_scatter(const WindowLinearization& at, int target) const;

  /// Of each point the inliers, moved to the present estimate, and what was added to its H_rho.
  /// `at`: as linearized last, at the present estimate.
  using InlierVisitor = std::function<void(const PointRef& point, double depth_damping,
                                           std::span<const TargetResidual> inliers)>;
  void visit_inliers(const WindowLinearization& at, const InlierVisitor& visit) const;

  const std::vector<PointRef>& points() const { return points_; }

 private:
  struct Block {
    int host = 0;
    std::size_t begin = 0, end = 0;  ///< Points.
  };
  /// What is known of a residual before it is evaluated.
  struct Step {
    bool settled = false;          ///< Not to be sampled.
    PatternShift shift;            ///< Of a settled one.
    PatternProjection projection;  ///< Of any other.
  };
  void add_damping(const PointRef& ref, double depth_damping);
  void remember_poses();
  bool is_settled(const Block& block, std::size_t point, std::size_t residual, int target,
                  PatternShift* shift) const;
  bool is_sampled(std::size_t residual) const;
  PatternShift moved_since(const PointRef& ref, std::size_t residual, int target) const;
  void prepare(const Block& block, std::size_t point, std::size_t residual, int target,
               Step* step) const;
  /// The residual as sampled now, which is kept, or in `moved` as it is by its Jacobian.
  const LinearizedResidual* evaluate(const Block& block, std::size_t point, std::size_t residual,
                                     const StoredResidual& known, const Step& step,
                                     LinearizedResidual* moved);
  /// The static residual of a point, sampled or moved as others are.
  void evaluate_static(const Block& block, std::size_t point, const StoredStatic& known,
                       StoredStatic* out);
  /// Of a residual in view.
  StoredStatic stored_static(const Keyframe& host, const LinearizedResidual& r) const;
  void linearize_block(const Block& block, const WindowLinearization& known, const Request& request,
                       WindowLinearization* out, HostSums* sums, double* energy);

  WindowConfig config_;
  WorkerPool* pool_;
  Window* window_ = nullptr;
  std::vector<PointRef> points_;
  /// Added to a point's H_rho where its depth is solved for [m^2]: without parallax a step would be
  /// noise over noise.
  std::vector<double> damping_;
  std::vector<std::size_t> first_;  ///< First residual of each point, and one past the last.
  std::vector<Block> blocks_;
  double static_scale_ = 1.0;                       ///< Of the linearization at hand.
  std::vector<HostSums> sums_;                      ///< Of each block.
  std::uint32_t problem_ = 0;                       ///< How many have been posed.
  AlignedVector<SampledResidual> sampled_;          ///< Every residual, and memory for more.
  AlignedVector<SampledResidual> sampled_statics_;  ///< Of each point, and memory for more.
  std::vector<VecX> states_;                        ///< Of the keyframes, at each linearization.
  /// Relative displacement of each pair since each linearization, and memory for more.
  std::vector<std::vector<std::array<float, 8>>> moved_;
  std::vector<std::array<float, 8>> steps_;  ///< The same of a step.
  std::vector<Vec8> displaced_;              ///< For its memory alone.
  std::vector<Vec8> shifts_;  ///< From the frozen poses to the current ones, for `at_frozen_poses`.
};

/// Relative displacement of each pair for a displacement of all keyframes (8 a keyframe): J x of a
/// residual is its relative Jacobian times it. Element host * kMaxSlots + target.
std::vector<Vec8> relative_displacements(const Window& window, const VecX& x);

}  // namespace sovo
