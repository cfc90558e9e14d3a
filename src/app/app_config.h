#pragma once

#include <array>
#include <string>
#include <utility>

#include "sovo/bridge/dds_config.h"
#include "sovo/bridge/recorder_config.h"
#include "sovo/driver/aravis/aravis_options.h"
#include "sovo/driver/live/live_options.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/driver/v4l2/v4l2_options.h"
#include "sovo/loop/loop_closer.h"
#include "sovo/odometry/stereo_odometry.h"

namespace sovo::app {

/// Sets of values for a purpose; what the user names still wins.
enum class Preset {
  kEmbedded,  ///< Small computers: 800 points, 5 keyframes.
  kDefault,   ///< 2000 points, 7 keyframes.
  kQuality,   ///< The same with more new points and iterations, and static residuals (mode stereo).
};

/// What the inner loops must compute. There is one answer: whatever registers they use, they give
/// the bits of scalar code.
enum class Kernels {
  kAuto,    ///< By the widest registers that this machine has.
  kScalar,  ///< The bits of scalar code, which is the same.
};

constexpr std::array<std::pair<Preset, const char*>, 3> enum_names(Preset) {
  return {{{Preset::kEmbedded, "embedded"},
           {Preset::kDefault, "default"},
           {Preset::kQuality, "quality"}}};
}
constexpr std::array<std::pair<Kernels, const char*>, 2> enum_names(Kernels) {
  return {{{Kernels::kAuto, "auto"}, {Kernels::kScalar, "scalar"}}};
}

/// Where frames come from when they are read from a folder; all but `path`, `frame_rate` holds for
/// simulated cameras too.
struct CameraSection {
  std::string path;         ///< Dataset folder.
  std::string mcap;         ///< Recording to run on instead.
  std::string calibration;  ///< Empty: the one that belongs to the dataset.
  std::string rate = "auto";
  std::string name;
  bool reverse = false;
  bool restamp = false;
  int start = 0;
  int frames = 0;
  double frame_rate = 20.0;
  LiveOptions live;
  v4l2::V4l2Options v4l2;
  aravis::AravisOptions aravis;

  template <class Visitor>
  void visit(Visitor& v) {
    v("path", path, "dataset: KITTI odometry or raw, EuRoC, TUM-VI, or folders left/ and right/");
    v("mcap", mcap, "recording that sovo run reads: an .mcap file or a folder of them");
    v("calibration", calibration, "calibration file; empty: the one of the dataset or of the bus");
    v("rate", rate, "1.0: real time, max: as fast as can be, auto: 1.0 on the bus, else max");
    v("name", name, "prefix of the camera's frames; empty: as calibrated, else cam");
    v("reverse", reverse, "feed the frames backwards, with mirrored stamps");
    v("restamp", restamp, "shift the stamps so that the first frame is now");
    v("start", start, "frames left out at the beginning");
    v("frames", frames, "frames at most; 0: all");
    v("frame_rate", frame_rate, "of images that have no stamps [Hz]");
    v("live", live, "real cameras of all kinds");
    v("v4l2", v4l2, "cameras on USB and others that the kernel knows");
    v("aravis", aravis, "two GigE Vision cameras");
  }
};

/// How a recording is played back.
struct ReplaySection {
  std::string path;
  std::string rate = "1";
  double start = 0.0;
  bool loop = false;
  bool all = false;
  std::string left;  ///< Image topics of a bag's cameras; empty: found by their names.
  std::string right;

  template <class Visitor>
  void visit(Visitor& v) {
    v("path", path, "recording: a folder or an .mcap file");
    v("rate", rate, "speed: 1 is real time, max as fast as the odometry goes");
    v("start", start, "left out at the beginning [s]");
    v("loop", loop, "begin again at the end");
    v("left", left, "left image topic that --rate max follows; empty: found by its name");
    v("right", right, "its right image topic");
    v("all", all, "also topics that others on the bus write now, and recorded commands");
  }
};

/// Files that a run leaves; an empty name leaves none.
struct OutputSection {
  std::string trajectory;
  std::string map_trajectory;
  std::string live_trajectory;
  std::string keyframes;
  std::string profile;
  std::string truth;
  std::string calibration;

  template <class Visitor>
  void visit(Visitor& v) {
    v("trajectory", trajectory, "TUM file of the refined poses");
    v("map_trajectory", map_trajectory, "TUM file of the refined poses with loops closed");
    v("live_trajectory", live_trajectory, "TUM file of the poses as published at the time");
    v("keyframes", keyframes, "CSV file of every scale optimization");
    v("profile", profile, "JSON file of the times by stage");
    v("truth", truth, "TUM file of the true poses of simulated cameras");
    v("calibration", calibration, "calibration with the right camera as it was found to be turned");
  }
};

/// What only a process on the bus has.
struct NodeSection {
  bool publish_tf = true;
  double idle_exit_s = 0.0;
  std::string left;  ///< Image topics of a ROS 2 driver; empty: sovo's own frames.
  std::string right;
  double pair_tolerance_s = 0.005;

  template <class Visitor>
  void visit(Visitor& v) {
    v("publish_tf", publish_tf, "publish odom -> base_link; false beside another filter");
    v("left", left, "left image topic of a ROS 2 driver or bag; empty: frames of sovo");
    v("right", right, "its right image topic");
    v("pair_tolerance_s", pair_tolerance_s, "largest difference of stamps in its pairs [s]");
    v("idle_exit_s", idle_exit_s,
      "sovo vo ends when no frame came this long after the last one [s]; 0: never");
  }
};

/// Who may look at the dashboard, and where.
struct DashboardSection {
  std::string listen = "127.0.0.1:8765";
  std::string domains;
  std::string token_file;
  std::string tls_cert;
  std::string tls_key;
  std::string allow_origin;
  bool allow_commands = false;

  template <class Visitor>
  void visit(Visitor& v) {
    v("listen", listen, "address and port of the web page and of Foxglove's protocol");
    v("domains", domains, "DDS domains that are shown, with commas; empty: the one of dds.domain");
    v("token_file", token_file, "file, mode 0600, with the token that clients must know");
    v("tls_cert", tls_cert, "PEM file of the certificate; empty: no TLS");
    v("tls_key", tls_key, "PEM file of the certificate's key");
    v("allow_origin", allow_origin, "web sites whose pages may connect, with commas");
    v("allow_commands", allow_commands, "let clients with the token give commands");
  }
};

/// The configuration of all processes: one file, a section each.
struct AppConfig {
  Preset preset = Preset::kDefault;
  Kernels kernels = Kernels::kAuto;
  StereoOdometryConfig odometry;  ///< Its keys stand at the top level of the file.
  LoopConfig loops;
  CameraSection camera;
  sim::SimConfig sim;
  bridge::RecorderConfig record;
  ReplaySection replay;
  OutputSection output;
  NodeSection node;
  DashboardSection dashboard;
  bridge::DdsConfig dds;

  template <class Visitor>
  void visit(Visitor& v) {
    v("preset", preset, "values to begin with, before this file's");
    v("kernels", kernels, "inner loops; both give the bits of scalar code at the same speed");
    odometry.visit(v);
    v("loops", loops, "loop closing");
    v("camera", camera, "source of frames");
    v("sim", sim, "simulated cameras");
    v("record", record, "recording of topics");
    v("replay", replay, "playing back of recordings");
    v("output", output, "files that a run leaves");
    v("node", node, "what only a process on the bus has");
    v("dashboard", dashboard, "web page and Foxglove port");
    v("dds", dds, "how processes find each other");
  }
};

}  // namespace sovo::app
