#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "sovo/geometry/camera_model.h"
#include "sovo/geometry/se3.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/geometry/view_shift.h"
#include "sovo/image/pyramid.h"
#include "sovo/image/vignette.h"
#include "sovo/vo/brightness.h"
#include "sovo/vo/immature_point.h"
#include "sovo/vo/motion_blur.h"
#include "sovo/vo/pattern.h"
#include "sovo/vo/static_scale.h"

namespace sovo {

enum class ResidualState : std::uint8_t {
  kAbsent,     ///< No residual into this keyframe.
  kIn,         ///< Takes part.
  kOutlier,    ///< Energy above the threshold; may come back.
  kOutOfView,  ///< Left the target image; stays out.
};

/// What the window keeps of the photometric residual of a point's pattern in one target keyframe.
struct Residual {
  ResidualState state = ResidualState::kAbsent;
  float energy = 0.0F;                     ///< Accepted; outliers count their threshold.
  float centre_u = 0.0F, centre_v = 0.0F;  ///< Projection of the centre pixel [px].
  float centre_rho = 0.0F;                 ///< Inverse depth in the target [1/m].
};

/// A point of the window: inverse depth along the ray of a pixel of its host keyframe.
struct Point {
  float u = 0.0F, v = 0.0F;                  ///< In the host's level 0 [px].
  std::array<float, kPatternSize> colour{};  ///< Host grey levels of the pattern.
  std::array<float, kPatternSize> weight{};  ///< Gradient weights of the pattern.
  ColourBlur blur;
  std::uint8_t type = 1;            ///< Block size of the selection: 1, 2, 4.
  double rho = 0.0;                 ///< Inverse depth, current estimate [1/m].
  SurfaceSlope slope;               ///< Of what it lies on; (0, 0): not known.
  double hessian = 0.0;             ///< H_rho_rho of the newest linearization, without priors.
  double gradient = 0.0;            ///< b_rho.
  float static_information = 0.0F;  ///< As `hessian`, of the match that gave rho first; 0: none.
  float relative_baseline = 0.0F;   ///< Largest baseline * rho of its good residuals.
  int good_residuals = 0;           ///< Inlier residuals on record, counted at every keyframe.
  bool remove = false;
  bool in_snapshot = false;                     ///< Was part of the last snapshot.
  std::array<Residual, kMaxSlots> residuals{};  ///< By target slot.
  /// Of the residual in the host's right image, where static residuals take part.
  ResidualState static_state = ResidualState::kAbsent;
  /// States in the newest keyframe and the one before (for the rules of removal).
  ResidualState last_state = ResidualState::kAbsent;
  ResidualState last_but_one_state = ResidualState::kAbsent;

  int count(ResidualState s) const {
    int n = 0;
    for (const Residual& r : residuals) n += r.state == s ? 1 : 0;
    return n;
  }
};

/// A point that shows what an immature one does; its depth is not set.
Point point_of(const ImmaturePoint& immature);

/// Information on a point's log-depth, in squared grey levels of the weighted pattern, below which
/// parallax tells nothing about it.
inline constexpr double kMinRelativeInformation = 100.0;

/// Information on a point's inverse depth [m^2]: that of parallax or, where there is none, that of
/// the stereo match which gave the first depth. `rho_unit`: the window's mean inverse depth [1/m].
double depth_information(const Point& point, double rho_unit);

/// A keyframe of the window. Its pose and brightness are a frozen linearization point and a
/// displacement x = (translation, rotation, a, b): T_camera_world = exp(x) * frozen
/// (first-estimates Jacobians).
struct Keyframe {
  std::uint32_t id = 0;
  int slot = 0;  ///< Index of the residuals into this keyframe, stable for its life.
  std::int64_t stamp_ns = 0;
  double exposure_s = 0.0;
  ImagePyramidPtr pyramid;
  RadialVignette vignette;              ///< That it is freed of, as far as it was known.
  ImagePyramidPtr right;                ///< Raw; null: no static residuals.
  SE3 T_later_left;                     ///< This camera into where it was when `right` was exposed.
  BrightnessTransfer right_brightness;  ///< From this keyframe's image to `right`.

