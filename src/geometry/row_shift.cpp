#include "sovo/geometry/row_shift.h"

namespace sovo {

PairRowShift::PairRowShift(const SE3& T_target_host, const RowShift& host_rows,
                           const RowShift& target_rows)
    : middle_(static_cast<float>(target_rows.middle)),
      none_(host_rows.none() && target_rows.none()) {
  if (none_) return;
  const Vec3& t = T_target_host.translation();
  const double rows = 2.0 * target_rows.middle;
  host_ = split(-(T_target_host.rotation() * host_rows.per_row), t, rows);
  target_ = split(target_rows.per_row, t, rows);
  if (t.squaredNorm() > 0.0) along_ = (t / t.squaredNorm()).cast<float>();
}

PairRowShift::Part PairRowShift::split(const Vec3& per_row, const Vec3& t, double rows) {
  // A way that is no longer than what is added to it says nothing of that.
  if (!(t.norm() > rows * per_row.norm()))
    return {0.0F, Eigen::Vector3f::Zero(), per_row.cast<float>()};
  const double share = per_row.dot(t) / t.squaredNorm();
  return {static_cast<float>(share), (per_row - share * t).cast<float>(), Eigen::Vector3f::Zero()};
}

}  // namespace sovo
