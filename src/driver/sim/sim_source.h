#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sovo/driver/dataset/frame_decoder.h"
#include "sovo/driver/frame_source.h"
#include "sovo/driver/sim/own_body.h"
#include "sovo/driver/sim/sensor.h"
#include "sovo/driver/sim/world.h"
#include "sovo/io/calibration.h"

namespace sovo::sim {

/// Simulated cameras in a world. Equal configurations give equal bytes, whatever the number of
/// threads. Dropped pairs show as gaps in `sequence`; `session` is left for the caller to set.
class SimSource : public FrameSource {
 public:
  SimSource(const SimConfig& config, Calibration calibration, Motion motion);

  const StereoRig& rig() const override { return calibration_.rig; }
  SourceResult next(std::chrono::milliseconds timeout) override;
  /// Pairs that are not dropped.
  std::optional<std::size_t> size() const override { return delivered_.size(); }

  /// Starts the clock: `restamp` and `rate` count from here. `next` does it when nobody did.
  void begin();

  const Calibration& calibration() const { return calibration_; }
  const Motion& motion() const { return motion_; }
  double frame_rate() const { return frame_rate_; }

  /// The true pose of the left camera at the stamp of every pair that is not dropped; with
  /// `restamp`, after `begin`.
  Trajectory truth() const;
  /// The true pose of the left camera at a stamp.
  SE3 pose_at(std::int64_t stamp_ns) const;

  /// The stamp of the trajectory of a pair given with the stamp `fed` (undoes `reverse` and
  /// `restamp`).
  std::int64_t original_stamp(std::int64_t fed) const;

  /// True depth of the left image of a pair: distance along the optical axis [m], 0 where there is
  /// no surface. Renders anew.
  ImageF depth_at(std::int64_t stamp_ns);
  /// The same at chosen places of the image.
  std::vector<float> depth_at(std::int64_t stamp_ns, const std::vector<Vec2>& pixels);

 private:
  SourceResult render(std::size_t n);
  SE3 camera_at(Side which, double t) const;
  void take(Renderer* renderer, Side which, double t, RenderedImage* image) const;
  SideImage make_side(Side which, double t, std::uint64_t frame, Renderer* renderer,
                      ExposureControl* exposure, const Sensor& sensor) const;
  double time_of(std::size_t index) const;
  std::int64_t stamp_of(std::size_t index) const;
  double world_time(std::int64_t stamp_ns) const;

  SimConfig config_;
  Calibration calibration_;
  Motion motion_;
  Scene scene_;
  double frame_rate_;
  std::int64_t shift_ns_ = 0;           ///< Added to stamps by `restamp`.
  std::vector<std::size_t> delivered_;  ///< Indices of the pairs that are not dropped.
  Renderer left_;
  Renderer right_;
  OwnBody left_body_;
  OwnBody right_body_;
  Renderer truth_;  ///< Of the left camera, for depth: the others belong to the decoder's thread.
  Sensor left_sensor_;
  Sensor right_sensor_;
  ExposureControl left_exposure_;
  ExposureControl right_exposure_;
  bool settled_ = false;
  bool begun_ = false;
  std::chrono::steady_clock::time_point start_;  ///< When the first pair is due.
  std::optional<SourceResult> waiting_;
  std::unique_ptr<FrameDecoder> decoder_;  ///< Last: its thread uses the members above.
};

/// Builds the world. The error says what is wrong and what to do.
Result<std::unique_ptr<SimSource>> open_sim(const SimConfig& config);

}  // namespace sovo::sim
