#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "sovo/bridge/participant.h"

namespace sovo::bridge {

/// Numbers of the vehicles of one domain for Prometheus: the last status and pose of each, read
/// when they are asked for.
class VehicleMetrics {
 public:
  VehicleMetrics();
  ~VehicleMetrics();

  /// A vehicle's odometry was found; `ns`: "/auv1". Known ones and those that cannot be read are
  /// left alone.
  void add(const Participant& participant, const std::string& ns);
  /// The samples so far, in Prometheus' text form, by metric name.
  void collect(std::multimap<std::string, std::string>* samples);

 private:
  struct Vehicle;
  std::mutex mutex_;
  std::map<std::string, std::unique_ptr<Vehicle>> vehicles_;
};

/// `name{key="value",...} number`, with the values' special characters escaped.
std::string prometheus_sample(const std::string& name,
                              const std::map<std::string, std::string>& labels, double value);

}  // namespace sovo::bridge
