#include "sovo/app/config_options.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "sovo/app/frame_input.h"
#include "sovo/io/yaml_config.h"
#include "sovo/vo/pattern.h"

namespace sovo::app {
namespace {

std::vector<std::string> preset_assignments(Preset preset) {
  if (preset == Preset::kDefault) return {};
  if (preset == Preset::kQuality) {
    return {"mode=stereo", "vo.points.immature_points=700", "vo.window.max_iterations=10"};
  }
  return {"vo.points.active_points=800", "vo.points.immature_points=250",
          "vo.keyframe.max_keyframes=5", "vo.keyframe.min_keyframes=4",
          "features.features=400",       "features.max_keyframes=8",
          "features.free_keyframes=5"};
}

Result<void> check_backend(const StereoOdometryConfig& odometry) {
  const FeatureConfig& f = odometry.features;
  if (f.features < 50) return Error{"features.features must be at least 50"};
  if (f.levels < 1) return Error{"features.levels must be at least 1"};
  if (f.max_keyframes < 3) return Error{"features.max_keyframes must be at least 3"};
  if (f.free_keyframes < 1 || f.free_keyframes >= f.max_keyframes) {
    return Error{"features.free_keyframes must be at least 1 and less than features.max_keyframes"};
  }
  if (!(f.sigma_px > 0.0)) return Error{"features.sigma_px must be positive"};
  if (!(f.outlier_sigmas > 0.0)) return Error{"features.outlier_sigmas must be positive"};
  if (!(f.depth_damping >= 0.0)) return Error{"features.depth_damping must not be negative"};
  if (f.max_iterations < 1 || f.max_iterations_window < 1) {
    return Error{"features.max_iterations and max_iterations_window must be at least 1"};
  }
  if (!(f.min_corner >= f.weak_corner && f.weak_corner > 0.0)) {
    return Error{"features.weak_corner must be positive and at most features.min_corner"};
  }
  if (odometry.backend == Backend::kFeatures && odometry.mode == OdometryMode::kStereo) {
    return Error{
        "backend: features has no static residuals; use mode: scale, or mono (preset: quality sets "
        "mode: stereo)"};
  }
  return {};
}

/// Weights of the odometry: a negative one would turn its term's meaning round.
Result<void> check_weights(const DirectConfig& vo) {
  const KeyframeConfig& keyframe = vo.keyframe;
  const WindowConfig& window = vo.window;
  const std::pair<const char*, double> weights[] = {
      {"keyframe.flow_translation", keyframe.flow_translation},
      {"keyframe.flow_total", keyframe.flow_total},
      {"keyframe.max_translation_flow", keyframe.max_translation_flow},
      {"keyframe.approach", keyframe.approach},
      {"keyframe.next_frame_score", keyframe.next_frame_score},
      {"keyframe.brightness", keyframe.brightness},
      {"keyframe.rmse_min_score", keyframe.rmse_min_score},
      {"window.folding_weight", window.folding_weight},
      {"window.depth_damping", window.depth_damping},
      {"window.place_damping", window.place_damping},
      {"window.static_weight", window.static_weight},
      {"window.free_static_weight", window.free_static_weight},
      {"window.prior_a", window.prior_a},
      {"window.prior_b", window.prior_b}};
  for (const auto& [key, weight] : weights) {
    if (!(weight >= 0.0)) return Error{std::string("vo.") + key + " must not be negative"};
  }
  return {};
}

/// With what the scale filter could expect no drift.
Result<void> check_filter(const ScaleFilterConfig& filter) {
  if (!(filter.drift_sigma >= 0.0)) return Error{"filter.drift_sigma must not be negative"};
  if (!(filter.drift_distance > 0.0)) return Error{"filter.drift_distance must be positive"};
  return {};
}

/// What would call stereo matching and send it away at once.
Result<void> check_assist(const StereoAssistConfig& assist) {
  if (!(assist.few_points >= 0.0 && assist.few_points <= assist.enough_points)) {
    return Error{"assist.few_points must not be negative, nor above assist.enough_points"};
  }
  if (assist.good_keyframes < 1 || assist.disagreements < 1) {
    return Error{"assist.good_keyframes and assist.disagreements must be at least 1"};
  }
  return {};
}

/// What loop closing could not work with.
Result<void> check_loops(const AppConfig& config) {
  const LoopConfig& l = config.loops;
  if (!l.enabled && !config.output.map_trajectory.empty()) {
    return Error{"output.map_trajectory (--out-map) needs loops.enabled (--loops)"};
  }
  if (l.enabled && config.odometry.mode == OdometryMode::kMono) {
    return Error{"loops.enabled (--loops) needs metres: mode scale or stereo, not mono"};
  }
  if (!(l.place_step > 0.0 && l.place_turn_deg > 0.0)) {
    return Error{"loops.place_step and place_turn_deg must be positive"};
  }
  if (l.min_gap < 1 || l.min_votes < 1 || l.max_candidates < 1) {
    return Error{"loops.min_gap, min_votes and max_candidates must be at least 1"};
  }
  constexpr int kFewestPlaces = 100;
  if (l.max_places < kFewestPlaces) return Error{"loops.max_places must be at least 100"};
  constexpr int kFewestKeypoints = 50;
  constexpr int kMostKeypoints = 5000;
  if (l.keypoints.per_image < kFewestKeypoints || l.keypoints.per_image > kMostKeypoints) {
    return Error{"loops.keypoints.per_image must be 50 to 5000"};
  }
  constexpr int kFewestInliers = 6;
  if (l.matching.min_inliers < kFewestInliers || l.matching.max_hypotheses < 1) {
    return Error{"loops.matching.min_inliers must be at least 6, max_hypotheses at least 1"};
  }
  if (!(l.matching.sigma_px > 0.0 && l.matching.max_ratio > 0.0)) {
    return Error{"loops.matching.sigma_px and max_ratio must be positive"};
  }
  return {};
}

/// With what images could not be freed of their light.
Result<void> check_local_contrast(const LocalContrastConfig& c) {
  constexpr double kWidest = 0.5;
  if (!(c.radius > 0.0 && c.radius <= kWidest)) {
    return Error{"local_contrast.radius must be above 0 and at most 0.5"};
  }
  constexpr double kLeastFloor = 0.1;
  constexpr double kHighestFloor = 255.0;
  if (!(c.floor >= kLeastFloor && c.floor <= kHighestFloor)) {
    return Error{"local_contrast.floor must be 0.1 to 255"};
  }
  return {};
}

/// What tracking and the window could not work with.
Result<void> check_window(const DirectConfig& vo) {
  constexpr int kFewestPoints = 50;
  const KeyframeConfig& keyframe = vo.keyframe;
  if (keyframe.max_keyframes < 3 || keyframe.max_keyframes >= kMaxSlots) {
    return Error{"vo.keyframe.max_keyframes must be 3 to " + std::to_string(kMaxSlots - 1)};
  }
  if (keyframe.min_keyframes < 1) return Error{"vo.keyframe.min_keyframes must be at least 1"};
  if (vo.points.active_points < kFewestPoints || vo.points.immature_points < kFewestPoints) {
    return Error{"vo.points.active_points and immature_points must be at least 50"};
  }
  if (vo.tracker.max_levels < 1) return Error{"vo.tracker.max_levels must be at least 1"};
  if (vo.window.max_iterations < 1) return Error{"vo.window.max_iterations must be at least 1"};
  if (vo.window.lens_every < 0) return Error{"vo.window.lens_every must not be negative"};
  if (!(vo.window.point_spread_px >= 0.0 && vo.window.point_spread_px <= 3.0)) {
    return Error{"vo.window.point_spread_px must be 0 to 3"};
  }
  const std::pair<const char*, double> thresholds[] = {
      {"tracker.huber", vo.tracker.huber},
      {"tracker.cutoff", vo.tracker.cutoff},
      {"tracker.gradient_constant", vo.tracker.gradient_constant},
      {"points.huber", vo.points.huber},
      {"window.huber", vo.window.huber},
      {"window.gradient_constant", vo.window.gradient_constant}};
  for (const auto& [key, threshold] : thresholds) {
    if (!(threshold > 0.0)) return Error{std::string("vo.") + key + " must be positive"};
  }
  if (!(vo.motion_blur.least_share >= 0.0 && vo.motion_blur.least_share < 1.0)) {
    return Error{"vo.motion_blur.least_share must be at least 0 and below 1"};
  }
  return {};
}

Result<void> check_co_moving(const CoMovingConfig& c) {
  constexpr int kSmallestCell = 4;
  constexpr int kLargestCell = 256;
  if (c.cell < kSmallestCell || c.cell > kLargestCell) {
    return Error{"vo.co_moving.cell must be 4 to 256"};
  }
  if (!(c.min_gradient >= 0.0 && c.min_displacement > 0.0 && c.majority > 0.0)) {
    return Error{
        "vo.co_moving: min_gradient must not be negative, min_displacement and majority be "
        "positive"};
  }
  if (!(c.better_match > 0.0 && c.better_match <= 1.0)) {
    return Error{"vo.co_moving.better_match must be above 0 and at most 1"};
  }
  if (!(c.stays_below > 0.0 && c.stays_below <= c.moves_above)) {
    return Error{"vo.co_moving.stays_below must be positive, and at most moves_above"};
  }
  if (c.keyframes < 1) return Error{"vo.co_moving.keyframes must be at least 1"};
  return {};
}

Result<void> check_weak_texture(const WeakTextureConfig& c) {
  constexpr double kLeastShare = 0.01;
  if (!(c.least_share >= kLeastShare && c.least_share <= 1.0)) {
    return Error{"vo.weak_texture.least_share must be 0.01 to 1"};
  }
  if (!(c.to_gradient >= 0.0 && c.to_gradient < c.from_gradient)) {
    return Error{"vo.weak_texture.to_gradient must not be negative, and below from_gradient"};
  }
  if (!(c.least_rms >= 0.0)) return Error{"vo.weak_texture.least_rms must not be negative"};
  return {};
}

/// What the selection of pixels could not work with.
Result<void> check_selection(const PixelSelectorConfig& s) {
  constexpr int kLeastRegion = 8;
  if (s.threshold_block < kLeastRegion) {
    return Error{"vo.selection.threshold_block must be at least 8"};
  }
  if (s.border <= kPatternBorder) return Error{"vo.selection.border must be at least 4"};
  if (s.mask_border < 0) return Error{"vo.selection.mask_border must not be negative"};
  if (s.initial_block < 1) return Error{"vo.selection.initial_block must be at least 1"};
  if (!(s.least_offset > 0.0 && s.least_offset <= s.threshold_offset)) {
    return Error{"vo.selection.least_offset must be positive and at most threshold_offset"};
  }
  if (!(s.level_threshold_1 > 0.0 && s.level_threshold_2 > 0.0)) {
    return Error{"vo.selection.level_threshold_1 and _2 must be positive"};
  }
  if (!(s.reselect_below > 0.0 && s.reselect_below < 1.0 && s.reselect_above > 1.0)) {
    return Error{"vo.selection.reselect_below must be between 0 and 1, reselect_above above 1"};
  }
  if (!(s.min_spread >= 0.0 && s.min_spread < 1.0)) {
    return Error{"vo.selection.min_spread must be at least 0 and below 1"};
  }
  return {};
}

Result<void> apply_all(const std::vector<std::string>& assignments, AppConfig* config) {
  for (const std::string& assignment : assignments) {
    if (auto set = apply_override(config, assignment); !set) return set;
  }
  return {};
}

}  // namespace

ConfigOptions& ConfigOptions::value(const std::string& name, const std::string& key,
                                    const std::string& help, const std::string& type) {
  CommandOption option = command_.option(name, help).type(type.empty() ? "VALUE" : type);
  bindings_.push_back({name, option, key, Binding::kValue});
  return *this;
}

ConfigOptions& ConfigOptions::list(const std::string& name, const std::string& key,
                                   const std::string& help, const std::string& type) {
  CommandOption option = command_.option(name, help).type(type).repeatable();
  bindings_.push_back({name, option, key, Binding::kList});
  return *this;
}

ConfigOptions& ConfigOptions::flag(const std::string& name, const std::string& key,
                                   const std::string& help) {
  bindings_.push_back({name, command_.flag(name, help), key, Binding::kFlag});
  return *this;
}

bool ConfigOptions::is_given(const std::string& name) const {
  return std::any_of(bindings_.begin(), bindings_.end(),
                     [&name](const Binding& b) { return b.name == name && b.option.count() > 0; });
}

std::string ConfigOptions::value_of(const Binding& binding) {
  if (binding.kind == Binding::kFlag) return "true";
  if (binding.kind == Binding::kValue) return binding.option.values().back();
  std::string list;
  for (const std::string& value : binding.option.values()) {
    list += (list.empty() ? "" : ",") + value;
  }
  return list;
}

std::vector<std::string> ConfigOptions::assignments() const {
  std::vector<std::string> all;
  for (const std::string& a : command_.global_option("--set").values()) all.push_back(a);
  for (const Binding& b : bindings_) {
    if (b.option.count() == 0) continue;
    all.push_back(b.key + "=" + value_of(b));
  }
  return all;
}

Result<AppConfig> ConfigOptions::load() const {
  const CommandOption file = command_.global_option("--config");
  const std::string path = file.count() > 0 ? file.values().back() : "";
  const auto apply_user = [&](AppConfig* config) -> Result<void> {
    if (!path.empty()) {
      if (auto loaded = load_config(path, config); !loaded) return loaded;
    }
    return apply_all(assignments(), config);
  };
  AppConfig named;  // only to learn which preset the user names
  if (auto done = apply_user(&named); !done) return done.failure();
  AppConfig config;
  if (auto done = apply_all(preset_assignments(named.preset), &config); !done) {
    return done.failure();
  }
  if (auto done = apply_user(&config); !done) return done.failure();
  if (auto done = check_config(config); !done) return done.failure();
  return config;
}

Result<void> check_config(const AppConfig& config) {
  const auto& camera = config.camera;
  if (auto rate = parse_rate(camera.rate, 0.0); !rate) return rate.failure();
  if (camera.start < 0) return Error{"camera.start must not be negative"};
  if (camera.frames < 0) return Error{"camera.frames must not be negative"};
  if (!(camera.frame_rate > 0.0)) return Error{"camera.frame_rate must be positive"};
  if (config.odometry.threads < 1) return Error{"threads must be at least 1"};
  if (config.odometry.downscale < 1) return Error{"downscale must be at least 1"};
  if (config.odometry.max_halvings < 0 || config.odometry.max_halvings > 4) {
    return Error{"max_halvings must be 0 to 4"};
  }
  const RightTurnConfig& turn = config.odometry.right_turn;
  if (!(turn.min_px >= 0.0 && turn.clear_px >= 0.0 && turn.gate_sigmas > 0.0 &&
        turn.expected_px > 0.0 && turn.memory >= 1)) {
    return Error{
        "right_turn: min_px and clear_px must not be negative, gate_sigmas and expected_px must be "
        "positive, memory at least 1"};
  }
  if (!(std::abs(config.odometry.readout_ms) <= 1000.0)) {
    return Error{"readout_ms must be in [-1000, 1000]; negative: rows are read from below"};
  }
  if (config.odometry.mapping_queue < 1) return Error{"mapping_queue must be at least 1"};
  if (auto backend = check_backend(config.odometry); !backend) return backend;
  if (auto weights = check_weights(config.odometry.vo); !weights) return weights;
  if (auto selection = check_selection(config.odometry.vo.selection); !selection) return selection;
  if (auto weak = check_weak_texture(config.odometry.vo.weak_texture); !weak) return weak;
  if (auto window = check_window(config.odometry.vo); !window) return window;
  if (auto along = check_co_moving(config.odometry.vo.co_moving); !along) return along;
  if (auto assist = check_assist(config.odometry.assist); !assist) return assist;
  if (auto filter = check_filter(config.odometry.filter); !filter) return filter;
  if (auto light = check_local_contrast(config.odometry.local_contrast); !light) return light;
  if (auto loops = check_loops(config); !loops) return loops;
  if (!(config.node.idle_exit_s >= 0.0)) return Error{"node.idle_exit_s must not be negative"};
  if (config.node.left.empty() != config.node.right.empty()) {
    return Error{"node.left and node.right (--left, --right) are given together"};
  }
  if (config.replay.left.empty() != config.replay.right.empty()) {
    return Error{"replay.left and replay.right (--left, --right) are given together"};
  }
  if (!(config.node.pair_tolerance_s >= 0.0)) {
    return Error{"node.pair_tolerance_s must not be negative"};
  }
  return {};
}

void add_dds_options(ConfigOptions& options) {
  options.value("--domain", "dds.domain", "DDS domain (else ROS_DOMAIN_ID, else 0)", "N")
      .value("--network", "dds.network", "Network interface or address (default lo)", "NAME")
      .value("--ns", "dds.ns", "Namespace of the topics (default sovo)", "NAME");
}

void add_dataset_options(ConfigOptions& options) {
  options
      .value("--calib", "camera.calibration", "Calibration file, instead of the dataset's", "FILE")
      .value("--start", "camera.start", "Frames left out at the beginning", "N")
      .value("--frames", "camera.frames", "Frames at most", "N")
      .flag("--reverse", "camera.reverse", "Feed the frames backwards");
}

void add_sim_options(ConfigOptions& options) {
  std::string worlds;
  for (const auto& [world, name] : enum_names(sim::World())) {
    worlds += (worlds.empty() ? "" : "|") + std::string(name);
  }
  options.value("--world", "sim.world", "What is rendered", worlds)
      .value("--trajectory", "sim.trajectory",
             "One of the world's own, or a TUM, EuRoC or KITTI pose file", "NAME|FILE")
      .value("--truth", "output.truth", "Write the true trajectory (TUM)", "FILE");
}

void add_odometry_options(ConfigOptions& options) {
  options
      .value("--backend", "backend", "Which monocular odometry follows the left camera",
             "direct|features")
      .value("--mode", "mode", "Who owns the metric scale", "mono|scale|stereo")
      .value("--preset", "preset", "Values to begin with", "embedded|default|quality")
      .value("--init", "init", "How the map begins", "auto|stereo|two_view")
      .value("--depth-init", "depth_init", "A new point's first depth interval",
             "temporal|stereo|auto")
      .value("--threads", "threads", "Of the loops inside the stages", "N")
      .value("--seed", "seed", "Of every random choice", "N")
      .value("--kernels", "kernels", "Inner loops; both give the same bits at the same speed",
             "auto|scalar")
      .flag("--deterministic", "deterministic", "All stages in order: same input, same bytes")
      .value("--out", "output.trajectory", "Write the refined trajectory (TUM)", "FILE")
      .flag("--loops", "loops.enabled", "Close loops: correct the trajectory in frame map")
      .value("--out-map", "output.map_trajectory", "With --loops: write it corrected (TUM)", "FILE")
      .value("--out-live", "output.live_trajectory", "Write the poses as published (TUM)", "FILE")
      .value("--out-calib", "output.calibration",
             "Write the calibration, with the right camera as it was found to be turned", "FILE")
      .value("--keyframes", "output.keyframes", "Write every scale optimization", "FILE.csv")
      .value("--profile", "output.profile", "Write the times by stage", "FILE.json");
}

}  // namespace sovo::app
