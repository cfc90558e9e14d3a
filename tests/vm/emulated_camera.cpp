// A USB camera emulated behind the kernel's vhci_hcd, so that the real uvcvideo driver binds to it.
// It streams the pattern of pattern.h. Ending the process unplugs it.
//
//     emulated_camera PORT zed
//     emulated_camera PORT left|right [LATE_MS]
//
// The first is like a ZED. The others have one side each and expose at the same instants, multiples
// of the frame period by CLOCK_MONOTONIC, whose count is the image's number; LATE_MS later if
// given.

#include <fcntl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <mutex>
#include <string>
#include <thread>

#include "vm/pattern.h"
#include "vm/usbip.h"
#include "vm/uvc_descriptors.h"

namespace sovo::test {
namespace {

constexpr std::size_t kPayload = 16384;  // bytes a bulk transfer
constexpr std::size_t kPayloadHeader = 2;
constexpr std::size_t kLargestOutput = 65536;

/// UVC's requests.
enum Request { kSetCur = 1, kGetCur = 0x81, kGetMin, kGetMax, kGetRes, kGetLen, kGetInfo, kGetDef };

enum class Sides { kBoth, kLeft, kRight };

/// When images are taken, and their numbers.
class Shutter {
 public:
  using Clock = std::chrono::steady_clock;

  /// `by_clock`: numbers and instants are those of the clock, `late` after the period's multiples;
  /// an instant that was missed has no image. Else each image is one period after the last, or as
  /// soon as it can be, and the numbers have no gaps.
  Shutter(bool by_clock, Clock::duration late) : by_clock_(by_clock), late_(late) {}

  void restart() { due_ = Clock::now(); }

  /// Number of the next image.
  std::uint32_t prepare(Clock::duration period) {
    period_ = period;
    if (by_clock_) {
      const auto number = (Clock::now().time_since_epoch() - late_) / period + 1;
      due_ = Clock::time_point(number * period + late_);
      return static_cast<std::uint32_t>(number);
    }
    return number_++;
  }

  /// Waits for its instant; false when that has passed.
  bool release() {
    std::this_thread::sleep_until(due_);
    if (by_clock_) return Clock::now() - due_ < period_ / 8;
    due_ = std::max(due_ + period_, Clock::now());
    return true;
  }

