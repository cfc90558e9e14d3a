#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <utility>

namespace sovo::sim {

enum class World {
  kLawn,     ///< Grass seen by someone who walks an 8 m square.
  kPool,     ///< A swimming pool's floor seen by a vehicle that mows it in lanes of 3.6 m.
  kStreet,   ///< Houses, trees and cars along a drive.
  kHall,     ///< A machine hall around a small aircraft.
  kSand,     ///< Sand that a rover drives over.
  kHighway,  ///< A road through open country: asphalt, lines, crash barriers, a far background.
};

/// A side of the pair, or neither.
enum class Side { kNone, kLeft, kRight };

/// Vehicles that move on the road.
enum class Traffic {
  kNone,
  kCar,         ///< A car ahead, at the camera's own speed.
  kLorry,       ///< A lorry close ahead, at the camera's own speed, that hides what is ahead.
  kOvertaking,  ///< Cars overtake.
  kOncoming,    ///< Cars come towards the camera.
  kBusy,        ///< Cars overtake and come towards the camera, and one drives ahead.
};

/// What the cameras see of the vehicle that carries them.
enum class Body {
  kNone,
  kBonnet,  ///< A car's, over the lower fifth of the image.
  kArms,    ///< Two arms with grippers, which reach into the image from its lower corners.
};

/// Of which body a trajectory file's poses are.
enum class TrajectoryBody {
  kAuto,    ///< Found out from the poses, see `load_motion`.
  kCamera,  ///< Left camera: x right, y down, z forward.
  kBase,    ///< Vehicle: x forward, y left, z up.
  kImuXUp,  ///< EuRoC's body: x up, y right, z forward.
};

/// Names of enum values in configuration files, found by argument-dependent lookup.
constexpr std::array<std::pair<World, const char*>, 6> enum_names(World) {
  return {{{World::kLawn, "lawn"},
           {World::kPool, "pool"},
           {World::kStreet, "street"},
           {World::kHall, "hall"},
           {World::kSand, "sand"},
           {World::kHighway, "highway"}}};
}
constexpr const char* name_of(World world) {
  return enum_names(world)[static_cast<std::size_t>(world)].second;
}
constexpr std::array<std::pair<Traffic, const char*>, 6> enum_names(Traffic) {
  return {{{Traffic::kNone, "none"},
           {Traffic::kCar, "car"},
           {Traffic::kLorry, "lorry"},
           {Traffic::kOvertaking, "overtaking"},
           {Traffic::kOncoming, "oncoming"},
           {Traffic::kBusy, "busy"}}};
}
constexpr std::array<std::pair<Body, const char*>, 3> enum_names(Body) {
  return {{{Body::kNone, "none"}, {Body::kBonnet, "bonnet"}, {Body::kArms, "arms"}}};
}
constexpr std::array<std::pair<Side, const char*>, 3> enum_names(Side) {
  return {{{Side::kNone, "none"}, {Side::kLeft, "left"}, {Side::kRight, "right"}}};
}
constexpr std::array<std::pair<TrajectoryBody, const char*>, 4> enum_names(TrajectoryBody) {
  return {{{TrajectoryBody::kAuto, "auto"},
           {TrajectoryBody::kCamera, "camera"},
           {TrajectoryBody::kBase, "base"},
           {TrajectoryBody::kImuXUp, "imu_x_up"}}};
}

/// What two real cameras do to light.
struct SensorConfig {
  bool auto_exposure = true;
  bool shared_exposure = true;
  double exposure_ms = 0.0;
  double gain_db = 0.0;
  double max_exposure_ms = 15.0;
  double max_gain_db = 18.0;
  double target_grey = 105.0;
  double exposure_speed = 0.25;
  double vignette = 0.15;
  double response_gamma = 1.0;
  bool calibrated = true;
  double read_noise = 0.6;
  double shot_noise = 0.8;
  bool motion_blur = true;
  double right_offset_ms = 0.0;
  double right_pitch_deg = 0.0;
  double right_yaw_deg = 0.0;
  double right_roll_deg = 0.0;
  double right_turned_from_s = 0.0;
  double readout_ms = 0.0;
  double veil = 0.0;
  double light_factor = 1.0;
  double light_from_s = 0.0;
  double light_until_s = 1e9;
  double drop_rate = 0.0;
  double gap_s = 0.0;        ///< All pairs of this time are lost,
  double gap_every_s = 4.0;  ///< this often.
  Side dark = Side::kNone;
  double dark_from_s = 0.0;
  double dark_until_s = 1e9;

