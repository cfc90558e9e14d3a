#include "sovo/app/report/health_timeline.h"

#include <algorithm>
#include <array>
#include <cctype>

#include "sovo/eval/statistics.h"

namespace sovo::app {
namespace {

constexpr double kLeastSilence = 1.0;  // [s]
constexpr std::size_t kMostReasons = 4;

/// The same reason has other numbers in every frame.
std::string without_digits(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) out += c;
  }
  return out;
}

/// Reasons of a period, each kind as it was worded last.
class ReasonList {
 public:
  void add(std::uint32_t index, const std::string& reason) {
    if (reason.empty() || index == newest_) return;
    newest_ = index;
    const std::string kind = without_digits(reason);
    for (auto& [known, text] : reasons_) {
      if (known != kind) continue;
      text = reason;
      return;
    }
    if (reasons_.size() < kMostReasons) {
      reasons_.emplace_back(kind, reason);
    } else {
      more_ = true;
    }
  }

  std::string text() const {
    std::string out;
    for (const auto& [kind, reason] : reasons_) out += (out.empty() ? "" : "; ") + reason;
    return more_ ? out + "; and others" : out;
  }

 private:
  std::vector<std::pair<std::string, std::string>> reasons_;
  std::uint32_t newest_ = 0;
  bool more_ = false;
};

double silence_of(const Dive& dive) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < dive.statuses.size(); ++i) {
    steps.push_back(dive.seconds(dive.statuses[i].log_ns) -
                    dive.seconds(dive.statuses[i - 1].log_ns));
  }
  return std::max(kLeastSilence, 5.0 * quantile(std::move(steps), 0.5));
}

}  // namespace

std::string state_name(std::uint8_t state) {
  constexpr std::array<const char*, 7> kNames = {
      "Initializing", "Tracking", "Scale not observed", "Degraded", "Lost", "Resetting", "Stopped"};
  if (state == kSilent) return "Silent";
  return state < kNames.size() ? kNames[state] : "State " + std::to_string(state);
}

std::vector<HealthPeriod> health_timeline(const Dive& dive) {
  std::vector<HealthPeriod> periods;
  ReasonList reasons;
  const double silence = silence_of(dive);
  const auto end_at = [&](double time) {
    periods.back().end_s = time;
    if (periods.back().state != kSilent) periods.back().reason = reasons.text();
  };
  double last = 0.0;
  for (const DiveStatus& status : dive.statuses) {
    const double now = dive.seconds(status.log_ns);
    const bool after_silence = !periods.empty() && now - last > silence;
    if (after_silence) {
      end_at(last);
      periods.push_back({kSilent, last, now, 0, "no status came"});
    }
    if (periods.empty() || after_silence || periods.back().state != status.state) {
      if (!periods.empty()) end_at(now);
      periods.push_back({status.state, now, now, 0, ""});
      reasons = {};
    }
    reasons.add(status.reason, dive.reasons[status.reason]);
    ++periods.back().frames;
    last = now;
  }
  if (!periods.empty()) end_at(last);
  return periods;
}

double time_in(const std::vector<HealthPeriod>& periods, std::uint8_t state) {
  double sum = 0.0;
  for (const HealthPeriod& period : periods) {
    if (period.state == state) sum += period.duration_s();
  }
  return sum;
}

}  // namespace sovo::app