 private:
  const bool by_clock_;
  const Clock::duration late_;
  Clock::duration period_{};
  Clock::time_point due_ = Clock::now();
  std::uint32_t number_ = 0;
};

class EmulatedCamera {
 public:
  EmulatedCamera(int socket, Sides sides, std::chrono::milliseconds late)
      : socket_(socket), sides_(sides), shutter_(sides != Sides::kBoth, late) {
    probe_ = fixed_probe(Bytes(34));
    streamer_ = std::thread([this] { stream(); });
  }
  ~EmulatedCamera() {
    {
      const std::scoped_lock lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    streamer_.join();
  }
  EmulatedCamera(const EmulatedCamera&) = delete;
  EmulatedCamera& operator=(const EmulatedCamera&) = delete;

  /// Answers the kernel until it lets go.
  void serve() {
    UsbipHeader header;
    while (read_all(&header, sizeof header)) {
      if (header.command() == kUnlink) {
        unlink(header);
        continue;
      }
      Bytes output;
      if (!header.to_host() && header.length() > 0) {
        if (header.length() > kLargestOutput) return;
        output.resize(header.length());
        if (!read_all(output.data(), output.size())) return;
      }
      if (header.endpoint() == 0) {
        control(header, output);
      } else {
        const std::scoped_lock lock(mutex_);
        waiting_.push_back({header.sequence(), header.length()});
        changed_.notify_all();
      }
    }
  }

 private:
  /// A bulk transfer that the driver waits for.
  struct Transfer {
    std::uint32_t sequence;
    std::uint32_t length;
  };

  bool read_all(void* to, std::size_t size) const {
    auto* at = static_cast<std::uint8_t*>(to);
    while (size > 0) {
      const ssize_t n = ::read(socket_, at, size);
      if (n <= 0) return false;
      at += n;
      size -= static_cast<std::size_t>(n);
    }
    return true;
  }

  void write_all(const void* from, std::size_t size) const {
    const auto* at = static_cast<const std::uint8_t*>(from);
    while (size > 0) {
      const ssize_t n = ::write(socket_, at, size);
      if (n <= 0) std::_Exit(0);
      at += n;
      size -= static_cast<std::size_t>(n);
    }
  }

  void reply(std::uint32_t sequence, int status, const std::uint8_t* data, std::size_t size,
             std::size_t actual) {
    UsbipHeader header;
    header.set(0, kReturnSubmit);
    header.set(1, sequence);
    header.set(5, static_cast<std::uint32_t>(status));
    header.set(6, static_cast<std::uint32_t>(actual));
    const std::scoped_lock lock(write_mutex_);
    write_all(&header, sizeof header);
    if (size > 0) write_all(data, size);
  }

  void unlink(const UsbipHeader& header) {
    bool found = false;
    {
      const std::scoped_lock answering(answer_mutex_);
      const std::scoped_lock lock(mutex_);
      const auto at = std::find_if(waiting_.begin(), waiting_.end(), [&header](const Transfer& t) {
        return t.sequence == header.unlinked();
      });
      found = at != waiting_.end();
      if (found) waiting_.erase(at);
    }
    UsbipHeader answer;
    answer.set(0, kReturnUnlink);
    answer.set(1, header.sequence());
    answer.set(5, static_cast<std::uint32_t>(found ? -ECONNRESET : 0));
    const std::scoped_lock lock(write_mutex_);
    write_all(&answer, sizeof answer);
  }

  // Control requests.

  void control(const UsbipHeader& header, const Bytes& output) {
    const ControlRequest request(header.setup);
    bool known = true;
    const Bytes answer = (request.type & 0x60) == 0   ? standard(request, &known)
                         : (request.index & 255) == 1 ? streaming(request, output)
                                                      : unit(request, output, &known);
    const bool in = (request.type & 0x80) != 0;
    const std::size_t size = in ? std::min<std::size_t>(answer.size(), request.length) : 0;
    reply(header.sequence(), known ? 0 : -EPIPE, answer.data(), known ? size : 0,
          in ? size : output.size());
  }

  Bytes standard(const ControlRequest& request, bool* known) {
    const int kind = request.value >> 8;
    const int index = request.value & 255;
    if (request.request == 6 && kind == 1) return device_descriptor(model_);
    if (request.request == 6 && kind == 2) return configuration_descriptor(model_.modes);
    if (request.request == 6 && kind == 3) {
      const std::string texts[] = {"", model_.maker, model_.name, model_.serial};
      if (index == 0) return {4, 3, 9, 4};
      if (index < 4) return string_descriptor(texts[index]);
    }
    if (request.request == 0) return {0, 0};  // GET_STATUS
    if (request.request == 8) return {1};     // GET_CONFIGURATION
    if (request.request == 10) return {0};    // GET_INTERFACE
    *known = request.request != 6;
    // CLEAR_FEATURE of the endpoint: the driver ends a bulk stream so.
    if (request.request == 1 && (request.type & 31) == 2) set_streaming(false);
    return {};
  }

  /// Settings that can be: the nearest rate of the size that is asked for.
  Bytes fixed_probe(Bytes probe) const {
    probe.resize(34);
    probe[2] = 1;
    if (probe[3] < 1 || probe[3] > model_.modes.size()) {
      probe[3] = static_cast<std::uint8_t>(std::min<std::size_t>(3, model_.modes.size()));
    }
    const UvcMode& mode = model_.modes[probe[3] - 1U];
    const double wanted = get32(probe, 4);
    std::uint32_t best = kTicks / mode.rates.front();
    for (const std::uint32_t rate : mode.rates) {
      const std::uint32_t interval = kTicks / rate;
      if (std::abs(interval - wanted) < std::abs(best - wanted)) best = interval;
    }
    put32(&probe, 4, best);
    put32(&probe, 18, mode.bytes());
    put32(&probe, 22, kPayload);
    put32(&probe, 26, 48'000'000);
    probe[30] = 3;
    probe[31] = 1;
    return probe;
  }

  Bytes streaming(const ControlRequest& request, const Bytes& output) {
    Bytes probe = probe_;
    switch (request.request) {
      case kSetCur:
        probe_ = fixed_probe(output);
        if (request.value >> 8 == 2) set_streaming(true);
        return {};
      case kGetInfo:
        return {3};
      case kGetLen:
        return {34, 0};
      case kGetMin:
        put32(&probe, 4, 1);
        break;
      case kGetMax:
        put32(&probe, 4, kTicks);
        break;
      case kGetDef:
        put32(&probe, 4, kTicks / 30);
        break;
      default:
        break;
    }
    return fixed_probe(probe);
  }

  Bytes unit(const ControlRequest& request, const Bytes& output, bool* known) {
    if (request.index >> 8 == 0) return {static_cast<std::uint8_t>(request.request == kGetInfo)};
    for (UvcControl& control : controls_) {
      if (control.unit != request.index >> 8 || control.selector != request.value >> 8) continue;
      if (request.request == kGetInfo) return {3};
      if (request.request == kGetLen) return {static_cast<std::uint8_t>(control.size), 0};
      if (request.request == kSetCur) {
        Bytes padded = output;
        padded.resize(4);
        control.value = static_cast<int>(get32(padded, 0));
        return {};
      }
      const int values[] = {control.value, control.least, control.most, control.step};
      const std::size_t at = static_cast<std::size_t>(request.request) - kGetCur;
      const int value =
          request.request == kGetDef ? control.preset : values[std::min<std::size_t>(at, 3)];
      Bytes bytes(4);
      put32(&bytes, 0, static_cast<std::uint32_t>(value));
      bytes.resize(static_cast<std::size_t>(control.size));
      return bytes;
    }
    *known = false;
    return {};
  }

  // The stream.

  void set_streaming(bool on) {
    const std::scoped_lock lock(mutex_);
    streaming_ = on;
    mode_ = model_.modes[probe_[3] - 1U];
    interval_ = std::chrono::nanoseconds(100LL * get32(probe_, 4));
    changed_.notify_all();
  }

  void stream() {
    Bytes image;
    bool frame_id = false;
    while (true) {
      UvcMode mode;
      std::uint32_t number = 0;
      {
        std::unique_lock lock(mutex_);
        if (!streaming_ || waiting_.empty()) {
          changed_.wait(lock, [this] { return stop_ || (streaming_ && !waiting_.empty()); });
          shutter_.restart();
        }
        if (stop_) return;
        mode = mode_;
        number = shutter_.prepare(interval_);
      }
      draw(number, mode, &image);
      if (!shutter_.release()) continue;
      send(image, frame_id);
      frame_id = !frame_id;
    }
  }

  void draw(std::uint32_t number, const UvcMode& mode, Bytes* image) const {
    image->resize(mode.bytes());
    const int width = static_cast<int>(mode.width);
    const int height = static_cast<int>(mode.height);
    if (sides_ == Sides::kBoth) {
      draw_pattern(number, width, height, image->data());
    } else {
      draw_side(number, sides_ == Sides::kRight, width, height, 2 * std::size_t{mode.width},
                image->data());
    }
  }

  /// An image in payloads, each an answer to a transfer.
  void send(const Bytes& image, bool frame_id) {
    Bytes payload;
    for (std::size_t offset = 0; offset < image.size();) {
      wait_for_transfer();
      // While a transfer is answered it must not be unlinked.
      const std::scoped_lock answering(answer_mutex_);
      Transfer transfer{};
      {
        const std::scoped_lock lock(mutex_);
        if (stop_ || !streaming_) return;
        if (waiting_.empty()) continue;
        transfer = waiting_.front();
        waiting_.pop_front();
      }
      const std::size_t size =
          std::min<std::size_t>(transfer.length - kPayloadHeader, image.size() - offset);
      const bool last = offset + size == image.size();
      payload.assign(
          {kPayloadHeader, static_cast<std::uint8_t>(0x80 | (last ? 2 : 0) | (frame_id ? 1 : 0))});
      payload.insert(payload.end(), image.begin() + static_cast<std::ptrdiff_t>(offset),
                     image.begin() + static_cast<std::ptrdiff_t>(offset + size));
      reply(transfer.sequence, 0, payload.data(), payload.size(), payload.size());
      offset += size;
    }
  }

  void wait_for_transfer() {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, std::chrono::milliseconds(20),
                      [this] { return stop_ || !streaming_ || !waiting_.empty(); });
  }

