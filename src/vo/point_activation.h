#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/linearization.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Which pixels of an image are taken, and whether there is one near.
class OccupancyMap {
 public:
  OccupancyMap(int width, int height);
  int width() const { return width_; }
  int height() const { return height_; }

  /// Takes a pixel of the image.
  void take(int x, int y);
  /// Whether a taken pixel is closer than `distance` (at most 30), in the octagonal norm
  /// max(|dx|, |dy|) + min(|dx|, |dy|) / 2: close to the Euclidean one, in whole numbers.
  bool any_closer(int x, int y, float distance) const;

 private:
  bool any_in_row(int y, int first_x, int last_x) const;

  int width_, height_;
  std::size_t words_;  ///< 64 pixels each, in a row.
  std::vector<std::uint64_t> bits_;
};

/// How a candidate is blurred in each keyframe, by window index.
using CandidateBlur = std::array<PatternBlur, kMaxSlots>;

/// A candidate's depth measured in all keyframes.
struct DepthEvaluation {
  std::array<LinearizedResidual, kMaxSlots> residuals;  ///< By window index; not of the host.
  double energy = 0.0, hessian = 0.0, gradient = 0.0;
};

/// Chooses immature points whose interval is narrow, spreads them evenly over the newest keyframe,
/// finds their inverse depths in all keyframes, and makes them active (DSO, Sec. 3.2, "candidate
/// point activation").
class PointActivator {
 public:
  PointActivator(const PointConfig& points, const WindowConfig& window, WorkerPool* pool)
      : config_(points), window_config_(window), pool_(pool) {}

  /// Returns how many points became active. Points that can never become active are deleted.
  int activate(Window* window);

  void reset() { min_distance_ = 2.0F; }

 private:
  struct Candidate {
    int host;
    std::size_t index;
    std::optional<Point> point;
    bool discard = false;
  };
  void adapt_spacing(int active);
  std::vector<Candidate> choose(Window* window) const;
  void optimize(const Window& window, double mean_rho, Candidate* candidate) const;
  /// All residuals of a candidate at its present depth.
  void linearize(const Window& window, const Candidate& candidate, const Point& point,
                 CandidateBlur* blur, DepthEvaluation* out) const;
  /// Adds those up that are inliers with the threshold times `slack`.
  static void judge(const Window& window, const Candidate& candidate, double slack,
                    DepthEvaluation* at);
  /// Keyframes that agree about a point, and that deny it.
  struct Votes {
    int agree = 0;
    int deny = 0;
  };
  static Votes count_votes(const Window& window, int host, double rho, const DepthEvaluation& at);

  PointConfig config_;
  WindowConfig window_config_;
  WorkerPool* pool_;
  float min_distance_ = 2.0F;  ///< Between points of type 1 [px of level 1].
};

}  // namespace sovo
