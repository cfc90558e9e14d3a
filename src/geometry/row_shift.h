#pragma once

#include "sovo/geometry/se3.h"
#include "sovo/geometry/types.h"

namespace sovo {

/// What a straight way does to an image that is read out row after row: a point that is at X in the
/// camera at the image's instant is seen at X + at(v) in row v, in the camera's axes.
struct RowShift {
  Vec3 per_row = Vec3::Zero();  ///< [the map's unit of length]
  double middle = 0.0;          ///< Row of the image's instant [px].

  Vec3 at(double v) const { return (v - middle) * per_row; }
  bool none() const { return per_row.isZero(0.0); }
};

/// The same for a point that one image of a camera shows and another one is to show: what it adds
/// to the translation of T_target_host. It turns and stretches that way, as a matrix that is
/// constant for a row of the host and one of the target: were it a constant of its own, a map would
/// take another scale only to be moved less.
class PairRowShift {
 public:
  PairRowShift() = default;
  /// By the poses at which the rows' shifts are known.
  PairRowShift(const SE3& T_target_host, const RowShift& host_rows, const RowShift& target_rows);

  bool none() const { return none_; }
  float middle() const { return middle_; }  ///< Row of the images' instants [px].

  /// Of what is in one row of the host and in one of the target.
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
  Displacement at(float host_row, float target_row) const {
    const float h = host_row - middle_;
    const float t = target_row - middle_;
    return {h * host_.share + t * target_.share, h * host_.across + t * target_.across, along_,
            h * host_.fixed + t * target_.fixed};
  }

 private:
  /// Of one row.
  struct Part {
    float share = 0.0F;
    Eigen::Vector3f across = Eigen::Vector3f::Zero(), fixed = Eigen::Vector3f::Zero();
  };
  static Part split(const Vec3& per_row, const Vec3& t, double rows);

  Part host_, target_;
  Eigen::Vector3f along_ = Eigen::Vector3f::Zero();
  float middle_ = 0.0F;
  bool none_ = true;
};

}  // namespace sovo
