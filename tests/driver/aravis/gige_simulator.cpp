#include "driver/aravis/gige_simulator.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ctime>

#include "driver/aravis/gige_bytes.h"
#include "driver/aravis/gige_description.h"
#include "sovo/driver/live/host_clock.h"

namespace sovo::gige {
namespace {

constexpr std::uint16_t kControlPort = 3956;
constexpr std::size_t kMemory = 0x10000;
constexpr std::uint32_t kXmlAddress = 0x8000;
constexpr std::uint32_t kXmlUrl = 0x200;
constexpr std::uint32_t kCapabilities = 0x934;
constexpr std::uint32_t kPrivilege = 0xa00;
constexpr std::uint32_t kStreamPort = 0xd00;
constexpr std::uint32_t kStreamPacketSize = 0xd04;
constexpr std::uint32_t kPacketDelay = 0xd08;  // in ticks of the clock, which are nanoseconds
constexpr std::uint32_t kStreamAddress = 0xd18;
constexpr std::uint16_t kInvalidAddress = 0x8003;
constexpr std::int64_t kTai = 37'000'000'000;    // PTP's time is ahead of UTC
constexpr std::int64_t kPtpTakes = 300'000'000;  // until its clock is set
constexpr std::size_t kOverhead = 20 + 8 + 8;    // of IP, UDP and GVSP in a packet
constexpr std::size_t kFramesKept = 6;

int bound_socket(const std::string& address, std::uint16_t port) {
  const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in in{};
  in.sin_family = AF_INET;
  in.sin_port = htons(port);
  ::inet_pton(AF_INET, address.c_str(), &in.sin_addr);
  sockaddr any{};
  std::memcpy(&any, &in, sizeof any);
  if (::bind(fd, &any, sizeof any) == 0) return fd;
  ::close(fd);
  return -1;
}

void send_to(int fd, const sockaddr_in& to, const Bytes& bytes) {
  sockaddr any{};
  std::memcpy(&any, &to, sizeof any);
  (void)::sendto(fd, bytes.data(), bytes.size(), 0, &any, sizeof any);
}

}  // namespace

std::int64_t instant_of(const std::uint8_t* pixels) {
  std::int64_t instant = 0;
  std::memcpy(&instant, pixels, sizeof instant);
  return instant;
}

void paint_instant(std::int64_t instant_ns, Bytes* pixels) {
  auto state = static_cast<std::uint64_t>(instant_ns) | 1U;
  for (std::uint8_t& pixel : *pixels) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    pixel = static_cast<std::uint8_t>(state >> 56U);
  }
  std::memcpy(pixels->data(), &instant_ns, sizeof instant_ns);
}

GigeSimulator::GigeSimulator(const GigeSimulatorConfig& config)
    : config_(config), xml_(gige_description(config)) {
  control_ = bound_socket(config.address, kControlPort);
  broadcast_ = bound_socket("255.255.255.255", kControlPort);
  stream_ = bound_socket(config.address, 0);
  running_ = control_ >= 0 && broadcast_ >= 0 && stream_ >= 0;
  reset();
  if (running_) thread_ = std::thread([this] { run(); });
}

GigeSimulator::~GigeSimulator() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
  for (const int fd : {control_, broadcast_, stream_}) {
    if (fd >= 0) ::close(fd);
  }
}

