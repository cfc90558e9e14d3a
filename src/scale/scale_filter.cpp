#include "sovo/scale/scale_filter.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace sovo {

namespace {

/// Whether the keyframe could not see the scale at all: neither for nor against it.
bool is_miss(ScaleVerdict verdict) {
  return verdict == ScaleVerdict::kTooFewPoints || verdict == ScaleVerdict::kUnobservable ||
         verdict == ScaleVerdict::kNoRightImage;
}

double square(double x) { return x * x; }

/// Of a window's scale from one keyframe to the next: who differs by more measures something else.
constexpr double kLargestDrift = 0.05;

/// Growth of the variance of a sum of correlated errors over that of independent ones, for
/// first-order correlation `c` (AR(1)).
double correlation_growth(double c) { return (1.0 + c) / (1.0 - c); }

}  // namespace

ScaleFilter::ScaleFilter(const ScaleFilterConfig& config)
    : config_(config),
      process_noise_(config.process_noise),
      measurement_factor_(config.measurement_factor) {}

void ScaleFilter::reset() {
  const double process_noise = process_noise_;
  const double measurement_factor = measurement_factor_;
  *this = ScaleFilter(config_);
  process_noise_ = process_noise;
  measurement_factor_ = measurement_factor;
}

void ScaleFilter::lock_initial(double sigma, std::int64_t stamp_ns) {
  locked_ = true;
  confirmed_ = false;
  searching_ = false;
  agree_again();
  candidate_.reset();
  variance_ = square(std::max(sigma, config_.initial_sigma));
  path_variance_ = variance_;
  forget_drift();
  accepted_stamp_ns_ = stamp_ns;
}

void ScaleFilter::widen(double log_scale) {
  variance_ += square(log_scale);
  path_variance_ += square(log_scale);
}

ScaleUpdate ScaleFilter::update(const ScaleMeasurement& m) {
  held_.reset();
  if (locked_) {  // the error has walked since the last keyframe, seen or not
    drift_on(distance(m));
    variance_ += walked(m);
    path_variance_ += walked(m);
  }
  if (candidate_) candidate_->variance += walked(m);
  if (rejected_) rejected_->variance += walked(m);
  ScaleUpdate update;
  if (is_miss(m.estimate.verdict)) {
    update.verdict = m.estimate.verdict;
    miss(m.estimate);
  } else if (m.cold_start) {
    update = update_cold(m);
  } else if (locked_) {
    update = update_tracking(m);
  } else {
    update.verdict = m.estimate.verdict;  // no cold start yet: there is nothing to compare with
  }
  last_verdict_ = update.verdict;
  return update;
}

ScaleUpdate ScaleFilter::watch(const ScaleMeasurement& m, double variance) {
  if (!locked_) return update(m);
  held_.reset();
  variance_ = std::min(variance, square(kLargestDrift));
  path_variance_ = variance_ * correlation_growth(config_.max_correlation);  // it changes slowly
  ScaleUpdate update;
  update.verdict = m.estimate.verdict;
  update.innovation = m.estimate.log_scale - m.pending_log_scale;
  const double doubted = variance_ + measured_variance(m) + square(kLargestDrift);
  update.nis = square(update.innovation) / doubted;
  if (is_miss(update.verdict)) {
    miss(m.estimate);
  } else if (update.verdict == ScaleVerdict::kAccepted && square(update.innovation) <= doubted) {
    agree_again();
    searching_ = false;
    accepted_stamp_ns_ = m.stamp_ns;
  } else if (update.verdict == ScaleVerdict::kAccepted && m.cold_start) {
    update = lock_on(m, update, measured_variance(m));
  } else if (update.verdict == ScaleVerdict::kAccepted) {
    update.verdict = ScaleVerdict::kInnovation;
    disagree_with(update, measured_variance(m));
  } else {
    disagree();
  }
  last_verdict_ = update.verdict;
  return update;
}

void ScaleFilter::hold(double variance, std::int64_t stamp_ns) {
  if (!locked_) return;
  held_ = variance;
  accepted_stamp_ns_ = stamp_ns;
}

