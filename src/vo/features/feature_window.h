#pragma once

#include <cstdint>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/geometry/view_shift.h"
#include "sovo/image/pyramid.h"
#include "sovo/vo/keyframe_poses.h"

namespace sovo {

/// Where a landmark was found in a keyframe that does not host it.
struct Observation {
  std::uint32_t keyframe_id = 0;
  Vec2 pixel = Vec2::Zero();  ///< At the keyframe's instant.
  double sigma = 1.0;         ///< Standard deviation of each coordinate [px].
  bool inlier = true;
};

/// A corner of a keyframe, its host, and where others saw it.
struct FeatureLandmark {
  std::uint64_t id = 0;
  std::uint32_t host_id = 0;
  float u = 0.0F, v = 0.0F;  ///< In the host's level 0 [px].
  Vec3 ray = Vec3::UnitZ();  ///< Of that pixel at the host's instant, z = 1.
  bool has_depth = false;
  double rho = 0.0;           ///< Inverse depth in the host [1/m].
  double static_sigma = 0.0;  ///< Of the match that gave rho first [1/m]; 0: none.
  double information = 0.0;   ///< On rho, by its observations with all poses held.
  double parallax = 0.0;      ///< Farthest that an observation lies from the infinite point's [px].
  bool in_snapshot = false;   ///< Of the newest keyframe but one.
  bool remove = false;
  std::vector<Observation> observations;  ///< By ascending keyframe.

  /// In the keyframe, or null.
  const Observation* seen_in(std::uint32_t keyframe_id) const;
  int num_inliers() const;
  /// Standard deviation of rho: by parallax, or by the match where there is little; infinite where
  /// nothing is known.
  double sigma(double min_parallax) const;
};

struct FeatureKeyframe {
  std::uint32_t id = 0;
  std::int64_t stamp_ns = 0;
  ImagePyramidPtr pyramid;
  SE3 T_camera_world;
  ViewShift shift;  ///< Of a rolling shutter and a port.
};

/// Sliding window of keyframes with landmarks. Keyframes have consecutive ids; the oldest leave.
struct FeatureWindow {
  CameraModel camera;  ///< Pinhole without distortion.
  std::vector<FeatureKeyframe> keyframes;
  std::vector<FeatureLandmark> landmarks;

  std::size_t index_of(std::uint32_t keyframe_id) const {
    return keyframe_id - keyframes.front().id;
  }
  const FeatureKeyframe& keyframe(std::uint32_t id) const { return keyframes[index_of(id)]; }
  const FeatureKeyframe& newest() const { return keyframes.back(); }
  SE3 T_target_host(std::uint32_t target_id, std::uint32_t host_id) const {
    return keyframe(target_id).T_camera_world * keyframe(host_id).T_camera_world.inverse();
  }

  /// Of the landmarks with depth; 1 where there is none.
  double mean_inverse_depth() const;
  int num_with_depth() const;
  std::vector<WindowPose> poses() const;

  void erase_marked();

  /// Removes the oldest keyframe, what it hosts and what it saw.
  void drop_oldest();

  /// Multiplies all lengths by `scale`; the newest keyframe's camera centre stays.
  void apply_similarity(double scale);
};

}  // namespace sovo
