#include "sovo/app/report/dive_runs.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <utility>

namespace sovo::app {
namespace {

/// Which run something belongs to: that of its frame; without one, that of its time.
class RunFinder {
 public:
  void add(std::uint64_t log_ns, std::int64_t stamp_ns, std::uint32_t run) {
    by_stamp_[stamp_ns][log_ns] = run;
    by_time_[log_ns] = run;
  }

  bool is_empty() const { return by_time_.empty(); }

  /// A recording that is played again has the same stamps again: then the nearest in time.
  std::uint32_t find(std::uint64_t log_ns, std::int64_t stamp_ns) const {
    const auto same_frame = by_stamp_.find(stamp_ns);
    if (same_frame == by_stamp_.end()) return at_or_before(by_time_, log_ns);
    const RunsByTime& runs = same_frame->second;
    const auto after = runs.lower_bound(log_ns);
    if (after == runs.end()) return std::prev(after)->second;
    if (after == runs.begin()) return after->second;
    const auto before = std::prev(after);
    return after->first - log_ns < log_ns - before->first ? after->second : before->second;
  }

 private:
  using RunsByTime = std::map<std::uint64_t, std::uint32_t>;

  static std::uint32_t at_or_before(const RunsByTime& runs, std::uint64_t log_ns) {
    const auto after = runs.upper_bound(log_ns);
    return after == runs.begin() ? 0 : std::prev(after)->second;
  }

  std::map<std::int64_t, RunsByTime> by_stamp_;
  RunsByTime by_time_;
};

bool began_anew(const DiveStatus& before, const DiveStatus& now) {
  return now.received < before.received || now.segment < before.segment;
}

bool began_anew(const DivePose& before, const DivePose& now) {
  return now.segment < before.segment ||
         (now.segment == before.segment && now.keyframe_id < before.keyframe_id);
}

}  // namespace

void number_runs(Dive* dive) {
  RunFinder finder;
  for (std::size_t i = 0; i < dive->statuses.size(); ++i) {
    DiveStatus& status = dive->statuses[i];
    if (i > 0) {
      const DiveStatus& before = dive->statuses[i - 1];
      status.run = before.run + (began_anew(before, status) ? 1 : 0);
    }
    finder.add(status.log_ns, status.stamp_ns, status.run);
  }
  const bool knows_frames = !finder.is_empty();
  for (std::size_t i = 0; i < dive->poses.size(); ++i) {
    DivePose& pose = dive->poses[i];
    if (knows_frames) {
      pose.run = finder.find(pose.log_ns, pose.stamp_ns);
    } else if (i > 0) {
      const DivePose& before = dive->poses[i - 1];
      pose.run = before.run + (began_anew(before, pose) ? 1 : 0);
    }
  }
  if (!knows_frames) {
    for (const DivePose& pose : dive->poses) finder.add(pose.log_ns, pose.stamp_ns, pose.run);
  }
  for (DiveKeyframe& keyframe : dive->keyframes) {
    keyframe.run = finder.find(keyframe.log_ns, keyframe.stamp_ns);
  }
}

std::size_t count_runs(const Dive& dive) {
  std::uint32_t last = 0;
  for (const DivePose& pose : dive.poses) last = std::max(last, pose.run);
  for (const DiveStatus& status : dive.statuses) last = std::max(last, status.run);
  return last + std::size_t{1};
}

std::vector<Dive> runs_of(const Dive& dive, std::size_t most) {
  std::map<std::uint32_t, std::size_t> metric_poses;
  for (const DivePose& pose : dive.poses) metric_poses[pose.run] += pose.metric ? 1 : 0;
  if (metric_poses.size() <= 1) return {dive};
  std::vector<std::pair<std::size_t, std::uint32_t>> longest;
  for (const auto& [run, count] : metric_poses) {
    if (count > 0) longest.emplace_back(count, run);
  }
  std::stable_sort(longest.begin(), longest.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  longest.resize(std::min(longest.size(), most));
  std::sort(longest.begin(), longest.end(),
            [](const auto& a, const auto& b) { return a.second < b.second; });
  std::vector<Dive> runs;
  for (const auto& [count, run] : longest) {
    const auto is_other = [run = run](const auto& item) { return item.run != run; };
    runs.push_back(dive);
    std::erase_if(runs.back().poses, is_other);
    std::erase_if(runs.back().keyframes, is_other);
  }
  return runs;
}

}  // namespace sovo::app