ScaleUpdate ScaleFilter::update_tracking(const ScaleMeasurement& m) {
  ScaleUpdate update;
  update.verdict = m.estimate.verdict;
  if (m.estimate.verdict != ScaleVerdict::kAccepted) {
    disagree();
    return update;
  }
  update.expected = expected_;
  update.innovation = m.estimate.log_scale - m.pending_log_scale - expected_;
  const double innovation_variance = variance_ + measured_variance(m);
  update.nis = square(update.innovation) / innovation_variance;
  learn(update.innovation, innovation_variance);
  if (within_gate(update)) return correct(m, update);
  const double variance = measured_variance(m);
  // One view gave the lock; by the time that three are against it, newer points have hidden it.
  if (!confirmed_ && agrees_with_rejected(update, variance)) return lock_on(m, update, variance);
  update.verdict = ScaleVerdict::kInnovation;
  disagree_with(update, variance);
  return update;
}

ScaleUpdate ScaleFilter::update_cold(const ScaleMeasurement& m) {
  ScaleUpdate update;
  update.verdict = m.estimate.verdict;
  update.expected = expected_;
  update.innovation = m.estimate.log_scale - m.pending_log_scale - expected_;
  const double variance = measured_variance(m);
  if (update.verdict == ScaleVerdict::kAccepted) {
    if (!locked_) return lock_on(m, update, variance);
    update.nis = square(update.innovation) / (variance_ + variance);
    return within_gate(update) ? correct(m, update) : lock_on(m, update, variance);
  }
  if (update.verdict != ScaleVerdict::kAmbiguous) {
    candidate_.reset();
    return update;
  }
  const bool agrees =
      candidate_ && square(update.innovation - candidate_->log_scale) <=
                        square(config_.gate_sigmas) * (candidate_->variance + variance);
  if (agrees) return lock_on(m, update, variance);
  candidate_ = Candidate{update.innovation, variance};
  return update;
}

/// Kalman correction. The gain takes measurements as independent, for correlation is no reason to
/// lag behind; the covariance (Joseph form) counts it.
ScaleUpdate ScaleFilter::correct(const ScaleMeasurement& m, ScaleUpdate update) {
  const double R = measured_variance(m);
  const double K = variance_ / (variance_ + R);
  const double c = config_.max_correlation * std::clamp(m.shared_points, 0.0, 1.0);
  update.apply = true;
  update.gain = K;
  update.log_scale_correction = update.expected + K * update.innovation;
  update.verdict = ScaleVerdict::kAccepted;
  if (!std::exchange(confirmed_, true)) forget_drift();  // how far a start was off is none
  learn_drift(K, R, update.innovation);
  variance_ = square(1.0 - K) * variance_ + square(K) * R * correlation_growth(c * (1.0 - K));
  // Spectrum of the error at frequency zero: noise passes entire, the walk as it lags.
  path_variance_ = R * correlation_growth(c) + square((1.0 - K) / K) * walked(m);
  agree_again();
  searching_ = false;
  accepted_stamp_ns_ = m.stamp_ns;
  return update;
}

/// Takes the measurement whole.
ScaleUpdate ScaleFilter::lock_on(const ScaleMeasurement& m, ScaleUpdate update, double variance) {
  lock_initial(0.0, m.stamp_ns);
  confirmed_ = true;
  variance_ = variance;
  path_variance_ = variance;
  update.apply = true;
  update.gain = 1.0;
  update.log_scale_correction = update.expected + update.innovation;
  update.verdict = ScaleVerdict::kAccepted;
  return update;
}

void ScaleFilter::miss(const ScaleEstimate& estimate) {
  out_of_view_ = estimate.out_of_view ? out_of_view_ + 1 : 0;
  if (locked_ && out_of_view_ >= config_.cold_start_after) searching_ = true;
}

void ScaleFilter::disagree() {
  ++disagreements_;
  agreeing_ = 0;
  rejected_.reset();
  if (disagreements_ >= config_.cold_start_after) searching_ = true;
}

bool ScaleFilter::agrees_with_rejected(const ScaleUpdate& update, double variance) const {
  return rejected_ && square(update.innovation - rejected_->log_scale) <=
                          square(config_.gate_sigmas) * (rejected_->variance + variance);
}

