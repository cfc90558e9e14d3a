#pragma once

#include <algorithm>
#include <cstddef>
#include <memory>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/geometry/types.h"

namespace sovo {

/// Rays of a pinhole's pixels that do not meet in its centre, for it is behind a flat port. Knows
/// them at every eighth pixel, for they are asked for by the thousand; copies share that.
class AxialRays {
 public:
  AxialRays() = default;  ///< Of a pinhole without a port.
  /// Of a camera whose image is straightened; none where it has no port.
  static AxialRays of(const CameraModel& camera);

  bool none() const { return grid_ == nullptr; }
  /// Where the ray of a pixel passes the port's normal, from the camera's origin [m]; beyond the
  /// image that of the nearest pixel. Precondition, here and below: there is a port.
  float offset(float u, float v) const {
    // In this order what is no number becomes 0, too.
    const float x = std::min(std::max(0.0F, u * kPerPixel), grid_->last_x);
    const float y = std::min(std::max(0.0F, v * kPerPixel), grid_->last_y);
    const auto i = static_cast<std::size_t>(x);
    const auto j = static_cast<std::size_t>(y);
    const float* at = grid_->offsets.data() + j * grid_->columns + i;
    const float fx = x - static_cast<float>(i);
    const float upper = at[0] + fx * (at[1] - at[0]);
    const float lower = at[grid_->columns] + fx * (at[grid_->columns + 1] - at[grid_->columns]);
    return upper + (y - static_cast<float>(j)) * (lower - upper);
  }
  const Vec3& normal() const { return grid_->normal; }
  /// No ray passes farther from another one [m].
  double reach() const { return grid_->reach; }

 private:
  static constexpr float kPerPixel = 0.125F;
  struct Grid {
    Vec3 normal = Vec3::UnitZ();
    double reach = 0.0;
    std::size_t columns = 0;
    float last_x = 0.0F, last_y = 0.0F;  ///< Farthest with a node to its right, or below.
    std::vector<float> offsets;          ///< Rows first [m].
  };
  std::shared_ptr<const Grid> grid_;
};

/// What makes a point that is at X in the camera at the image's instant be seen as if it were at
/// X + at(u, v), in the camera's axes, where it is seen at (u, v): the straight way of the camera
/// while the image is read out row after row, and a flat port.
struct ViewShift {
  Vec3 per_row = Vec3::Zero();  ///< Of a rolling shutter [the map's unit of length].
  double middle = 0.0;          ///< Row of the image's instant [px].
  AxialRays axial = {};         ///< Of a flat port; the map's unit is then a metre.

  Vec3 at(double u, double v) const {
    const Vec3 way = (v - middle) * per_row;
    if (axial.none()) return way;
    return way -
           double{axial.offset(static_cast<float>(u), static_cast<float>(v))} * axial.normal();
  }
  bool none() const { return per_row.isZero(0.0) && axial.none(); }
};

/// The same for a point that one image of a camera shows and another one is to show: what it adds
/// to the translation of T_target_host. It turns and stretches that way, as a matrix that is
/// constant for a pixel of the host and one of the target: were it a constant of its own, a map
/// would take another scale only to be moved less.
class PairViewShift {
 public:
  PairViewShift() = default;
  /// By the poses at which the images' shifts are known.
  PairViewShift(const SE3& T_target_host, const ViewShift& host, const ViewShift& target);

  bool none() const { return none_; }

  /// Of what is in one pixel of the host and in one of the target.
  struct Displacement {
    float share = 0.0F;
    Eigen::Vector3f across = Eigen::Vector3f::Zero();  ///< At the poses' own translation.
    Eigen::Vector3f along = Eigen::Vector3f::Zero();   ///< That translation over its square.
    Eigen::Vector3f fixed = Eigen::Vector3f::Zero();

    /// Translation that a point is seen by.
    Eigen::Vector3f applied(const Eigen::Vector3f& t) const {
      return (1.0F + share) * t + along.dot(t) * across + fixed;
    }
    /// d r / d t where `d` is d r / d (applied t).
    Eigen::Vector3f chain(const Eigen::Vector3f& d) const {
      return (1.0F + share) * d + d.dot(across) * along;
    }
  };
  Displacement at(const Eigen::Vector2f& host_pixel, const Eigen::Vector2f& target_pixel) const;
  /// The same where the target's pixel, which is looked for in the image of that size, is given by
  /// homogeneous coordinates; the host's one counts where it is behind the camera.
  Displacement at(const Eigen::Vector2f& host_pixel, const Eigen::Vector3f& seen, int width,
                  int height) const;

 private:
  /// What a weight of one adds.
  struct Part {
    float share = 0.0F;
    Eigen::Vector3f across = Eigen::Vector3f::Zero(), fixed = Eigen::Vector3f::Zero();
  };
  static Part split(const Vec3& direction, const Vec3& t, double most);
  void add(const Part& part, float weight, Displacement* to) const;

  Part host_, target_;              ///< Of a row.
  Part host_axial_, target_axial_;  ///< Of a metre along the port's normal.
  AxialRays host_rays_, target_rays_;
  Eigen::Vector3f along_ = Eigen::Vector3f::Zero();
  float middle_ = 0.0F;
  bool none_ = true;
};

}  // namespace sovo
