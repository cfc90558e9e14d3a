#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "sovo/app/report/dive.h"
#include "sovo/app/report/dive_runs.h"
#include "sovo/bridge/calibration_conversion.h"
#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/io/recording.h"
#include "sovo/io/text.h"

namespace sovo::app {
namespace {

using bridge::MessageTraits;
namespace msg = bridge::msg;

constexpr char kDiagnostics[] = "/diagnostics";
constexpr std::size_t kMostComplaints = 1000;
constexpr std::size_t kLongestQuote = 500;

template <class T>
bool holds(const RecordedTopic& topic) {
  return topic.type == MessageTraits<T>::kRosName;
}

double finite_or_zero(double v) { return std::isfinite(v) ? v : 0.0; }

std::string shortened(const char* text) { return std::string(text).substr(0, kLongestQuote); }

std::vector<float> to_vector(const dds_sequence_float& s) {
  return {s._buffer, s._buffer + s._length};
}

/// Namespaces where an odometry spoke.
std::set<std::string> vehicles_of(const Recording& recording) {
  std::set<std::string> names;
  for (const auto& [name, topic] : recording.topics()) {
    const bool is_odometry = holds<msg::VoStatus>(topic) || holds<msg::ScaledOdometry>(topic);
    if (is_odometry && topic.messages > 0) names.insert(name.substr(0, name.rfind('/')));
  }
  return names;
}

std::string listed(const std::set<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + excerpt(name);
  return text;
}

Result<std::string> choose_vehicle(const Recording& recording, const std::string& ns) {
  const std::set<std::string> names = vehicles_of(recording);
  if (names.empty()) {
    return Error{std::string("there is no odometry in it: it needs topics of type ") +
                 MessageTraits<msg::VoStatus>::kRosName + " or " +
                 MessageTraits<msg::ScaledOdometry>::kRosName +
                 "; record while sovo vo runs, or play it back to sovo vo and record that"};
  }
  if (ns.empty()) {
    if (names.size() == 1) return *names.begin();
    return Error{"it has several vehicles, choose one with --ns: " + listed(names)};
  }
  const std::string wanted = ns.front() == '/' ? ns : "/" + ns;
  if (names.contains(wanted)) return wanted;
  return Error{"it has no odometry below " + excerpt(wanted) + ", but below " + listed(names)};
}

/// Takes the messages of one vehicle into a Dive.
class DiveReader {
 public:
  explicit DiveReader(Dive* dive) : dive_(*dive) { dive_.reasons.emplace_back(); }

  void take(const RecordedMessage& message) {
    const RecordedTopic& topic = *message.topic;
    Result<void> taken;
    if (holds<msg::VoStatus>(topic)) {
      taken = take_as<msg::VoStatus>(message);
    } else if (holds<msg::ScaledOdometry>(topic)) {
      taken = take_as<msg::ScaledOdometry>(message);
    } else if (holds<msg::Keyframe>(topic)) {
      taken = take_as<msg::Keyframe>(message);
    } else if (holds<msg::StereoCalibration>(topic)) {
      taken = take_as<msg::StereoCalibration>(message);
    } else if (holds<msg::DiagnosticArray>(topic)) {
      taken = take_as<msg::DiagnosticArray>(message);
    }
    if (!taken) refuse(topic.topic, taken.error());
  }

  /// Ends what was open, and notes what could not be read.
  void finish() {
    number_runs(&dive_);
    for (auto& [name, complaint] : open_) close(std::move(complaint));
    std::stable_sort(dive_.complaints.begin(), dive_.complaints.end(),
                     [](const auto& a, const auto& b) { return a.begin_ns < b.begin_ns; });
    for (const auto& [topic, refused] : refused_) {
      dive_.notes.push_back(std::to_string(refused.count) + " messages of " + excerpt(topic) +
                            " are left out: " + refused.why);
    }
  }

 private:
  struct Refused {
    std::size_t count = 0;
    std::string why;
  };

  template <class T>
  Result<void> take_as(const RecordedMessage& message) {
    const auto decoded = bridge::decode<T>(message.data);
    if (!decoded) return decoded.failure();
    return add(message.log_ns, **decoded);
  }

  void refuse(const std::string& topic, const std::string& why) {
    Refused& refused = refused_[topic];
    if (refused.count++ == 0) refused.why = why;
  }

