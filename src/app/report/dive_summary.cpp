#include "sovo/app/report/dive_summary.h"

#include <algorithm>
#include <cmath>

#include "sovo/eval/statistics.h"

namespace sovo::app {
namespace {

constexpr std::size_t kMostBins = 600;

/// What a counter grew by; one that fell was set to zero.
std::uint64_t growth(std::uint64_t before, std::uint64_t now) {
  return now >= before ? now - before : now;
}

void count_losses(const Dive& dive, DiveSummary* sum) {
  for (std::size_t i = 1; i < dive.statuses.size(); ++i) {
    const DiveStatus& a = dive.statuses[i - 1];
    const DiveStatus& b = dive.statuses[i];
    sum->lost_transport += growth(a.lost_transport, b.lost_transport);
    sum->dropped_queue += growth(a.dropped_queue, b.dropped_queue);
    sum->rejected += growth(a.rejected, b.rejected);
  }
}

/// Frames of the camera between the first and the last one that were reported on, run by run.
std::size_t count_sent(const Dive& dive) {
  constexpr std::uint64_t kLargestGap = 100'000;
  std::size_t sent = 0;
  const DiveStatus* before = nullptr;
  for (const DiveStatus& status : dive.statuses) {
    const bool follows = before != nullptr && before->session == status.session &&
                         status.sequence > before->sequence &&
                         status.sequence - before->sequence < kLargestGap;
    sent += follows ? status.sequence - before->sequence : 1;
    before = &status;
  }
  return sent;
}

void add_distance(const Dive& dive, DiveSummary* sum) {
  const DivePose* before = nullptr;
  const DivePose* metric = nullptr;
  for (const DivePose& pose : dive.poses) {
    if (before == nullptr || is_other_map(*before, pose)) ++sum->segments;
    before = &pose;
    if (!pose.metric) continue;
    ++sum->metric_poses;
    if (std::isfinite(pose.log_scale_sigma)) sum->last_sigma = pose.log_scale_sigma;
    if (metric != nullptr && goes_on(*metric, pose)) {
      sum->distance_m +=
          (pose.T_odom_base.translation() - metric->T_odom_base.translation()).norm();
    }
    metric = &pose;
  }
}

void add_latency(const Dive& dive, DiveSummary* sum) {
  std::vector<double> values;
  for (const DiveStatus& status : dive.statuses) {
    if (std::isfinite(status.latency_s)) values.push_back(status.latency_s);
  }
  if (values.empty()) return;
  sum->latency_median_s = quantile(values, 0.5);
  sum->latency_p95_s = quantile(values, 0.95);
  sum->latency_max_s = *std::max_element(values.begin(), values.end());
}

/// Bins of a second, or longer ones for long dives; the last one is as long as the others.
void add_rates(const Dive& dive, DiveSummary* sum) {
  if (dive.statuses.size() < 2) return;
  const double begin = dive.seconds(dive.statuses.front().log_ns);
  const double span = dive.seconds(dive.statuses.back().log_ns) - begin;
  const double width = std::max(1.0, span / static_cast<double>(kMostBins));
  const auto bins = static_cast<std::size_t>(span / width);
  std::vector<std::uint64_t> frames(bins + 1), losses(bins + 1);
  for (std::size_t i = 0; i < dive.statuses.size(); ++i) {
    const DiveStatus& status = dive.statuses[i];
    const auto bin = std::min(
        bins, static_cast<std::size_t>(std::max(0.0, dive.seconds(status.log_ns) - begin) / width));
    ++frames[bin];
    if (i == 0) continue;
    const DiveStatus& before = dive.statuses[i - 1];
    losses[bin] += growth(before.lost_transport, status.lost_transport) +
                   growth(before.dropped_queue, status.dropped_queue) +
                   growth(before.rejected, status.rejected);
  }
  std::vector<double> rates;
  for (std::size_t i = 0; i < bins; ++i) {
    rates.push_back(static_cast<double>(frames[i]) / width);
    sum->rates.push_back({begin + (static_cast<double>(i) + 0.5) * width, rates.back(), losses[i]});
  }
  if (bins > 0) sum->rates.back().losses += losses[bins];
  sum->rate_hz = quantile(std::move(rates), 0.5);
}

}  // namespace

DiveSummary summarize(const Dive& dive) {
  DiveSummary sum;
  sum.frames = dive.statuses.size();
  sum.sent = count_sent(dive);
  sum.keyframes = dive.keyframes.size();
  count_losses(dive, &sum);
  add_distance(dive, &sum);
  add_latency(dive, &sum);
  add_rates(dive, &sum);
  for (const auto& [name, times] : dive.stages) {
    sum.stages.push_back({name, times.size(), quantile(times, 0.5), quantile(times, 0.95),
                          *std::max_element(times.begin(), times.end())});
  }
  return sum;
}

}  // namespace sovo::app