/// Memory as after switching on.
void GigeSimulator::reset() {
  memory_.assign(kMemory, 0);
  put(0x0000, 0x00020000);  // GigE Vision 2.0
  put(0x0004, 0x80000001);
  in_addr own{};
  ::inet_pton(AF_INET, config_.address.c_str(), &own);
  put(0x000c, ntohl(own.s_addr));  // an address of Ethernet of its own
  put(0x0014, 4);
  put(0x0024, ntohl(own.s_addr));
  put(0x0034, 0xff000000);
  put_text(0x0048, "sovo");
  put_text(0x0068, "Simulator");
  put_text(0x00d8, config_.serial);
  char url[64];
  std::snprintf(url, sizeof url, "Local:simulator.xml;%x;%zx", kXmlAddress, xml_.size());
  put_text(kXmlUrl, url);
  put_text(kXmlAddress, xml_);
  put(0x0600, 1);
  put(0x0904, 1);
  put(kCapabilities, config_.resend ? 6 : 2);
  put(0x0938, 3000);
  put(0x0940, 1'000'000'000);
  put(kStreamPacketSize, 1400);
  put(kWidth, static_cast<std::uint32_t>(config_.width));
  put(kHeight, static_cast<std::uint32_t>(config_.height));
  put(kPixelFormat, 0x01080001);
  put_float(kFrameRate, 20.0F);
  put_float(kExposure, 5000.0F);
  put_float(kTemperature, 41.5F);
  put(kThroughputLimit, 125'000'000);
  acquiring_ = false;
  ptp_since_ns_ = 0;
  action_ns_.reset();
  chunk_enabled_ = {};
  frame_id_ = 65530;  // wraps soon
  sent_.clear();
  switched_on_ns_ = read_host_clock().utc_ns;
  const std::scoped_lock lock(mutex_);
  edges_.clear();
  exposure_us_ = 5000.0;
}

GigeSimulatorCounts GigeSimulator::counts() const {
  const std::scoped_lock lock(mutex_);
  return counts_;
}

double GigeSimulator::exposure_us() const {
  const std::scoped_lock lock(mutex_);
  return exposure_us_;
}

void GigeSimulator::trigger_line(std::int64_t instant_ns) {
  const std::scoped_lock lock(mutex_);
  edges_.push_back(instant_ns);
}

std::uint32_t GigeSimulator::get(std::uint32_t address) const { return word(memory_, address); }

void GigeSimulator::put(std::uint32_t address, std::uint32_t value) {
  for (std::uint32_t i = 0; i < 4; ++i) {
    memory_[address + i] = static_cast<std::uint8_t>(value >> (24U - 8U * i));
  }
}

void GigeSimulator::put_text(std::uint32_t address, const std::string& text) {
  std::copy(text.begin(), text.end(), memory_.begin() + address);
}

void GigeSimulator::put_float(std::uint32_t address, float value) {
  put(address, std::bit_cast<std::uint32_t>(value));
}

float GigeSimulator::get_float(std::uint32_t address) const {
  return std::bit_cast<float>(get(address));
}

bool GigeSimulator::ptp_locked() const {
  return ptp_since_ns_ != 0 && read_host_clock().utc_ns > ptp_since_ns_ + kPtpTakes;
}

std::int64_t GigeSimulator::device_ns(std::int64_t utc_ns) const {
  if (ptp_locked()) return utc_ns + kTai;
  const auto age = static_cast<double>(utc_ns - switched_on_ns_);
  return config_.clock_offset_ns +
         static_cast<std::int64_t>(age * (1.0 + 1e-6 * config_.clock_ppm));
}

void GigeSimulator::run() {
  bool was_plugged = true;
  while (!stop_) {
    const std::int64_t wait_ns = next_exposure_ns() - read_host_clock().utc_ns;
    const std::int64_t wait_ms = std::clamp<std::int64_t>(wait_ns / 1'000'000, 0, 5);
    std::array<pollfd, 2> polls{pollfd{control_, POLLIN, 0}, pollfd{broadcast_, POLLIN, 0}};
    ::poll(polls.data(), polls.size(), static_cast<int>(wait_ms));
    const bool plugged = plugged_;
    if (plugged != was_plugged) reset();
    was_plugged = plugged;
    for (const int socket : {control_, broadcast_}) receive(socket);
    if (!plugged || !acquiring_) continue;
    const std::int64_t instant = next_exposure_ns();
    if (instant <= read_host_clock().utc_ns) expose(instant);
  }
}

/// When the next image is due, UTC; far away when nothing asks for one.
std::int64_t GigeSimulator::next_exposure_ns() const {
  constexpr std::int64_t kNever = std::int64_t{1} << 62;
  if (!acquiring_) return kNever;
  if (get(kTriggerMode) == 0) return next_free_ns_;
  if (get(kTriggerSource) == 2) return action_ns_.value_or(kNever);
  if (get(kTriggerSource) != 1) return kNever;
  const std::scoped_lock lock(mutex_);
  return edges_.empty() ? kNever : edges_.front();
}

void GigeSimulator::expose(std::int64_t instant_ns) {
  next_free_ns_ = instant_ns + std::llround(1e9 / static_cast<double>(get_float(kFrameRate)));
  action_ns_.reset();
  {
    const std::scoped_lock lock(mutex_);
    if (!edges_.empty() && get(kTriggerSource) == 1) edges_.pop_front();
    ++counts_.frames;
  }
  send_frame(instant_ns);
}

std::uint32_t GigeSimulator::payload_size() const {
  std::uint32_t size = get(kWidth) * get(kHeight);
  if (get(kChunkMode) == 0) return size;
  size += 8;
  if (chunk_enabled_[0]) size += 16;
  if (chunk_enabled_[1]) size += 12;
  return size;
}

Bytes GigeSimulator::payload(std::int64_t instant_ns) const {
  Bytes bytes(std::size_t{get(kWidth)} * get(kHeight));
  const auto image_size = static_cast<std::uint32_t>(bytes.size());
  paint_instant(instant_ns, &bytes);
  if (get(kChunkMode) == 0) return bytes;
  append(std::uint32_t{kChunkIdImage}, &bytes);
  append(image_size, &bytes);
  if (chunk_enabled_[0]) {
    append(static_cast<std::uint64_t>(device_ns(instant_ns)), &bytes);
    append(std::uint32_t{kChunkIdStamp}, &bytes);
    append(std::uint32_t{8}, &bytes);
  }
  if (chunk_enabled_[1]) {
    append(std::bit_cast<std::uint32_t>(static_cast<float>(config_.chunk_exposure_us)), &bytes);
    append(std::uint32_t{kChunkIdExposure}, &bytes);
    append(std::uint32_t{4}, &bytes);
  }
  return bytes;
}

void GigeSimulator::send_frame(std::int64_t instant_ns) {
  frame_id_ = static_cast<std::uint16_t>(frame_id_ == 0xffff ? 1 : frame_id_ + 1);
  const Bytes data = payload(instant_ns);
  const auto stamp = static_cast<std::uint64_t>(device_ns(instant_ns));
  std::vector<Packet> packets;
  const auto add = [&](std::uint32_t type) -> Packet& {
    Packet packet;
    append(std::uint16_t{0}, &packet);
    append(frame_id_, &packet);
    append(type << 24U | static_cast<std::uint32_t>(packets.size()), &packet);
    packets.push_back(std::move(packet));
    return packets.back();
  };
  Packet& leader = add(1);
  append(static_cast<std::uint32_t>(get(kChunkMode) == 0 ? 1 : 0x4001), &leader);
  append(stamp, &leader);
  for (const std::uint32_t field : {get(kPixelFormat), get(kWidth), get(kHeight), 0U, 0U, 0U}) {
    append(field, &leader);
  }
  const std::size_t step = (get(kStreamPacketSize) & 0xffffU) - kOverhead;
  for (std::size_t at = 0; at < data.size(); at += step) {
    Packet& packet = add(3);
    const auto begin = data.begin() + static_cast<std::ptrdiff_t>(at);
    packet.insert(packet.end(), begin,
                  begin + static_cast<std::ptrdiff_t>(std::min(step, data.size() - at)));
  }
  Packet& trailer = add(2);
  append(std::uint32_t{1}, &trailer);
  append(get(kHeight), &trailer);
  sent_.push_back(std::move(packets));
  if (sent_.size() > kFramesKept) sent_.pop_front();
  ++acquisition_frames_;
  for (std::size_t i = 0; i < sent_.back().size(); ++i) {
    send_packet(i, false);
    pause_after(sent_.back()[i].size());
  }
}

/// Holds the next packet back for as long as the limit of the throughput and the pause between
/// packets, which are set, say. It never catches up.
void GigeSimulator::pause_after(std::size_t bytes) const {
  if (!config_.port) return;
  const double limit_ns = 1e9 * static_cast<double>(bytes) / get(kThroughputLimit);
  std::this_thread::sleep_for(
      std::chrono::nanoseconds(get(kPacketDelay) + static_cast<std::int64_t>(limit_ns)));
}

/// A packet of the newest frame.
void GigeSimulator::send_packet(std::size_t index, bool again) {
  const Packet& packet = sent_.back()[index];
  const bool is_data = packet[4] == 3;
  if (!again && is_data && std::uniform_real_distribution<double>(0.0, 1.0)(random_) < loss_) {
    const std::scoped_lock lock(mutex_);
    ++counts_.packets_lost;
    return;
  }
  if (config_.port && !config_.port->carry(packet.size())) return;
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(get(kStreamPort)));
  to.sin_addr.s_addr = htonl(get(kStreamAddress));
  send_to(stream_, to, packet);
}