  Result<void> add(std::uint64_t log_ns, const msg::VoStatus& m) {
    DiveStatus s;
    s.log_ns = log_ns;
    s.stamp_ns = bridge::stamp_ns(m.header.stamp);
    s.state = m.state;
    s.reason = reason_index(shortened(m.reason));
    s.session = m.session;
    s.sequence = m.sequence;
    s.segment = m.segment;
    s.received = m.received;
    s.lost_transport = m.lost_transport;
    s.dropped_queue = m.dropped_queue;
    s.rejected = m.rejected;
    s.latency_s = m.latency_s;
    s.sync_error_s = m.sync_error_s;
    s.distance_m = finite_or_zero(m.distance_m);
    const bool begins_anew = !dive_.statuses.empty() && s.received < dive_.statuses.back().received;
    restarts_ += begins_anew ? 1 : 0;
    dive_.statuses.push_back(s);
    for (std::uint32_t i = 0; i < m.stages._length; ++i) add_stage(m.stages._buffer[i]);
    return {};
  }

  /// A stage that did not run for this frame says again what it said before.
  void add_stage(const msg::StageTiming& stage) {
    if (!std::isfinite(stage.last_ms)) return;
    auto& [last, mean] = last_stage_[stage.name];
    if (last == stage.last_ms && mean == stage.mean_ms) return;
    last = stage.last_ms;
    mean = stage.mean_ms;
    dive_.stages[stage.name].push_back(stage.last_ms);
  }

  std::uint32_t reason_index(const std::string& reason) {
    if (reason.empty()) return 0;
    const auto [at, is_new] =
        reason_indices_.emplace(reason, static_cast<std::uint32_t>(dive_.reasons.size()));
    if (is_new) dive_.reasons.push_back(reason);
    return at->second;
  }

  Result<void> add(std::uint64_t log_ns, const msg::ScaledOdometry& m) {
    const auto& pose = m.pose.pose;
    if (!bridge::is_rigid(pose.position, pose.orientation)) {
      return Error{"their pose is not finite, or its quaternion is not of length 1"};
    }
    const auto& v = m.twist.twist.linear;
    DivePose p;
    p.log_ns = log_ns;
    p.stamp_ns = bridge::stamp_ns(m.header.stamp);
    p.T_odom_base = bridge::to_se3(pose.position, pose.orientation);
    p.speed = Vec3(v.x, v.y, v.z).norm();
    p.state = m.state;
    p.segment = m.segment;
    p.keyframe_id = m.keyframe_id;
    p.metric = m.scale_valid;
    p.log_scale = m.log_scale;
    p.log_scale_sigma = m.log_scale_sigma;
    p.scale_residual = m.scale_residual;
    p.scale_accepted = m.scale_verdict == MessageTraits<msg::ScaledOdometry>::SCALE_ACCEPTED;
    dive_.poses.push_back(p);
    return {};
  }

  Result<void> add(std::uint64_t log_ns, const msg::Keyframe& m) {
    const std::uint32_t count = m.u._length;
    if (m.v._length != count || m.inverse_depth._length != count || m.sigma._length != count) {
      return Error{"their lists differ in length"};
    }
    if (!bridge::is_rigid(m.pose.position, m.pose.orientation)) {
      return Error{"their pose is not finite, or its quaternion is not of length 1"};
    }
    DiveKeyframe& k = keyframe_of(m, log_ns);
    k.T_odom_left = bridge::to_se3(m.pose.position, m.pose.orientation);
    k.metric = std::isfinite(m.log_scale);
    k.u = to_vector(m.u);
    k.v = to_vector(m.v);
    k.inverse_depth = to_vector(m.inverse_depth);
    k.sigma = to_vector(m.sigma);
    return {};
  }

  /// The same keyframe again has the same frame; an odometry that was started again gives numbers
  /// that were given before to other frames, or to the same ones of a recording played again.
  DiveKeyframe& keyframe_of(const msg::Keyframe& m, std::uint64_t log_ns) {
    const std::int64_t stamp = bridge::stamp_ns(m.header.stamp);
    const auto key = std::make_tuple(m.segment, m.id, stamp, restarts_);
    const auto [at, is_new] = keyframe_indices_.emplace(key, dive_.keyframes.size());
    if (is_new) {
      dive_.keyframes.emplace_back();
      dive_.keyframes.back().log_ns = log_ns;
      dive_.keyframes.back().stamp_ns = stamp;
    }
    return dive_.keyframes[at->second];
  }