/// Noise disagrees in all directions; a scale that is wrong, always in one.
void ScaleFilter::disagree_with(const ScaleUpdate& update, double variance) {
  const int agreeing = agrees_with_rejected(update, variance) ? agreeing_ + 1 : 1;
  disagree();
  doubt_ = 0.5 * square(std::min(std::abs(update.innovation), kLargestDrift));
  agreeing_ = agreeing;
  rejected_ = Candidate{update.innovation, variance};
  if (agreeing_ >= config_.cold_start_after_agreeing) searching_ = true;
}

void ScaleFilter::agree_again() {
  disagreements_ = 0;
  agreeing_ = 0;
  out_of_view_ = 0;
  doubt_ = 0.0;
  rejected_.reset();
}

/// Innovations of a filter that knows its noises are white and as large as it expects. Their size
/// moves both noises alike; their correlation from one keyframe to the next tilts them: negative,
/// the gain is too high, and noise of the last measurement is being corrected (Mehra, "On the
/// identification of variances and adaptive Kalman filtering").
void ScaleFilter::learn(double innovation, double variance) {
  const double normalized =
      std::clamp(innovation / std::sqrt(variance), -config_.gate_sigmas, config_.gate_sigmas);
  const double excess = square(normalized) - 1.0;
  const double correlation = normalized * last_normalized_;
  last_normalized_ = normalized;
  process_noise_ =
      std::clamp(process_noise_ * std::exp(config_.learning_rate * (excess + correlation)),
                 config_.min_process_noise, config_.max_process_noise);
  measurement_factor_ =
      std::clamp(measurement_factor_ * std::exp(config_.learning_rate * (excess - correlation)),
                 config_.min_measurement_factor, config_.max_measurement_factor);
}

double ScaleFilter::measured_variance(const ScaleMeasurement& m) const {
  return measurement_factor_ * square(m.estimate.sigma);
}

bool ScaleFilter::within_gate(const ScaleUpdate& update) const {
  return update.nis <= square(config_.gate_sigmas);
}

double ScaleFilter::walked(const ScaleMeasurement& m) const { return process_noise_ * distance(m); }

double ScaleFilter::distance(const ScaleMeasurement& m) const {
  return std::max(m.distance, config_.min_distance);
}

/// What the drift makes of the way to the next keyframe, and how sure of that one is. While scales
/// are not seen something else may hold them, so what is expected does not add up.
void ScaleFilter::drift_on(double distance) {
  expected_ = std::clamp(drift_ * distance, -kLargestDrift, kLargestDrift);
  variance_ += distance * (2.0 * drift_covariance_ + distance * drift_variance_);
  const double kept = std::exp(-distance / config_.drift_distance);
  drift_ *= kept;
  drift_covariance_ = kept * (drift_covariance_ + distance * drift_variance_);
  drift_variance_ += (1.0 - kept * kept) * (square(config_.drift_sigma) - drift_variance_);
}

/// The second row of the gain, before `variance_` is corrected.
void ScaleFilter::learn_drift(double gain, double measured, double innovation) {
  const double drift_gain = drift_covariance_ / (variance_ + measured);
  drift_ += drift_gain * innovation;
  drift_variance_ -= drift_gain * drift_covariance_;
  drift_covariance_ *= 1.0 - gain;
  expected_ = 0.0;
}

void ScaleFilter::forget_drift() {
  drift_ = 0.0;
  drift_covariance_ = 0.0;
  drift_variance_ = square(config_.drift_sigma);
  expected_ = 0.0;
}

double ScaleFilter::sigma() const {
  return std::sqrt(std::min(variance_, held_.value_or(variance_)) + doubt_);
}

double ScaleFilter::path_sigma() const {
  if (!held_) return std::sqrt(path_variance_ + doubt_);
  const double held = *held_ * correlation_growth(config_.max_correlation);  // it changes slowly
  return std::sqrt(std::min(path_variance_, held) + doubt_);
}

double ScaleFilter::age_s(std::int64_t stamp_ns) const {
  return locked_ ? 1e-9 * static_cast<double>(stamp_ns - accepted_stamp_ns_) : 0.0;
}

}  // namespace sovo
