#pragma once

#include <array>

#include "sovo/scale/scale_optimizer.h"

namespace sovo {

struct RightTurnConfig {
  bool undo = true;
  double min_px = 0.15;
  double clear_px = 0.05;
  double gate_sigmas = 4.0;
  double expected_px = 0.15;
  int memory = 60;

  template <class Visitor>
  void visit(Visitor& v) {
    v("undo", undo, "a turn of the right camera against its calibration is found and undone");
    v("min_px", min_px, "least turn that is undone [px at the centre of the right image]");
    v("clear_px", clear_px, "likewise, where all parts of the images agree about it [px]");
    v("gate_sigmas", gate_sigmas, "and by how much it must exceed the keyframes' scatter");
    v("expected_px", expected_px, "that scatter, before keyframes have shown it [px]");
    v("memory", memory, "keyframes over which turns are averaged");
  }
};

/// How the right camera is turned against its calibration, as the keyframes agree that it is. A
/// knock, or heat, turns a camera by hundredths of a degree: a pixel of yaw is taken for depth, and
/// makes the way by several per cent too long or too short, which shows in no residual; pitch and
/// roll lead matches astray.
///
/// Lenses that are described badly look like small turns, which differ from place to place in the
/// image and hence from keyframe to keyframe, and so does a map whose depths are wrong, after a
/// narrow turn of the vehicle for one. What exceeds the scatter of keyframes by far, and what parts
/// of their images disagree about it, is a turn of the camera. Where parts of the images disagree
/// about none of the three axes the lenses are described well, and small turns are believed, too.
/// What a few keyframes see elsewhere is left out; where many in a row do it was knocked.
class RightTurn {
 public:
  /// `focal`: of the right camera [px].
  RightTurn(const RightTurnConfig& config, double focal);

  /// A keyframe's estimate, found beyond the turn `given` that was undone in it.
  void note(const RightTurnEstimate& found, const SO3& given);

  /// To be undone now: T_right_left of the cameras as they are is that of the calibration, turned
  /// by this.
  const SO3& turn() const { return turn_; }
  /// Whether the cameras are turned against their calibration.
  bool decalibrated() const { return decalibrated_; }
  /// Whether the newest keyframe shows quite another turn than those before: which part of what it
  /// sees is scale and which is turn is not known then.
  bool in_doubt() const;
  /// Pitch, yaw and roll [px at the centre of the right image; roll: at a focal length from it] as
  /// the keyframes have it in the mean, undone or not.
  Vec3 mean_px() const;

 private:
  /// What a keyframe shows about an axis [px].
  struct KeyframeTurn {
    double px = 0.0;
    double disagreement_px = 0.0;
    double weight = 1.0;  ///< 1 for a keyframe that fits the map.
  };
  /// Of the turns that keyframes show about an axis.
  struct Turns {
    double mean = 0.0, variance = 0.0;  ///< [px, px^2]
    double disagreement = 0.0;          ///< Mean square of that within keyframes [px^2].
    double count = 0.0;                 ///< By their weights, `memory` at most.
    double averaged = 0.0;              ///< Of them, those that the mean is made of.

    void add(const KeyframeTurn& seen, int memory);
  };
  struct Axis {
    Turns turns;
    Turns astray;  ///< Those since the last keyframe that was not far from the mean.
    bool in_doubt = false;
  };
  void note(const KeyframeTurn& seen, Axis* axis) const;
  bool exceeds(double part) const;
  Vec3 certain_px() const;
  static double spread(const Turns& turns, double expected_px);
  double threshold(const Turns& turns) const;
  double clear_threshold(const Turns& turns) const;

  RightTurnConfig config_;
  double focal_;
  std::array<Axis, 3> axes_;
  bool decalibrated_ = false;
  SO3 turn_;
};

}  // namespace sovo