  SE3 frozen_T_camera_world;
  Affine frozen_affine;
  Vec8 x = Vec8::Zero();
  SE3 T_camera_world;  ///< exp(x) * frozen.
  Affine affine;       ///< frozen + x.

  ViewShift shift;                    ///< Of a rolling shutter and a port, in the map's unit.
  std::optional<Vec6> velocity;       ///< MonoFrame::velocity, in the map's unit.
  Exposed exposed = Exposed::Zero();  ///< That, while its image was exposed.
  double longest_streak = 0.0;        ///< What that does to its image [px].

  double outlier_threshold = 0.0;  ///< Energy of a whole pattern.
  double huber_share = 1.0;        ///< Of its points' Huber threshold, see `WeakTextureConfig`.
  int points_hosted = 0;           ///< Ever active points of this host.
  int points_gone = 0;             ///< Of them, marginalized or dropped.
  bool leaving = false;

  std::vector<Point> points;
  std::vector<ImmaturePoint> immature;

  const ImageF& image() const { return pyramid->level(0); }
  SE3 T_world_camera() const { return T_camera_world.inverse(); }
  /// Sets the displacement and what follows from it.
  void set_x(const Vec8& value);
  /// Moves the linearization point to the current estimate; x becomes zero.
  void freeze();
};

/// The marginalization prior: a quadratic energy of the displacements of all keyframes of the
/// window, in their order: E = x^T H x + 2 b^T x, eight states a keyframe.
struct Prior {
  MatX H;
  VecX b;
};

/// Precomputed relation of a host and a target keyframe.
struct PairGeometry {
  Eigen::Matrix3f KRKi, RKi;  ///< Current pose.
  Eigen::Vector3f Kt, t;
  Eigen::Matrix3f frozen_RKi;  ///< At the linearization points.
  Eigen::Vector3f frozen_t;
  float gain = 1.0F, bias = 0.0F;  ///< Current brightness transfer.
  float frozen_gain = 1.0F;
  float frozen_host_b = 0.0F;
  PairViewShift shift;    ///< By the linearization points.
  Mat8 adjoint_host;      ///< d (relative state) / d x_host; that of x_target is the identity.
  double distance = 0.0;  ///< Between the camera centres [m].
  bool blurred = false;   ///< Motion blur is to be seen in one of both, and known of both.
};

/// The sliding window: keyframes from oldest to newest, the prior, and the geometry of each pair.
class Window {
 public:
  explicit Window(const CameraModel& camera) : camera_(camera) {}

  const CameraModel& camera() const { return camera_; }

  /// Static residuals into a right camera take part. `rig.left` is `camera()`.
  void set_rig(const StereoRig& rig, StaticScale scale = StaticScale::kHeld);
  /// Null without static residuals.
  const StereoRig* rig() const { return rig_ ? &*rig_ : nullptr; }
  /// Whether static residuals leave the scale to others (`StaticScale::kFree`).
  bool static_scale_free() const { return static_scale_free_; }
  /// By what inverse depths of the map are multiplied where static residuals look [1/m over the
  /// map's unit]: 1 where these hold the scale.
  double static_scale() const { return static_scale_; }
  /// Multiplies that, of static residuals whose scale is free.
  void rescale_statics(double factor) { static_scale_ *= factor; }
  /// Whether static residuals, present or folded into the prior, hold the scale: then it is no
  /// gauge direction.
  bool scale_held() const { return scale_held_; }
  /// Of a new keyframe: from fifty static residuals on they hold the scale, until there have been
  /// none for so long that the prior has forgotten them.
  void update_scale_held();
  int size() const { return static_cast<int>(keyframes_.size()); }
  bool empty() const { return keyframes_.empty(); }
  Keyframe& operator[](int i) { return *keyframes_[static_cast<std::size_t>(i)]; }
  const Keyframe& operator[](int i) const { return *keyframes_[static_cast<std::size_t>(i)]; }
  Keyframe& newest() { return *keyframes_.back(); }
  const Keyframe& newest() const { return *keyframes_.back(); }