void GigeSimulator::receive(int socket) {
  while (true) {
    Bytes bytes(2048);
    Request request;
    sockaddr from{};
    socklen_t size = sizeof from;
    const auto got = ::recvfrom(socket, bytes.data(), bytes.size(), 0, &from, &size);
    if (got < 0) return;
    bytes.resize(static_cast<std::size_t>(got));
    if (!plugged_ || bytes.size() < 8 || bytes[0] != 0x42) continue;
    std::memcpy(&request.from, &from, sizeof request.from);
    request.flags = bytes[1];
    request.command = static_cast<std::uint16_t>(number(bytes, 2, 2));
    request.id = static_cast<std::uint16_t>(number(bytes, 6, 2));
    request.payload.assign(bytes.begin() + 8, bytes.end());
    serve(request);
  }
}

void GigeSimulator::serve(const Request& request) {
  switch (request.command) {
    case 0x0002:
      answer(request, 0, Bytes(memory_.begin(), memory_.begin() + 0xf8));
      break;
    case 0x0040:
      serve_resend(request);
      break;
    case 0x0080:
      serve_read_registers(request);
      break;
    case 0x0082:
      serve_write_registers(request);
      break;
    case 0x0084:
      serve_read_memory(request);
      break;
    case 0x0086:
      serve_write_memory(request);
      break;
    case 0x0100:
      serve_action(request);
      break;
    default:
      answer(request, 0x8001, {});
  }
}

