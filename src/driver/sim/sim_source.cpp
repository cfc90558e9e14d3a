#include "sovo/driver/sim/sim_source.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <thread>
#include <utility>

#include "sovo/driver/sim/random.h"

namespace sovo::sim {
namespace {

constexpr std::uint8_t kHostClock = 0;

std::int64_t utc_now_ns() {
  const auto now = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::nanoseconds>(now).count();
}

/// Whether `t` seconds after the first pair lie in one of the regular gaps, or on its first edge.
bool in_gap(const SensorConfig& sensor, double t) {
  constexpr double kEdge = 1e-6;
  if (!(sensor.gap_s > 0.0) || t + kEdge < sensor.gap_every_s) return false;
  return std::fmod(t + kEdge, sensor.gap_every_s) < sensor.gap_s;
}

/// Pairs of the trajectory that the configuration asks for and that are not dropped.
std::vector<std::size_t> choose_pairs(const SimConfig& config, const Motion& motion, double rate) {
  const auto start = static_cast<std::size_t>(config.start);
  const double span = std::max(0.0, motion.duration_s() - config.start / rate);
  auto count = static_cast<std::size_t>(std::floor(span * rate + 1e-6)) + 1;
  if (config.frames > 0) count = std::min(count, static_cast<std::size_t>(config.frames));
  std::vector<std::size_t> pairs;
  for (std::size_t i = start; i < start + count; ++i) {
    // The first pair is never dropped.
    const bool dropped = i > start && unit(combine(config.seed + 77, i)) < config.sensor.drop_rate;
    const double t = static_cast<double>(i - start) / rate;
    if (!dropped && !in_gap(config.sensor, t)) pairs.push_back(i);
  }
  return pairs;
}

/// Velocity of the camera in its own frame: linear, angular.
Vec6 velocity_of(const SE3& before, const SE3& after, double dt) {
  Vec6 velocity;
  velocity.head<3>() =
      before.rotation().inverse() * (after.translation() - before.translation()) / dt;
  velocity.tail<3>() = (before.rotation().inverse() * after.rotation()).log() / dt;
  return velocity;
}

/// One of the world's own trajectories, or a file.
Result<Motion> find_motion(const SimConfig& config, const StereoRig& rig) {
  const auto names = own_trajectories(config.world);
  const bool own = config.trajectory.empty() ||
                   std::find(names.begin(), names.end(), config.trajectory) != names.end();
  if (own) return own_motion(config.world, config.trajectory);
  auto motion = load_motion(config, rig);
  if (motion) return motion;
  std::string known;
  for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
  return Error{motion.error() + "; the world's own trajectories are: " + known};
}

OwnBody own_body(const SimConfig& config, const StereoRig& rig, Side side, double haze,
                 const RayTable& rays) {
  if (config.own_body == Body::kNone) return {};
  return {config.own_body, rig, side, rays, place_lamps(config.lamps, rig, side, haze)};
}

/// Flakes of marine snow, more of what drifts in the pool anyway, or of snow that falls.
void let_it_snow(double thousands, std::uint64_t seed, Scene* scene) {
  if (thousands <= 0.0) return;
  Particles& p = scene->particles;
  if (p.count == 0) p = {0, 8.0, 0.004, 0.9F, {0.4, 0.15, -1.2}, combine(seed, 24)};
  p.count += static_cast<int>(std::lround(1000.0 * thousands));
}

/// The world as the configuration has it.
Scene scene_of(const SimConfig& config, const Motion& motion) {
  Scene scene = build_scene(config.world, motion, config.seed, config.traffic);
  scene.caustic_strength *= static_cast<float>(config.caustics);
  let_it_snow(config.snow, config.seed, &scene);
  return scene;
}

OwnShadow own_shadow(const SimConfig& config, const StereoRig& rig, Side side) {
  return config.own_shadow ? OwnShadow(rig, side) : OwnShadow();
}

Result<void> check_lamps(const LampConfig& lamps) {
  if (lamps.count < 0 || lamps.count > 2) return Error{"lamps.count must be 0, 1 or 2"};
  if (!(lamps.spacing_m >= 0.0 && lamps.spacing_m <= 10.0)) {
    return Error{"lamps.spacing_m must be in [0, 10]"};
  }
  if (!(std::abs(lamps.above_m) <= 10.0)) return Error{"lamps.above_m must be in [-10, 10]"};
  if (!(lamps.beam_deg >= 5.0 && lamps.beam_deg <= 180.0)) {
    return Error{"lamps.beam_deg must be in [5, 180]"};
  }
  if (!(lamps.ambient >= 0.0 && lamps.ambient <= 1.0)) {
    return Error{"lamps.ambient must be in [0, 1]"};
  }
  if (!(lamps.ambient_from_s >= 0.0 && lamps.ambient_until_s >= lamps.ambient_from_s)) {
    return Error{
        "lamps.ambient_until_s must not be before lamps.ambient_from_s, nor that before 0"};
  }
  if (!(lamps.fade_s >= 0.0 && lamps.fade_s <= 1e6)) {
    return Error{"lamps.fade_s must be in [0, 1e6]"};
  }
  if (!(lamps.backscatter >= 0.0 && lamps.backscatter <= 1.0)) {
    return Error{"lamps.backscatter must be in [0, 1]"};
  }
  return {};
}

Result<void> check(const SimConfig& config) {
  if (const auto valid = check_lamps(config.lamps); !valid) return valid;
  const SensorConfig& s = config.sensor;
  if (config.frames < 0) return Error{"frames must not be negative"};
  if (config.frame_rate < 0.0 || config.frame_rate > 1000.0) {
    return Error{"frame_rate must be at most 1000 Hz, or 0 for the world's own"};
  }
  if (!(config.caustics >= 0.0 && config.caustics <= 5.0)) {
    return Error{"caustics must be in [0, 5]"};
  }
  if (!(config.snow >= 0.0 && config.snow <= 1000.0)) return Error{"snow must be in [0, 1000]"};
  const bool road = config.world == World::kStreet || config.world == World::kHighway;
  if (config.traffic != Traffic::kNone && !road) {
    return Error{
        "there is traffic in the street and on the highway only; leave it at none, or choose one "
        "of those worlds"};
  }
  if (config.start < 0) return Error{"start must not be negative"};
  if (!(s.veil >= 0.0 && s.veil <= 0.99)) return Error{"sensor.veil must be in [0, 0.99]"};
  if (!(s.light_factor >= 0.01 && s.light_factor <= 100.0)) {
    return Error{"sensor.light_factor must be in [0.01, 100]"};
  }
  if (s.vignette < 0.0 || s.vignette > 0.9) return Error{"sensor.vignette must be in [0, 0.9]"};
  if (!(s.response_gamma >= 0.2 && s.response_gamma <= 5.0)) {
    return Error{"sensor.response_gamma must be in [0.2, 5]"};
  }
  if (s.drop_rate < 0.0 || s.drop_rate > 0.95)
    return Error{"sensor.drop_rate must be in [0, 0.95]"};
  if (!(s.gap_s >= 0.0 && (s.gap_s == 0.0 || s.gap_s < s.gap_every_s))) {
    return Error{"sensor.gap_s must be below sensor.gap_every_s"};
  }
  if (!(s.readout_ms >= 0.0 && s.readout_ms <= 1000.0)) {
    return Error{"sensor.readout_ms must be in [0, 1000]"};
  }
  for (const double degrees : {s.right_pitch_deg, s.right_yaw_deg, s.right_roll_deg}) {
    if (!(std::abs(degrees) <= 20.0)) {
      return Error{"sensor.right_pitch_deg, right_yaw_deg and right_roll_deg must be in [-20, 20]"};
    }
  }
  if (!(s.max_exposure_ms > 0.0)) return Error{"sensor.max_exposure_ms must be positive"};
  if (s.read_noise < 0.0 || s.shot_noise < 0.0) return Error{"noise must not be negative"};
  return {};
}

}  // namespace

SimSource::SimSource(const SimConfig& config, Calibration calibration, Motion motion)
    : config_(config),
      calibration_(std::move(calibration)),
      motion_(std::move(motion)),
      scene_(scene_of(config, motion_)),
      frame_rate_(config.frame_rate > 0.0 ? config.frame_rate : own_frame_rate(config.world)),
      delivered_(choose_pairs(config, motion_, frame_rate_)),
      left_(scene_, calibration_.rig.left,
            place_lamps(config.lamps, calibration_.rig, Side::kLeft, scene_.haze),
            own_shadow(config, calibration_.rig, Side::kLeft)),
      right_(scene_, calibration_.rig.right,
             place_lamps(config.lamps, calibration_.rig, Side::kRight, scene_.haze),
             own_shadow(config, calibration_.rig, Side::kRight)),
      left_body_(own_body(config, calibration_.rig, Side::kLeft, scene_.haze, left_.rays())),
      right_body_(own_body(config, calibration_.rig, Side::kRight, scene_.haze, right_.rays())),
      truth_(scene_, calibration_.rig.left),
      left_sensor_(config.sensor, calibration_.rig.left.width, calibration_.rig.left.height),
      right_sensor_(config.sensor, calibration_.rig.right.width, calibration_.rig.right.height),
      left_exposure_(config.sensor, scene_.exposure_s),
      right_exposure_(config.sensor, scene_.exposure_s) {
  calibration_.left_photometric = left_sensor_.photometric();
  calibration_.right_photometric = right_sensor_.photometric();
  decoder_ = std::make_unique<FrameDecoder>(delivered_.size(),
                                            [this](std::size_t n) { return render(n); });
}

/// Time since the trajectory began [s].
double SimSource::time_of(std::size_t index) const {
  return static_cast<double>(index) / frame_rate_;
}

std::int64_t SimSource::stamp_of(std::size_t index) const {
  return motion_.first_ns() + static_cast<std::int64_t>(std::llround(1e9 * time_of(index)));
}

/// Time on the trajectory at a stamp that was not shifted [s].
double SimSource::world_time(std::int64_t stamp_ns) const {
  const double t = 1e-9 * static_cast<double>(stamp_ns - motion_.first_ns());
  return config_.reverse ? motion_.duration_s() - t : t;
}

SE3 SimSource::pose_at(std::int64_t stamp_ns) const {
  return motion_.at(world_time(stamp_ns - shift_ns_));
}

std::int64_t SimSource::original_stamp(std::int64_t fed) const {
  const std::int64_t stamp = fed - shift_ns_;
  return config_.reverse ? motion_.first_ns() + motion_.last_ns() - stamp : stamp;
}

Trajectory SimSource::truth() const {
  Trajectory poses;
  for (const std::size_t index : delivered_) {
    const std::int64_t stamp = stamp_of(index) + shift_ns_;
    poses.push_back({stamp, pose_at(stamp)});
  }
  return poses;
}

/// Where a camera is at a time of the trajectory [s].
SE3 SimSource::camera_at(Side which, double t) const {
  if (which == Side::kLeft) return motion_.at(t);
  const SensorConfig& s = config_.sensor;
  const Vec3 degrees(s.right_pitch_deg, s.right_yaw_deg, s.right_roll_deg);
  const bool turned = t >= s.right_turned_from_s;
  const SO3 turn = turned ? SO3::exp(M_PI / 180.0 * degrees) : SO3();
  return motion_.at(t) * calibration_.rig.turned(turn).T_right_left.inverse();
}

/// What a camera sees at a time of the trajectory [s], which is that of its middle row.
void SimSource::take(Renderer* renderer, Side which, double t, RenderedImage* image) const {
  const double readout_s = 1e-3 * config_.sensor.readout_ms;
  if (readout_s == 0.0) {
    renderer->render(camera_at(which, t), t, image);
    return;
  }
  const int last_row = renderer->rays().camera().height - 1;
  const double row_s = (config_.reverse ? -readout_s : readout_s) / last_row;
  const auto view_of = [&](double row) {
    const double at = t + (row - 0.5 * last_row) * row_s;
    return Renderer::View{camera_at(which, at), at};
  };
  renderer->render_rolling(view_of, image);
}

SideImage SimSource::make_side(Side which, double t, std::uint64_t frame, Renderer* renderer,
                               ExposureControl* exposure, const Sensor& sensor) const {
  const double along = config_.reverse ? -1.0 : 1.0;
  const double since = time_of(frame);
  const float share = share_of_daylight(config_.lamps, since);
  renderer->set_daylight(share);
  RenderedImage image;
  take(renderer, which, t, &image);
  change_light(config_.sensor, since, &image.light);
  const OwnBody& body = which == Side::kLeft ? left_body_ : right_body_;
  const Vec3 to_sun = camera_at(which, t).rotation().inverse() * scene_.to_sun;
  const OwnBody::Daylight daylight{to_sun.cast<float>(), share * scene_.ambient, share * scene_.sun,
                                   light_factor(config_.sensor, since)};
  if (!settled_) {
    ImageF whole = image.light;
    body.draw(daylight, &whole);
    exposure->settle(whole);
  }
  ImageF blurred;
  if (config_.sensor.motion_blur) {
    constexpr double h = 2e-3;
    const Vec6 velocity =
        along * velocity_of(camera_at(which, t - h), camera_at(which, t + h), 2.0 * h);
    blur_by_motion(renderer->rays(), image, velocity, exposure->exposure_s(), &blurred);
  }
  const bool dark = config_.sensor.dark == which && since >= config_.sensor.dark_from_s &&
                    since < config_.sensor.dark_until_s;
  const std::uint64_t seed =
      combine(combine(config_.seed, frame), which == Side::kLeft ? 101U : 202U);
  ImageF& light = config_.sensor.motion_blur ? blurred : image.light;
  body.draw(daylight, &light);  // at rest before the camera: not blurred
  SideImage side;
  side.valid = true;
  side.width = light.width();
  side.height = light.height();
  side.step = light.width();
  side.data = std::make_shared<const std::vector<std::uint8_t>>(
      sensor.expose(light, *exposure, dark, seed));
  side.exposure_s = static_cast<float>(exposure->exposure_s());
  side.gain_db = static_cast<float>(exposure->gain_db());
  return side;
}

SourceResult SimSource::render(std::size_t n) {
  const std::size_t index = delivered_[n];
  const std::int64_t stamp = stamp_of(index);
  const double t = world_time(stamp);
  const double offset_s = 1e-3 * config_.sensor.right_offset_ms;
  SourceResult result;
  result.state = SourceState::kFrame;
  StereoFrame& frame = result.frame;
  frame.stamp_ns = stamp;
  frame.sequence = index;
  frame.clock = kHostClock;
  frame.pair_error_s = std::abs(offset_s);
  frame.frame_id = config_.frame_id;
  const auto left = [&] {
    return make_side(Side::kLeft, t, index, &left_, &left_exposure_, left_sensor_);
  };
  const auto right = [&] {
    const double later = config_.reverse ? t - offset_s : t + offset_s;
    return make_side(Side::kRight, later, index, &right_, &right_exposure_, right_sensor_);
  };
  // With one exposure for both, the first pair must know the left one's before the right is taken.
  const bool at_once = config_.threads > 1 && (settled_ || !config_.sensor.shared_exposure);
  if (at_once) {
    auto other = std::async(std::launch::async, right);
    frame.left = left();
    frame.right = other.get();
  } else {
    frame.left = left();
    if (config_.sensor.shared_exposure) {
      right_exposure_ = left_exposure_;
      settled_ = true;
    }
    frame.right = right();
  }
  settled_ = true;
  frame.right.stamp_offset_ns = static_cast<std::int64_t>(std::llround(1e9 * offset_s));
  left_exposure_.observe(*frame.left.data);
  right_exposure_.observe(*frame.right.data);
  if (config_.sensor.shared_exposure) right_exposure_ = left_exposure_;
  return result;
}

void SimSource::begin() {
  if (std::exchange(begun_, true)) return;
  start_ = std::chrono::steady_clock::now();
  if (config_.restamp) shift_ns_ = utc_now_ns() - stamp_of(delivered_.front());
}

SourceResult SimSource::next(std::chrono::milliseconds timeout) {
  begin();
  constexpr std::chrono::milliseconds kLongest = std::chrono::hours(24);
  const auto deadline = std::chrono::steady_clock::now() + std::min(timeout, kLongest);
  if (!waiting_) {
    SourceResult result = decoder_->next(deadline);
    if (result.state != SourceState::kFrame) return result;
    result.frame.stamp_ns += shift_ns_;
    waiting_ = std::move(result);
  }
  if (config_.rate > 0.0) {
    const std::int64_t since_first =
        waiting_->frame.stamp_ns - shift_ns_ - stamp_of(delivered_.front());
    const std::chrono::nanoseconds since(
        std::llround(static_cast<double>(since_first) / config_.rate));
    const auto due = start_ + since;
    std::this_thread::sleep_until(std::min(due, deadline));
    if (deadline < due) return {};
  }
  SourceResult result = std::move(*waiting_);
  waiting_.reset();
  return result;
}

ImageF SimSource::depth_at(std::int64_t stamp_ns) {
  RenderedImage image;
  const double t = world_time(stamp_ns - shift_ns_);
  truth_.render(motion_.at(t), t, &image);
  left_body_.cover(&image.range);
  ImageF depth(image.range.width(), image.range.height());
  for (int y = 0; y < depth.height(); ++y) {
    for (int x = 0; x < depth.width(); ++x) {
      const float range = image.range.at(x, y);
      depth.at(x, y) = std::isfinite(range) ? range * truth_.rays().ray(x, y).z() : 0.0F;
    }
  }
  return depth;
}

std::vector<float> SimSource::depth_at(std::int64_t stamp_ns, const std::vector<Vec2>& pixels) {
  RenderedImage image;
  const double t = world_time(stamp_ns - shift_ns_);
  truth_.render(motion_.at(t), t, &image);
  std::vector<float> depths;
  for (const Vec2& pixel : pixels) {
    const auto ray = calibration_.rig.left.unproject(pixel);
    const float range = left_body_.range_at(pixel).value_or(truth_.range_at(pixel));
    const bool seen = ray && std::isfinite(range);
    depths.push_back(seen ? range * static_cast<float>(ray->z()) : 0.0F);
  }
  return depths;
}

Result<std::unique_ptr<SimSource>> open_sim(const SimConfig& config) {
  if (const auto valid = check(config); !valid) return valid.failure();
  Calibration calibration;
  calibration.rig = own_rig(config.world);
  calibration.format = "simulated";
  if (!config.calibration.empty()) {
    auto loaded = load_calibration(config.calibration);
    if (!loaded) return loaded.failure();
    calibration = std::move(*loaded);
    const StereoRig& rig = calibration.rig;
    if (rig.left.width < 16 || rig.left.height < 16 || rig.right.width < 16 ||
        rig.right.height < 16) {
      return Error{config.calibration + ": has no image size; give a calibration that has one"};
    }
  }
  auto motion = find_motion(config, calibration.rig);
  if (!motion) return motion.failure();
  const double rate = config.frame_rate > 0.0 ? config.frame_rate : own_frame_rate(config.world);
  if (config.start / rate > motion->duration_s()) {
    return Error{"the trajectory ends after " + std::to_string(motion->duration_s()) +
                 " s; there is no pair " + std::to_string(config.start)};
  }
  return std::make_unique<SimSource>(config, std::move(calibration), std::move(*motion));
}

}  // namespace sovo::sim
