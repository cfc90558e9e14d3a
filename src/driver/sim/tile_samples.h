#pragma once

#include <vector>

#include "sovo/driver/sim/scene_view.h"
#include "sovo/driver/sim/shader.h"
#include "sovo/image/image.h"

namespace sovo::sim {

/// Rays of a tile that are shaded together: one for every pixel, or for every part of a pixel in
/// which surfaces meet. Those that meet one surface are worked on side by side.
class TileSamples {
 public:
  static constexpr int kNothing = -1;  ///< The sky, as a surface.

  TileSamples();

  /// What a ray meets of the surfaces without holes.
  struct Hit {
    Eigen::Vector3f ray = Eigen::Vector3f::UnitZ();
    float range = 0.0F;
    int surface = kNothing;  ///< Index of its view.
  };
  /// Starts over.
  void clear() { count_ = 0; }
  /// Adds a ray, `share` of the light of `pixel`; with no share, only its range is found. At most
  /// nine a pixel fit.
  void add(int pixel, const Hit& hit, float angle, float share);

  /// Finds light and range of all rays; `pierced`: surfaces with holes that they may meet.
  void shade(const Scene& scene, const SceneView& view, const Shader& shader,
             const std::vector<int>& pierced);

  int count() const { return count_; }
  int pixel(int i) const { return pixel_[at(i)]; }
  float share(int i) const { return share_[at(i)]; }
  float light(int i) const { return light_[at(i)]; }
  /// To what covers the ray by more than half [m].
  float range(int i) const { return seen_range_[at(i)]; }

 private:
  /// What a ray sees of a surface with holes.
  struct Cut {
    float range;
    float opacity;
    float light;
    bool decal;
    int next;  ///< Behind it on the same ray.
  };
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }
  void take(int i, RayBatch* rays);
  void cut_by(const SurfaceView& view, bool decal, const Shader& shader);
  void add_cuts(const SurfaceView& view, bool decal, const Shader& shader, RayBatch* rays);
  void add_cut(int sample, const Cut& cut);
  void compose();
  void shade_solid(const SceneView& view, const Shader& shader);
  void shade_batch(const SceneView& view, const Shader& shader, int surface, RayBatch* rays);

  int count_ = 0;
  AlignedVector<float> dx_, dy_, dz_, range_, angle_, share_, light_, left_, seen_range_;
  std::vector<int> pixel_, surface_;
  AlignedVector<float> cut_range_;
  AlignedVector<int> cut_by_;
  std::vector<Cut> cuts_;
  std::vector<int> first_cut_;
  std::vector<int> first_of_surface_;  ///< By view, the sky first: a chain of samples.
  std::vector<int> next_of_surface_;
  std::vector<int> met_;             ///< Surfaces that have a chain.
  std::array<int, kBatch> batch_{};  ///< Samples of the rays in the batch.
};

}  // namespace sovo::sim