void GigeSimulator::answer(const Request& request, std::uint16_t status,
                           const Packet& payload) const {
  if ((request.flags & 1U) == 0) return;
  Bytes bytes;
  append(status, &bytes);
  append(static_cast<std::uint16_t>(request.command + 1), &bytes);
  append(static_cast<std::uint16_t>(payload.size()), &bytes);
  append(request.id, &bytes);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  send_to(control_, request.from, bytes);
}

void GigeSimulator::serve_read_registers(const Request& request) {
  Bytes values;
  for (std::size_t at = 0; at + 4 <= request.payload.size(); at += 4) {
    const std::uint32_t address = word(request.payload, at);
    if (address + 4 > memory_.size()) return answer(request, kInvalidAddress, {});
    append(read_register(address), &values);
  }
  answer(request, 0, values);
}

void GigeSimulator::serve_write_registers(const Request& request) {
  for (std::size_t at = 0; at + 8 <= request.payload.size(); at += 8) {
    const std::uint32_t address = word(request.payload, at);
    if (address + 4 > kXmlAddress) return answer(request, kInvalidAddress, {});
    write_register(address, word(request.payload, at + 4));
  }
  Bytes index;
  append(static_cast<std::uint32_t>(request.payload.size() / 8), &index);
  answer(request, 0, index);
}

void GigeSimulator::serve_read_memory(const Request& request) {
  const std::uint32_t address = word(request.payload, 0);
  const std::uint32_t size = word(request.payload, 4) & 0xffffU;
  if (address + size > memory_.size() || size > 536) return answer(request, kInvalidAddress, {});
  if (size == 4) put(address, read_register(address));
  Bytes bytes(request.payload.begin(), request.payload.begin() + 4);
  const auto begin = memory_.begin() + address;
  bytes.insert(bytes.end(), begin, begin + size);
  answer(request, 0, bytes);
}

void GigeSimulator::serve_write_memory(const Request& request) {
  const std::uint32_t address = word(request.payload, 0);
  if (address + request.payload.size() > kXmlAddress) return answer(request, kInvalidAddress, {});
  for (std::size_t at = 4; at + 4 <= request.payload.size(); at += 4) {
    write_register(address + static_cast<std::uint32_t>(at) - 4, word(request.payload, at));
  }
  Bytes index;
  append(static_cast<std::uint32_t>(request.payload.size() - 4), &index);
  answer(request, 0, index);
}