  /// Forgets keyframes and prior.
  void clear();

  /// Appends a keyframe, gives it a free slot and zero rows in the prior. Returns it.
  Keyframe& insert(std::unique_ptr<Keyframe> keyframe);
  /// Removes keyframe `index` and all residuals into it. The prior must have lost its rows.
  void erase(int index);

  Prior& prior() { return prior_; }
  const Prior& prior() const { return prior_; }

  /// Index in the window of the keyframe with this id, or -1.
  int index_of(std::uint32_t id) const;
  /// Index in the window of the keyframe in a slot, or -1.
  int index_of_slot(int slot) const { return slot_index_[static_cast<std::size_t>(slot)]; }

  /// Recomputes the geometry of all pairs from the current states.
  void update_geometry();
  const PairGeometry& pair(int host, int target) const {
    return pairs_[static_cast<std::size_t>(host * kMaxSlots + target)];
  }

  /// Inverse depth of what counts as the nearest: four times the mean, so that a few points that
  /// have gone astray do not matter [1/m].
  double nearest_inverse_depth() const { return 4.0 * mean_inverse_depth(); }
  /// Sets how the keyframes moved while their images were exposed: for as long as is known of them,
  /// or so many seconds. Of those whose velocity is not known, blur is not known either. `nearest`:
  /// as above, for who asks often.
  void set_exposures(double unknown_s, double nearest);
  void set_exposures(double unknown_s) { set_exposures(unknown_s, nearest_inverse_depth()); }

  /// Displacements of all keyframes, stacked (8 a keyframe).
  VecX stacked_x() const;

  int num_active_points() const;
  /// Mean inverse depth of the active points, each counted as at most five medians; 1 when there
  /// are none [1/m].
  double mean_inverse_depth() const;

  /// Applies the similarity p -> centre + scale * (p - centre), the centre being the newest
  /// keyframe's: poses, inverse depths, immature intervals, linearization points, the prior with
  /// its displacement, and the scale of static residuals where it is free. The photometric energy
  /// does not change.
  void apply_similarity(double scale);

  /// Moves the world, poses and linearization points alike, so that keyframe `index` is at
  /// `T_world_camera`. What keyframes see of each other, and the prior, stay as they are.
  void hold(int index, const SE3& T_world_camera);

  /// Index of the one of all keyframes but the newest against which the others have moved least
  /// since they were at `T_world_camera` (one a keyframe, by index), however far single ones went.
  /// Of a window of one, that.
  int steadiest(const std::vector<SE3>& T_world_camera) const;

  /// The same of places alone, each keyframe with its weight: the one that is to be held where it
  /// was for those of great weight to stay. Weights are one a keyframe but the newest.
  int steadiest_place(const std::vector<SE3>& T_world_camera,
                      const std::vector<double>& weights) const;

  /// T_world_camera of all keyframes.
  std::vector<SE3> poses() const;

 private:
  void renumber();
  void update_blurred();

  CameraModel camera_;
  std::optional<StereoRig> rig_;
  bool static_scale_free_ = false;
  double static_scale_ = 1.0;
  bool scale_held_ = false;
  int keyframes_without_statics_ = 0;
  std::vector<std::unique_ptr<Keyframe>> keyframes_;
  std::array<int, kMaxSlots> slot_index_{};
  Prior prior_;
  std::array<PairGeometry, static_cast<std::size_t>(kMaxSlots) * kMaxSlots> pairs_;
};

}  // namespace sovo
