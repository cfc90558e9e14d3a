#pragma once

#include <cstdint>
#include <optional>

#include "sovo/scale/scale_optimizer.h"

namespace sovo {

struct ScaleFilterConfig {
  /// Random walk of the log-scale error: variance a unit of distance, where the distance between
  /// keyframes is counted in median depths of the points. A monocular window renews its points,
  /// and so forgets its scale, by parallax: this makes one number fit a cave and a street.
  double process_noise = 1e-4;
  double min_process_noise = 1e-5;  ///< Bounds of what is learned.
  double max_process_noise = 3e-3;
  /// A map may shrink or grow steadily. Standard deviation of that drift, as log-scale over a
  /// distance of one median depth, and the distance after which it has become another one.
  double drift_sigma = 0.006;    ///< 0: no drift is expected.
  double drift_distance = 10.0;  ///< [median depths]
  /// Variance of a measurement over the one that its optimizer claims: keyframes share points,
  /// occlusions and reflections, which no residual shows.
  double measurement_factor = 4.0;
  double min_measurement_factor = 1.0;  ///< Bounds of what is learned.
  double max_measurement_factor = 30.0;
  double min_distance = 0.02;         ///< Distance counted at least, a keyframe [median depths].
  double learning_rate = 0.05;        ///< Of both noises from innovations; 0 holds them.
  double gate_sigmas = 3.0;           ///< Innovations beyond are confident disagreements.
  int cold_start_after = 6;           ///< Disagreements in a row that ask for a cold start, or
                                      ///< keyframes whose points are all out of view.
  int cold_start_after_agreeing = 3;  ///< The same of such that agree with each other.
  double max_correlation = 0.85;      ///< Of measurements on keyframes that share all their points.
  double initial_sigma = 0.02;        ///< Floor of the sigma of a scale given by stereo depth.

  template <class Visitor>
  void visit(Visitor& v) {
    v("process_noise", process_noise,
      "variance of log-scale gained over a distance of one median depth");
    v("min_process_noise", min_process_noise, "least process noise that is learned");
    v("max_process_noise", max_process_noise, "largest process noise that is learned");
    v("drift_sigma", drift_sigma,
      "standard deviation of a steady drift of log-scale over one median depth; 0: none");
    v("drift_distance", drift_distance, "distance after which a drift is another [median depths]");
    v("min_distance", min_distance, "distance counted at least, a keyframe [median depths]");
    v("measurement_factor", measurement_factor,
      "variance of a measurement over the one that the optimizer claims");
    v("min_measurement_factor", min_measurement_factor, "least factor that is learned");
    v("max_measurement_factor", max_measurement_factor, "largest factor that is learned");
    v("learning_rate", learning_rate, "of process noise and measurement factor; 0 holds them");
    v("gate_sigmas", gate_sigmas, "innovations beyond this are disagreements");
    v("cold_start_after", cold_start_after, "disagreements in a row that ask for a cold start");
    v("cold_start_after_agreeing", cold_start_after_agreeing,
      "disagreements in a row that agree with each other and ask for a cold start");
    v("max_correlation", max_correlation,
      "correlation of measurements on keyframes that share all their points");
    v("initial_sigma", initial_sigma, "least sigma of a scale given by stereo depth");
  }
};

/// A scale optimization with what the filter must know of its keyframe.
struct ScaleMeasurement {
  ScaleEstimate estimate;
  bool cold_start = false;  ///< The estimate searched the whole range.
  std::int64_t stamp_ns = 0;
  double distance = 0.0;         ///< Since the last measurement's keyframe [median depths].
  double shared_points = 0.0;    ///< Share of points that the last measurement had too, 0 to 1.
  double pending_log_scale = 0;  ///< Issued corrections not yet applied to the snapshot.
};

/// What the filter makes of a measurement.
struct ScaleUpdate {
  bool apply = false;                 ///< Whether a correction is to be applied.
  double log_scale_correction = 0.0;  ///< To be applied on top of what is pending.
  double expected = 0.0;              ///< Log-scale error by the drift so far.
  double gain = 0.0;                  ///< K: correction = expected + K innovation.
  double innovation = 0.0;            ///< Measured, less what is pending, expected.
  double nis = 0.0;                   ///< Innovation squared over its variance.
  ScaleVerdict verdict = ScaleVerdict::kTooFewPoints;  ///< The estimate's, or kInnovation.
};

/// Kalman filter of the log-scale error of a monocular window: P += q d, K = P / (P + R). Each
/// correction is applied at once, so that right after it the expected error is zero.
///
/// With a constant drift e a keyframe the error would stay at e (1 - K) / K, so the drift is a
/// second state (Gauss-Markov), which the innovations move; what it makes of the way to the next
/// keyframe is corrected entirely. Before the first lock nothing is applied: it takes an accepted
/// cold start, or two ambiguous ones that agree. Keyframes that cannot see the scale (too few
/// points or disparities, no right image) count neither for nor against it, unless it is for long
/// this scale that puts the points outside the right image: then it is searched anew.
class ScaleFilter {
 public:
  explicit ScaleFilter(const ScaleFilterConfig& config);

