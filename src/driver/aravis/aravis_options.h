#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

namespace sovo::aravis {

/// What makes the two cameras expose at one instant; the better ones first.
enum class Sync {
  kAuto,      ///< The first of these that both cameras can; hardware only when a line is named.
  kHardware,  ///< A trigger line.
  kAction,    ///< Clocks set by PTP (IEEE 1588), exposures by scheduled action commands.
  kPtp,       ///< Clocks set by PTP, each camera runs by itself.
  kSoftware,  ///< A trigger command to each camera at the same instant.
  kFree,      ///< Nothing: each runs by itself, images are paired by tracked clocks.
};

constexpr std::array<std::pair<Sync, const char*>, 6> enum_names(Sync) {
  return {{{Sync::kAuto, "auto"},
           {Sync::kHardware, "hardware"},
           {Sync::kAction, "action"},
           {Sync::kPtp, "ptp"},
           {Sync::kSoftware, "software"},
           {Sync::kFree, "free"}}};
}

const char* to_string(Sync sync);

/// Which GigE Vision cameras, and how.
struct AravisOptions {
  std::string left;  ///< Serial number or address.
  std::string right;
  std::string pixel_format = "Mono8";
  double frame_rate = 0.0;  ///< [Hz]; 0: the cameras' own.
  Sync sync = Sync::kAuto;
  std::string trigger_source;         ///< E.g. "Line1"; empty: no line is wired.
  std::vector<std::string> features;  ///< "Name=value"
  int packet_size = 0;                ///< [bytes]; 0: what the interface carries.
  bool resend = true;
  bool chunks = true;
  int socket_buffer_kb = 0;  ///< 0: an image.
  int throughput_mbps = 0;   ///< A camera [Mbit/s]; 0: half the port when both share it.
  int buffers = 16;
  double stamp_offset_ms = 0.0;  ///< Added to the stamps [ms].

  template <class Visitor>
  void visit(Visitor& v) {
    v("left", left, "serial number or address of the left camera");
    v("right", right, "of the right camera");
    v("pixel_format", pixel_format, "Mono8, Mono10, Mono12, Mono16, packed ones, or BayerXX8");
    v("frame_rate", frame_rate, "images a second [Hz]; 0: the cameras' own");
    v("sync", sync, "what makes both expose at one instant; auto: the best that both can");
    v("trigger_source", trigger_source, "wired line, e.g. Line1; auto then means hardware");
    v("features", features, "GenICam features, [Name=value, ...], each read back");
    v("packet_size", packet_size, "largest packet [bytes]; 0: what the interface carries");
    v("resend", resend, "ask for lost packets again");
    v("chunks", chunks, "have stamp and exposure with each image, where offered");
    v("socket_buffer_kb", socket_buffer_kb, "receive buffer of a camera [kB]; 0: an image");
    v("throughput_mbps", throughput_mbps,
      "limit of each camera [Mbit/s]; 0: its share when both are on one port");
    v("buffers", buffers, "image buffers of a camera, 4 to 64");
    v("stamp_offset_ms", stamp_offset_ms, "added to the stamps, where a camera's are late [ms]");
  }
};

}  // namespace sovo::aravis