  const int socket_;
  const Sides sides_;
  const UvcModel model_ = sides_ == Sides::kBoth ? zed_model() : eye_model(sides_ == Sides::kRight);
  std::vector<UvcControl> controls_ = usual_controls();
  Bytes probe_;
  std::mutex write_mutex_;
  std::mutex answer_mutex_;
  std::mutex mutex_;  ///< Guards what follows.
  std::condition_variable changed_;
  std::deque<Transfer> waiting_;
  bool streaming_ = false;
  bool stop_ = false;
  UvcMode mode_{};
  std::chrono::nanoseconds interval_{33'333'300};
  Shutter shutter_;  ///< Of the streaming thread.
  std::thread streamer_;
};

/// Hands a socket to vhci_hcd as a device of high speed at a port.
bool attach(int port, int socket) {
  constexpr int kDevice = 0x10002;
  constexpr int kHighSpeed = 3;
  const std::string text = std::to_string(port) + " " + std::to_string(socket) + " " +
                           std::to_string(kDevice) + " " + std::to_string(kHighSpeed);
  const int file = ::open("/sys/devices/platform/vhci_hcd.0/attach", O_WRONLY | O_CLOEXEC);
  const bool done =
      file >= 0 && ::write(file, text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (!done) std::perror("emulated_camera: vhci_hcd does not take the device");
  if (file >= 0) ::close(file);
  return done;
}

}  // namespace
}  // namespace sovo::test

int main(int argc, char** argv) {
  using sovo::test::Sides;
  std::signal(SIGPIPE, SIG_IGN);
  if (argc < 3) return 2;
  const std::string kind = argv[2];
  const Sides sides = kind == "zed" ? Sides::kBoth : kind == "left" ? Sides::kLeft : Sides::kRight;
  const std::chrono::milliseconds late(argc > 3 ? std::atoi(argv[3]) : 0);
  int sockets[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM, 0, sockets) != 0) {
    std::perror("emulated_camera: socketpair");
    return 1;
  }
  for (const int socket : sockets) {
    const int size = 4 << 20;
    ::setsockopt(socket, SOL_SOCKET, SO_SNDBUF, &size, sizeof size);
  }
  if (!sovo::test::attach(std::atoi(argv[1]), sockets[1])) return 1;
  ::close(sockets[1]);
  sovo::test::EmulatedCamera(sockets[0], sides, late).serve();
  return 0;
}