std::uint32_t GigeSimulator::read_register(std::uint32_t address) {
  if (address == kPayloadSize) return payload_size();
  if (address == kPtpStatus) return ptp_since_ns_ == 0 ? 0 : (ptp_locked() ? 2 : 1);
  if (address == kChunkEnable) return chunk_enabled_[get(kChunkSelector) & 1U] ? 1 : 0;
  return get(address);
}

void GigeSimulator::write_register(std::uint32_t address, std::uint32_t value) {
  const std::int64_t now = read_host_clock().utc_ns;
  // It rounds: full microseconds.
  if (address == kExposure)
    value = std::bit_cast<std::uint32_t>(std::round(std::bit_cast<float>(value)));
  // It has no gain above 10.
  if (address == kGain && std::bit_cast<float>(value) > 10.0F)
    value = std::bit_cast<std::uint32_t>(10.0F);
  if (address == kWidth) value = std::min(value, static_cast<std::uint32_t>(config_.width));
  if (address == kHeight) value = std::min(value, static_cast<std::uint32_t>(config_.height));
  put(address, value);
  if (address == kAcquisitionStart) {
    acquiring_ = true;
    next_free_ns_ = now;
    const std::scoped_lock lock(mutex_);
    ++counts_.acquisitions;
    edges_.clear();
  }
  if (address == kAcquisitionStop) acquiring_ = false;
  if (address == kPrivilege && value == 0) acquiring_ = false;
  if (address == kChunkEnable) chunk_enabled_[get(kChunkSelector) & 1U] = value != 0;
  if (address == kPtpEnable && (value != 0) != (ptp_since_ns_ != 0))
    ptp_since_ns_ = value != 0 ? now : 0;
  if (address == kTimestampLatch) {
    const auto time = static_cast<std::uint64_t>(device_ns(now));
    put(kTimestampValue, static_cast<std::uint32_t>(time >> 32U));
    put(kTimestampValue + 4, static_cast<std::uint32_t>(time));
  }
  if (address == kTriggerSoftware && get(kTriggerMode) == 1 && get(kTriggerSource) == 0) {
    {
      const std::scoped_lock lock(mutex_);
      ++counts_.software_triggers;
    }
    if (acquiring_) expose(now);
  }
  const std::scoped_lock lock(mutex_);
  if (address == kExposure) exposure_us_ = static_cast<double>(std::bit_cast<float>(value));
}

void GigeSimulator::serve_resend(const Request& request) {
  const std::uint32_t frame = word(request.payload, 0) & 0xffffU;
  const std::uint32_t first = word(request.payload, 4) & 0xffffffU;
  const std::uint32_t last = word(request.payload, 8) & 0xffffffU;
  for (std::size_t i = 0; i < sent_.size(); ++i) {
    if (number(sent_[i].front(), 2, 2) != frame) continue;
    std::swap(sent_[i], sent_.back());
    for (std::size_t at = first; at <= last && at < sent_.back().size(); ++at) {
      send_packet(at, true);
      const std::scoped_lock lock(mutex_);
      ++counts_.packets_resent;
    }
    std::swap(sent_[i], sent_.back());
  }
}

void GigeSimulator::serve_action(const Request& request) {
  const Bytes& p = request.payload;
  const bool ours = p.size() >= 12 && word(p, 0) == get(kActionDeviceKey) &&
                    word(p, 4) == get(kActionGroupKey) && (word(p, 8) & get(kActionGroupMask)) != 0;
  if (!ours) return;
  const bool scheduled = (request.flags & 0x80U) != 0 && p.size() == 20;
  if (!scheduled || !ptp_locked()) return answer(request, 0x8013, {});
  const std::int64_t instant = static_cast<std::int64_t>(number(p, 12, 8)) - kTai;
  const bool late = instant < read_host_clock().utc_ns;
  {
    const std::scoped_lock lock(mutex_);
    ++(late ? counts_.actions_late : counts_.actions);
  }
  if (!late) action_ns_ = instant;
  answer(request, late ? 0x8016 : 0, {});
}

}  // namespace sovo::gige