  template <class Visitor>
  void visit(Visitor& v) {
    v("auto_exposure", auto_exposure, "exposure, then gain, follow the mean grey level");
    v("shared_exposure", shared_exposure, "both cameras expose as the left one does");
    v("exposure_ms", exposure_ms, "exposure without auto_exposure [ms]; 0: what suits the world");
    v("gain_db", gain_db, "gain without auto_exposure [dB]");
    v("max_exposure_ms", max_exposure_ms, "longest exposure that auto_exposure takes [ms]");
    v("max_gain_db", max_gain_db, "largest gain that auto_exposure takes [dB]");
    v("target_grey", target_grey, "mean grey level that auto_exposure aims at");
    v("exposure_speed", exposure_speed, "share of an exposure error mended from frame to frame");
    v("vignette", vignette, "loss of light in the corners, 0 to 0.9");
    v("response_gamma", response_gamma, "grey level = 255 * light ^ (1 / gamma)");
    v("calibrated", calibrated, "response and vignette are part of the calibration");
    v("read_noise", read_noise, "standard deviation in the dark at no gain [grey levels]");
    v("shot_noise", shot_noise, "standard deviation added by light, at full scale [grey levels]");
    v("motion_blur", motion_blur, "blur by motion during the exposure");
    v("right_offset_ms", right_offset_ms, "the right camera exposes later by this [ms]");
    v("right_pitch_deg", right_pitch_deg,
      "the right camera is turned against its calibration, about its x axis [deg]");
    v("right_yaw_deg", right_yaw_deg, "likewise about its y axis [deg]");
    v("right_roll_deg", right_roll_deg, "likewise about its z axis [deg]");
    v("right_turned_from_s", right_turned_from_s, "time from which on it is turned [s]");
    v("readout_ms", readout_ms,
      "rolling shutter: the last row is exposed later than the first by this [ms]; 0: all at once");
    v("veil", veil, "share of the light that fog or turbid water spreads evenly");
    v("light_factor", light_factor, "the world's light changes at once by this factor");
    v("light_from_s", light_from_s, "time from which on it is changed [s]");
    v("light_until_s", light_until_s, "time until which it is changed [s]");
    v("drop_rate", drop_rate, "share of pairs that are lost");
    v("gap_s", gap_s, "time during which all pairs are lost, again and again; 0: never [s]");
    v("gap_every_s", gap_every_s, "time from the beginning of one gap to that of the next [s]");
    v("dark", dark, "camera that goes dark");
    v("dark_from_s", dark_from_s, "time from which on it is dark [s]");
    v("dark_until_s", dark_until_s, "time until which it is dark [s]");
  }
};

/// Lamps of the vehicle, which move with its cameras.
struct LampConfig {
  int count = 0;
  double spacing_m = 0.6;
  double above_m = 0.2;
  double beam_deg = 70.0;
  double ambient = 0.02;
  double ambient_from_s = 0.0;
  double ambient_until_s = 1e9;
  double fade_s = 0.0;
  double backscatter = 0.1;

  template <class Visitor>
  void visit(Visitor& v) {
    v("count", count, "lamps: 0, 1 or 2");
    v("spacing_m", spacing_m, "distance between two lamps [m]");
    v("above_m", above_m, "height of the lamps above the cameras [m]");
    v("beam_deg", beam_deg,
      "angle across a beam within which it has more than half its light [deg]");
    v("ambient", ambient, "share of the world's own light that is left when there are lamps");
    v("ambient_from_s", ambient_from_s, "time from which on no more is left [s]");
    v("ambient_until_s", ambient_until_s, "time at which the world's light returns [s]");
    v("fade_s", fade_s, "time that it takes to go, and to return: one dives, and rises [s]");
    v("backscatter", backscatter, "share of the light lost in haze that comes back");
  }
};

/// Simulated cameras in a world. The file's section has what describes the world and the cameras;
/// which pairs are asked for, and when, is said by who opens the source.
struct SimConfig {
  World world = World::kLawn;
  std::uint64_t seed = 1;
  double frame_rate = 0.0;
  std::string trajectory;
  std::string trajectory_times;
  TrajectoryBody trajectory_body = TrajectoryBody::kAuto;
  Traffic traffic = Traffic::kNone;
  double caustics = 1.0;
  double snow = 0.0;
  bool own_shadow = false;
  Body own_body = Body::kNone;
  int threads = 2;
  LampConfig lamps;
  SensorConfig sensor;

  std::string calibration;  ///< File of the cameras; empty: the world's own.
  int start = 0;            ///< Pairs left out at the beginning.
  int frames = 0;           ///< Pairs at most; 0: to the end of the trajectory.
  double rate = 0.0;        ///< Speed against the world's time; 0: as fast as they are rendered.
  bool reverse = false;     ///< The trajectory is flown backwards.
  bool restamp = false;     ///< Stamps begin now (UTC), not in 2020 or with the trajectory file.
  std::string frame_id = "cam_left_camera_optical_frame";

  template <class Visitor>
  void visit(Visitor& v) {
    v("world", world, "lawn, pool, street, hall, sand or highway");
    v("seed", seed, "of the world and the noise");
    v("frame_rate", frame_rate, "pairs a second of the world's time [Hz]; 0: what suits it");
    v("trajectory", trajectory,
      "one of the world's own by its name, or a file of TUM, EuRoC or KITTI poses; empty: the "
      "world's first");
    v("trajectory_times", trajectory_times, "KITTI times file of the trajectory");
    v("trajectory_body", trajectory_body, "of which body the trajectory file's poses are");
    v("traffic", traffic,
      "vehicles that move on the road: none, car or lorry ahead, overtaking, oncoming, or busy for "
      "all but the lorry");
    v("caustics", caustics,
      "the sun's light that waves throw over the pool's floor, over what suits it; 0: none");
    v("snow", snow,
      "flakes about the cameras, in thousands: in the pool's water they drift within 2 m, "
      "elsewhere "
      "they fall within 4 m");
    v("own_shadow", own_shadow, "a rover carries the cameras, whose shadow moves with them");
    v("own_body", own_body, "what the cameras see of their vehicle: none, bonnet or arms");
    v("threads", threads, "1 or 2: cameras rendered at once; changes no pixel");
    v("lamps", lamps, "lamps of the vehicle, which move with its cameras");
    v("sensor", sensor, "what the cameras do to the light");
  }
};

}  // namespace sovo::sim
