#include <csignal>
#include <cstdio>
#include <fstream>

#include "sovo/bridge/reader.h"
#include "sovo/bridge/topics.h"

// odometry_listener NAMESPACE FILE: writes what comes on scaled_odometry as a TUM file, until it is
// told to stop: what a subscriber that has nothing to do with the dashboard receives.

namespace {

volatile std::sig_atomic_t stop = 0;

int listen(const std::string& ns, const std::string& file) {
  sovo::bridge::DdsConfig config;
  config.ns = ns;
  auto participant = sovo::bridge::Participant::open(config, "listener");
  if (!participant) return std::fprintf(stderr, "%s\n", participant.error().c_str()), 1;
  auto reader = sovo::bridge::Reader<sovo::bridge::msg::ScaledOdometry>::open(
      *participant, sovo::bridge::topics::kScaledOdometry,
      sovo::bridge::topics::kScaledOdometryQos);
  if (!reader) return std::fprintf(stderr, "%s\n", reader.error().c_str()), 1;
  std::ofstream out(file);
  while (stop == 0) {
    reader->wait(std::chrono::milliseconds(100));
    (void)reader->take_each([&](const auto& m, const auto&) {
      const auto& [p, q] = m.pose.pose;
      char line[512];
      std::snprintf(line, sizeof(line), "%d.%09u %.9f %.9f %.9f %.9f %.9f %.9f %.9f\n",
                    m.header.stamp.sec, m.header.stamp.nanosec, p.x, p.y, p.z, q.x, q.y, q.z, q.w);
      out << line << std::flush;
    });
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  std::signal(SIGINT, [](int) { stop = 1; });
  return listen(argv[1], argv[2]);
}
