#pragma once

#include <netinet/in.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <random>
#include <string>
#include <thread>
#include <vector>

#include "driver/aravis/shared_port.h"

namespace sovo::gige {

struct GigeSimulatorConfig {
  std::string address;  ///< Loopback address that it listens on.
  std::string serial;
  int width = 160;
  int height = 120;
  bool ptp = true;  ///< It has the features of PTP, of action commands, of triggers.
  bool action = true;
  bool software = true;
  bool chunks = true;
  bool resend = true;
  bool throughput_limit = true;       ///< It has that feature.
  std::shared_ptr<SharedPort> port;   ///< What its packets pass; none: they all arrive.
  double clock_ppm = 0.0;             ///< Error of its own clock.
  std::int64_t clock_offset_ns = 0;   ///< Its own clock when it is switched on.
  double chunk_exposure_us = 3000.0;  ///< Exposure that images bring along.
};

/// What a simulator did and was asked.
struct GigeSimulatorCounts {
  std::uint64_t frames = 0;
  std::uint64_t packets_lost = 0;
  std::uint64_t packets_resent = 0;
  std::uint64_t software_triggers = 0;
  std::uint64_t actions = 0;
  std::uint64_t actions_late = 0;
  std::uint64_t acquisitions = 0;  ///< Starts.
};

/// The first pixels of an image: the instant of its exposure, UTC [ns].
std::int64_t instant_of(const std::uint8_t* pixels);
/// An image of an instant as a simulator makes it.
void paint_instant(std::int64_t instant_ns, std::vector<std::uint8_t>* pixels);

/// A GigE Vision camera: GVCP and GVSP over real sockets, with a GenICam description. It has what
/// libaravis' fake camera lacks: loss of packets with resend, chunks, PTP, scheduled action
/// commands, trigger lines, and being unplugged.
class GigeSimulator {
 public:
  explicit GigeSimulator(const GigeSimulatorConfig& config);
  ~GigeSimulator();
  GigeSimulator(const GigeSimulator&) = delete;
  GigeSimulator& operator=(const GigeSimulator&) = delete;

  /// Whether its sockets could be bound.
  bool is_running() const { return running_; }

  /// Share of image packets that are lost, of those sent for the first time.
  void lose_packets(double share) { loss_ = share; }
  /// Falls silent, and forgets what it was set to.
  void unplug() { plugged_ = false; }
  void plug() { plugged_ = true; }
  /// An edge on its line at an instant, UTC [ns].
  void trigger_line(std::int64_t instant_ns);

  GigeSimulatorCounts counts() const;
  /// The exposure that it was set to [us].
  double exposure_us() const;

 private:
  struct Request {
    std::uint16_t command = 0;
    std::uint16_t id = 0;
    std::uint8_t flags = 0;
    std::vector<std::uint8_t> payload;
    sockaddr_in from{};
  };
  using Packet = std::vector<std::uint8_t>;

  void run();
  void reset();
  void receive(int socket);
  void serve(const Request& request);
  void answer(const Request& request, std::uint16_t status, const Packet& payload) const;
  void serve_read_registers(const Request& request);
  void serve_write_registers(const Request& request);
  void serve_read_memory(const Request& request);
  void serve_write_memory(const Request& request);
  void serve_resend(const Request& request);
  void serve_action(const Request& request);

  std::uint32_t get(std::uint32_t address) const;
  void put(std::uint32_t address, std::uint32_t value);
  void put_text(std::uint32_t address, const std::string& text);
  void put_float(std::uint32_t address, float value);
  float get_float(std::uint32_t address) const;
  void write_register(std::uint32_t address, std::uint32_t value);
  std::uint32_t read_register(std::uint32_t address);

  std::int64_t device_ns(std::int64_t utc_ns) const;
  bool ptp_locked() const;
  std::int64_t next_exposure_ns() const;
  void expose(std::int64_t instant_ns);
  void send_frame(std::int64_t instant_ns);
  void send_packet(std::size_t index, bool again);
  void pause_after(std::size_t bytes) const;
  Packet payload(std::int64_t instant_ns) const;
  std::uint32_t payload_size() const;

  GigeSimulatorConfig config_;
  std::vector<std::uint8_t> memory_;
  std::string xml_;
  int control_ = -1;
  int broadcast_ = -1;
  int stream_ = -1;
  bool running_ = false;
  std::atomic<bool> stop_{false};
  std::atomic<bool> plugged_{true};
  std::atomic<double> loss_{0.0};
  std::mt19937 random_{11};

  bool acquiring_ = false;
  std::int64_t switched_on_ns_ = 0;
  std::int64_t ptp_since_ns_ = 0;
  std::int64_t next_free_ns_ = 0;
  std::optional<std::int64_t> action_ns_;
  std::array<bool, 2> chunk_enabled_{};
  std::uint16_t frame_id_ = 0;
  std::uint64_t acquisition_frames_ = 0;
  std::deque<std::vector<Packet>> sent_;  ///< Packets of the last frames.

  mutable std::mutex mutex_;  ///< Guards what follows.
  GigeSimulatorCounts counts_;
  std::deque<std::int64_t> edges_;
  double exposure_us_ = 0.0;

  std::thread thread_;
};

}  // namespace sovo::gige
