#pragma once

#include <optional>
#include <vector>

#include "sovo/vo/direct_config.h"
#include "sovo/vo/window.h"
#include "sovo/vo/worker_pool.h"

namespace sovo {

/// Distance of each pixel of pyramid level 1 to the nearest point stamped into it [px of level 1].
class DistanceMap {
 public:
  /// Farther is not told apart.
  static constexpr float kMaxDistance = 20.0F;

  DistanceMap(int width, int height);
  void stamp(float u, float v);
  float at(float u, float v) const;

 private:
  ImageF distance_;
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
  void optimize(const Window& window, Candidate* candidate) const;

  PointConfig config_;
  WindowConfig window_config_;
  WorkerPool* pool_;
  float min_distance_ = 2.0F;  ///< Between points of type 1 [px of level 1].
};

}  // namespace sovo