  Result<void> add(std::uint64_t /*log_ns*/, const msg::StereoCalibration& m) {
    auto cameras = bridge::from_message(m);
    if (!cameras) return cameras.failure();
    dive_.cameras = std::move(*cameras);
    return {};
  }

  Result<void> add(std::uint64_t log_ns, const msg::DiagnosticArray& m) {
    for (std::uint32_t i = 0; i < m.status._length; ++i) add(log_ns, m.status._buffer[i]);
    return {};
  }

  /// Names begin with the namespace: "auv1: camera".
  void add(std::uint64_t log_ns, const msg::DiagnosticStatus& m) {
    const std::string name = shortened(m.name);
    const std::string own = dive_.vehicle.substr(1) + ": ";
    if (!name.starts_with(own) && name.find(": ") != std::string::npos) return;
    if (name == own + "visual odometry") return;
    const auto found = open_.find(name);
    if (m.level == 0) {
      if (found == open_.end()) return;
      found->second.end_ns = log_ns;
      close(std::move(found->second));
      open_.erase(found);
      return;
    }
    if (found == open_.end()) {
      if (open_.size() < kMostComplaints)
        open_[name] = {name, m.level, shortened(m.message), log_ns, log_ns};
      return;
    }
    DiveComplaint& complaint = found->second;
    if (m.level >= complaint.level) complaint.text = shortened(m.message);
    complaint.level = std::max(complaint.level, m.level);
    complaint.end_ns = log_ns;
  }

  void close(DiveComplaint complaint) {
    if (dive_.complaints.size() < kMostComplaints) {
      dive_.complaints.push_back(std::move(complaint));
    }
  }

  Dive& dive_;
  std::map<std::string, std::uint32_t> reason_indices_;
  std::map<std::string, std::pair<float, float>> last_stage_;
  std::map<std::string, DiveComplaint> open_;
  std::map<std::string, Refused> refused_;
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::int64_t, std::uint32_t>, std::size_t>
      keyframe_indices_;
  std::uint32_t restarts_ = 0;
};

void add_topics(const Recording& recording, Dive* dive) {
  std::map<std::string, std::string> drops;
  for (const auto& file : recording.files()) {
    for (const auto& [topic, count] : file->metadata("sovo_drops").value_or(decltype(drops)())) {
      if (count != "0") drops[topic] += (drops[topic].empty() ? "" : " + ") + count;
    }
  }
  for (const auto& [name, topic] : recording.topics()) {
    const auto dropped = drops.find(name);
    dive->topics.push_back({name, topic.type, topic.messages,
                            dropped == drops.end() ? std::string() : dropped->second});
  }
}

}  // namespace

bool is_other_map(const DivePose& before, const DivePose& now) {
  return before.run != now.run || before.segment != now.segment;
}

bool goes_on(const DivePose& before, const DivePose& now) {
  constexpr std::uint64_t kLongestStep = 1'000'000'000;
  return !is_other_map(before, now) && now.log_ns - before.log_ns <= kLongestStep;
}

Result<Dive> read_dive(const std::string& path, const std::string& ns) {
  auto recording = Recording::open(path);
  if (!recording) return recording.failure();
  auto vehicle = choose_vehicle(**recording, ns);
  if (!vehicle) return Error{path + ": " + vehicle.error()};
  Dive dive;
  dive.path = path;
  dive.vehicle = std::move(*vehicle);
  dive.start_ns = (*recording)->start_ns();
  dive.end_ns = (*recording)->end_ns();
  DiveReader reader(&dive);
  (*recording)->seek(0, [&dive](const RecordedTopic& topic) {
    return topic.topic == kDiagnostics ||
           topic.topic.substr(0, topic.topic.rfind('/')) == dive.vehicle;
  });
  while (const auto message = (*recording)->next()) reader.take(*message);
  add_topics(**recording, &dive);
  for (const std::string& note : (*recording)->notes()) dive.notes.push_back(note);
  reader.finish();
  if (dive.statuses.empty() && dive.poses.empty()) {
    return Error{path + ": no message of its odometry could be read" +
                 (dive.notes.empty() ? "" : ": " + dive.notes.back())};
  }
  return dive;
}

}  // namespace sovo::app
