#include "sovo/driver/sim/traffic.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <optional>
#include <utility>

namespace sovo::sim {
namespace {

/// The way of a motion over the ground, with straight ends, and how far along it the camera is.
class GroundTrack {
 public:
  explicit GroundTrack(const Motion& motion) {
    std::vector<WayPoint> way;
    const double first = static_cast<double>(motion.first_ns());
    double s = 0.0;
    for (const StampedPose& pose : motion.samples()) {
      const Vec3& p = pose.T_world_body.translation();
      if (!way.empty()) s = way.back().s + std::hypot(p.x() - way.back().x, p.y() - way.back().y);
      times_.push_back(1e-9 * (static_cast<double>(pose.stamp_ns) - first));
      ways_.push_back(s);
      // Points that are close together would give the noise of their heights as headings.
      if (way.empty() || s - way.back().s > kStep) way.push_back({s, p.x(), p.y(), 0.0});
    }
    const Vec3 ahead = motion.samples().front().T_world_body.rotation() * Vec3::UnitZ();
    if (way.size() < 2) {
      way.push_back({way[0].s + kStep, way[0].x + kStep * ahead.x(), way[0].y + kStep * ahead.y()});
    }
    const WayPoint before = beyond(way[1], way[0], kEnds);
    const WayPoint after = beyond(way[way.size() - 2], way.back(), kEnds);
    way_.push_back(before);
    way_.insert(way_.end(), way.begin(), way.end());
    way_.push_back(after);
  }

  /// Where the camera is after `t` seconds [m].
  double camera_at(double t) const {
    const auto next = std::upper_bound(times_.begin(), times_.end(), t);
    if (next == times_.begin()) return ways_.front();
    if (next == times_.end()) return ways_.back();
    const auto i = static_cast<std::size_t>(next - times_.begin());
    const double w = (t - times_[i - 1]) / (times_[i] - times_[i - 1]);
    return ways_[i - 1] + w * (ways_[i] - ways_[i - 1]);
  }

  double length() const { return ways_.back(); }

  /// T_world_vehicle of a vehicle with its middle at `s`, `left` of the way, seen along it or
  /// (`towards`) against it; nothing beyond both ends.
  std::optional<SE3> pose_at(double s, double left, bool towards) const {
    constexpr double kAxle = 1.3;  // from the middle to either axle [m]
    if (s - kAxle < way_.front().s || s + kAxle > way_.back().s) return std::nullopt;
    const WayPoint rear = place_on(way_, s - kAxle);
    const WayPoint front = place_on(way_, s + kAxle);
    const double yaw = std::atan2(front.y - rear.y, front.x - rear.x);
    const Vec3 middle(0.5 * (rear.x + front.x) - left * std::sin(yaw),
                      0.5 * (rear.y + front.y) + left * std::cos(yaw), 0.0);
    return SE3(SO3::exp(Vec3(0, 0, towards ? yaw + std::numbers::pi : yaw)), middle);
  }

 private:
  static constexpr double kStep = 1.0;    ///< Between points of the way [m].
  static constexpr double kEnds = 200.0;  ///< Length of its straight ends [m].

  /// The point `length` beyond `b` on the line from `a`.
  static WayPoint beyond(const WayPoint& a, const WayPoint& b, double length) {
    const double w = length / std::abs(b.s - a.s);
    return {b.s + (b.s - a.s) * w, b.x + (b.x - a.x) * w, b.y + (b.y - a.y) * w, 0.0};
  }

  std::vector<double> times_;  ///< Of the motion's samples [s].
  std::vector<double> ways_;   ///< [m]
  std::vector<WayPoint> way_;
};

using Place = std::function<std::optional<SE3>(double t)>;

class TrafficBuilder {
 public:
  TrafficBuilder(const Motion& motion, const Lanes& lanes, const TrafficMaterials& materials,
                 SceneBuilder& b)
      : lanes_(lanes),
        m_(materials),
        b_(b),
        track_(std::make_shared<const GroundTrack>(motion)),
        duration_(motion.duration_s()) {}

  /// At the camera's own speed, its rear `gap` ahead.
  void car_ahead(double gap) { add_car_at(0, ahead(gap + 2.1)); }

  void lorry_ahead(double gap) {
    const auto first = b_.scene().surfaces.size();
    add_lorry(b_, {m_.lorry_paint, m_.glass, m_.shadow}, Vec3::Zero(), 0.0);
    let_move(first, ahead(gap + 4.0));
  }

  /// Cars that overtake the camera on its left, `apart`.
  void overtaking(double apart) {
    const double faster = lanes_.faster;
    const int count = static_cast<int>(faster * duration_ / apart) + 1;
    for (int k = 0; k < count; ++k) {
      const double behind = apart * (k + 0.4);
      add_car_at(k, [track = track_, lane = lanes_.other, behind, faster](double t) {
        return track->pose_at(track->camera_at(t) - behind + faster * t, lane, false);
      });
    }
  }

  /// Cars that come towards the camera on its left, `apart`.
  void oncoming(double apart) {
    const double speed = lanes_.oncoming_speed;
    const int count = static_cast<int>((track_->length() + speed * duration_) / apart) + 1;
    for (int k = 0; k < count; ++k) {
      const double begin = apart * (k + 0.8);
      add_car_at(k, [track = track_, lane = lanes_.oncoming, begin, speed](double t) {
        return track->pose_at(begin - speed * t, lane, true);
      });
    }
  }

 private:
  Place ahead(double distance) const {
    return [track = track_, distance](double t) {
      return track->pose_at(track->camera_at(t) + distance, 0.0, false);
    };
  }

  void add_car_at(int k, Place place) {
    const auto paint = static_cast<std::size_t>(k) % m_.car_paints.size();
    const auto first = b_.scene().surfaces.size();
    add_car(b_, {m_.car_paints[paint], m_.glass, m_.shadow}, Vec3(0, 0, 0.12), 0.0);
    let_move(first, std::move(place));
  }

  void let_move(std::size_t first, Place place) {
    b_.scene().movers.push_back({first, b_.scene().surfaces.size(), std::move(place)});
  }

  Lanes lanes_;
  const TrafficMaterials& m_;
  SceneBuilder& b_;
  std::shared_ptr<const GroundTrack> track_;
  double duration_;
};

}  // namespace

void add_traffic(Traffic traffic, const Motion& motion, const Lanes& lanes,
                 const TrafficMaterials& materials, SceneBuilder& b) {
  TrafficBuilder builder(motion, lanes, materials, b);
  switch (traffic) {
    case Traffic::kNone:
      return;
    case Traffic::kCar:
      return builder.car_ahead(9.0);
    case Traffic::kLorry:
      return builder.lorry_ahead(7.0);
    case Traffic::kOvertaking:
      return builder.overtaking(30.0);
    case Traffic::kOncoming:
      return builder.oncoming(40.0);
    case Traffic::kBusy:
      builder.car_ahead(20.0);
      builder.overtaking(45.0);
      return builder.oncoming(60.0);
  }
}

}  // namespace sovo::sim