  /// Stereo depth has given the window its scale: starts locked, with this standard deviation.
  /// Until a measurement has agreed, two in a row that agree with each other outvote it: the second
  /// is taken whole.
  void lock_initial(double sigma, std::int64_t stamp_ns);

  /// The scale may be off by `log_scale` more than was thought: the standard deviation of what has
  /// changed, as the calibration.
  void widen(double log_scale);

  /// Forgets everything but the learned noises.
  void reset();

  ScaleUpdate update(const ScaleMeasurement& measurement);

  /// The same for a window that keeps its scale by itself, with this variance of log-scale, which
  /// counts as 0.05 squared at most: a measurement corrects nothing, unless many disagree by more
  /// than what moves a scale (5 %), and a cold start then finds it elsewhere.
  ScaleUpdate watch(const ScaleMeasurement& measurement, double variance);

  /// Something else holds the window's scale, with this variance of log-scale, while the last
  /// measurement told nothing of it: as good as one that agreed. Before the first lock nothing is
  /// held. The next measurement counts as if it were not: what holds a scale may err alike each
  /// time.
  void hold(double variance, std::int64_t stamp_ns);

  bool locked() const { return locked_; }
  /// Whether the next estimate should search the whole range.
  bool wants_cold_start() const { return !locked_ || searching_; }
  /// Standard deviation of the log-scale error after the last correction. While a measurement
  /// stands against it, either may be right: half of their squared difference is added, which
  /// counts as 0.05 at most.
  double sigma() const;
  /// Standard deviation to take when keyframes' errors are summed as if independent: it makes up
  /// for their correlation. A disagreeing measurement counts as in `sigma`.
  double path_sigma() const;
  /// Seconds from the last accepted measurement (or lock) to `stamp_ns`; 0 before the first.
  double age_s(std::int64_t stamp_ns) const;
  ScaleVerdict last_verdict() const { return last_verdict_; }
  int disagreements() const { return disagreements_; }
  double process_noise() const { return process_noise_; }
  double measurement_factor() const { return measurement_factor_; }

 private:
  struct Candidate {
    double log_scale;
    double variance;
  };

  ScaleUpdate update_tracking(const ScaleMeasurement& m);
  ScaleUpdate update_cold(const ScaleMeasurement& m);
  ScaleUpdate correct(const ScaleMeasurement& m, ScaleUpdate update);
  ScaleUpdate lock_on(const ScaleMeasurement& m, ScaleUpdate update, double variance);
  void disagree();
  bool agrees_with_rejected(const ScaleUpdate& update, double variance) const;
  void disagree_with(const ScaleUpdate& update, double variance);
  void agree_again();
  void miss(const ScaleEstimate& estimate);
  void learn(double innovation, double variance);
  double measured_variance(const ScaleMeasurement& m) const;
  bool within_gate(const ScaleUpdate& update) const;
  double walked(const ScaleMeasurement& m) const;
  double distance(const ScaleMeasurement& m) const;
  void drift_on(double distance);
  void learn_drift(double gain, double measured, double innovation);
  void forget_drift();

  ScaleFilterConfig config_;
  bool locked_ = false;
  bool confirmed_ = false;  ///< A measurement has agreed with the lock, or given it.
  bool searching_ = false;  ///< Locked, but doubted: cold starts are asked for.
  double variance_ = 0.0;   ///< P
  double drift_ = 0.0;      ///< Of log-scale, over one median depth.
  double drift_variance_ = 0.0;
  double drift_covariance_ = 0.0;  ///< Of the drift and the log-scale error.
  double expected_ = 0.0;  ///< Log-scale error that the drift has made since the correction.
  double path_variance_ = 0.0;
  std::optional<double> held_;  ///< Variance by what holds the scale, since the last measurement.
  double process_noise_ = 0.0;
  double measurement_factor_ = 1.0;
  double last_normalized_ = 0.0;  ///< Innovation over its standard deviation, the one before.
  int disagreements_ = 0;
  int out_of_view_ = 0;  ///< Keyframes in a row whose points lie outside the right image.
  int agreeing_ = 0;     ///< Of them, the newest that agree with each other.
  std::optional<Candidate> rejected_;
  double doubt_ = 0.0;  ///< Variance that is added while a measurement disagrees.
  std::int64_t accepted_stamp_ns_ = 0;
  ScaleVerdict last_verdict_ = ScaleVerdict::kTooFewPoints;
  std::optional<Candidate> candidate_;
};

}  // namespace sovo
