#include "sovo/bridge/dashboard/vehicle_metrics.h"

#include <spdlog/fmt/fmt.h>

#include <chrono>
#include <optional>

#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"

namespace sovo::bridge {
namespace {

using Clock = std::chrono::steady_clock;
using Labels = std::map<std::string, std::string>;

constexpr std::size_t kMostVehicles = 64;

}  // namespace

struct VehicleMetrics::Vehicle {
  Vehicle(Reader<msg::VoStatus> s, Reader<msg::ScaledOdometry> p)
      : statuses(std::move(s)), poses(std::move(p)) {}

  Reader<msg::VoStatus> statuses;
  Reader<msg::ScaledOdometry> poses;
  std::map<std::string, double> values;

  void update();
};

void VehicleMetrics::Vehicle::update() {
  const auto set = [this](const char* name, auto value) {
    values[name] = static_cast<double>(value);
  };
  (void)statuses.take_each([&](const msg::VoStatus& s, const dds_sample_info_t& info) {
    set("sovo_vo_state", s.state);
    set("sovo_vo_status_time_seconds", static_cast<double>(info.source_timestamp) * 1e-9);
    set("sovo_vo_received_total", s.received);
    set("sovo_vo_lost_transport_total", s.lost_transport);
    set("sovo_vo_dropped_queue_total", s.dropped_queue);
    set("sovo_vo_rejected_total", s.rejected);
    set("sovo_vo_resets_total", s.reset_counter);
    set("sovo_vo_segment", s.segment);
    set("sovo_vo_points", s.points);
    set("sovo_vo_inliers", s.inliers);
    set("sovo_vo_keyframes", s.keyframes);
    set("sovo_vo_queue_depth", s.queue_depth);
    set("sovo_vo_sync_error_seconds", s.sync_error_s);
    set("sovo_vo_residual", s.residual);
    set("sovo_vo_latency_seconds", s.latency_s);
    set("sovo_vo_distance_meters", s.distance_m);
  });
  (void)poses.take_each([&](const msg::ScaledOdometry& p, const dds_sample_info_t&) {
    set("sovo_vo_log_scale", p.log_scale);
    set("sovo_vo_log_scale_sigma", p.log_scale_sigma);
    set("sovo_vo_scale_residual", p.scale_residual);
    set("sovo_vo_scale_age_seconds", p.scale_age_s);
  });
}

VehicleMetrics::VehicleMetrics() = default;
VehicleMetrics::~VehicleMetrics() = default;

void VehicleMetrics::add(const Participant& participant, const std::string& ns) {
  const std::lock_guard lock(mutex_);
  if (vehicles_.count(ns) != 0 || vehicles_.size() >= kMostVehicles) return;
  auto statuses = Reader<msg::VoStatus>::open(participant, ns + "/" + topics::kStatus, reliable(1));
  auto poses = Reader<msg::ScaledOdometry>::open(participant, ns + "/" + topics::kScaledOdometry,
                                                 reliable(1));
  if (!statuses || !poses) return;
  vehicles_[ns] = std::make_unique<Vehicle>(std::move(*statuses), std::move(*poses));
}

void VehicleMetrics::collect(std::multimap<std::string, std::string>* samples) {
  const std::lock_guard lock(mutex_);
  for (auto& [ns, vehicle] : vehicles_) {
    vehicle->update();
    for (const auto& [name, value] : vehicle->values) {
      samples->emplace(name, prometheus_sample(name, {{"vehicle", ns}}, value));
    }
  }
}

std::string prometheus_sample(const std::string& name, const Labels& labels, double value) {
  std::string text = name;
  char separator = '{';
  for (const auto& [key, content] : labels) {
    text += separator + key + "=\"";
    for (const char c : content) {
      if (c == '\\' || c == '"') text += '\\';
      text += c == '\n' ? ' ' : c;
    }
    text += '"';
    separator = ',';
  }
  if (!labels.empty()) text += '}';
  return text + fmt::format(" {}\n", value);
}

}  // namespace sovo::bridge
