// Feeds a v4l2loopback device with side-by-side YUYV images: the pattern of pattern.h, or those of
// a file that side_by_side made.
//
//     loopback_writer DEVICE WIDTH HEIGHT RATE FRAMES [FILE]
//
// With FILE it shows the first image until something comes on standard input, then feeds each
// image once.

#include <fcntl.h>
#include <linux/videodev2.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>
#include <vector>

#include "vm/pattern.h"

namespace {

using Image = std::vector<std::uint8_t>;

/// A loopback device that takes images of one size at one rate.
class Loopback {
 public:
  Loopback(const char* path, int width, int height, double rate)
      : device_(::open(path, O_RDWR | O_CLOEXEC)),
        period_(static_cast<long long>(1e9 / rate)),
        due_(std::chrono::steady_clock::now()) {
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = static_cast<std::uint32_t>(width);
    format.fmt.pix.height = static_cast<std::uint32_t>(height);
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_YUYV;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.bytesperline = static_cast<std::uint32_t>(2 * width);
    format.fmt.pix.sizeimage = static_cast<std::uint32_t>(2 * width * height);
    open_ = device_ >= 0 && ::ioctl(device_, VIDIOC_S_FMT, &format) == 0;
    if (!open_) std::perror("loopback_writer");
  }
  ~Loopback() { ::close(device_); }
  Loopback(const Loopback&) = delete;
  Loopback& operator=(const Loopback&) = delete;

  bool open() const { return open_; }

  /// Writes an image when it is due. After a stall of the machine it goes on at its rate, and does
  /// not catch up.
  bool write(const Image& image) {
    std::this_thread::sleep_until(due_);
    if (::write(device_, image.data(), image.size()) != static_cast<ssize_t>(image.size())) {
      std::perror("loopback_writer: write");
      return false;
    }
    due_ = std::max(due_ + period_, std::chrono::steady_clock::now());
    return true;
  }

 private:
  int device_;
  std::chrono::nanoseconds period_;
  std::chrono::steady_clock::time_point due_;
  bool open_ = false;
};

bool told_to_begin() {
  pollfd input{STDIN_FILENO, POLLIN, 0};
  return ::poll(&input, 1, 0) > 0;
}

bool feed_pattern(Loopback& device, int width, int height, long frames) {
  Image image(static_cast<std::size_t>(2 * width * height));
  for (long n = 0; n < frames; ++n) {
    sovo::test::draw_pattern(static_cast<std::uint32_t>(n), width, height, image.data());
    if (!device.write(image)) return false;
  }
  return true;
}

bool feed_file(Loopback& device, const std::string& path, std::size_t image_size, long frames) {
  std::ifstream file(path, std::ios::binary);
  std::vector<Image> images(static_cast<std::size_t>(frames), Image(image_size));
  for (Image& image : images) {
    if (!file.read(reinterpret_cast<char*>(image.data()),
                   static_cast<std::streamsize>(image.size()))) {
      std::fprintf(stderr, "loopback_writer: %s has fewer images\n", path.c_str());
      return false;
    }
  }
  while (!told_to_begin()) {
    if (!device.write(images.front())) return false;
  }
  return std::all_of(std::next(images.begin()), images.end(),
                     [&](const Image& image) { return device.write(image); });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 6) return 2;
  const int width = std::atoi(argv[2]);
  const int height = std::atoi(argv[3]);
  const long frames = std::atol(argv[5]);
  if (frames < 1) return 2;
  Loopback device(argv[1], width, height, std::atof(argv[4]));
  if (!device.open()) return 1;
  const auto size = static_cast<std::size_t>(2 * width * height);
  const bool fed = argc > 6 ? feed_file(device, argv[6], size, frames)
                            : feed_pattern(device, width, height, frames);
  return fed ? 0 : 1;
}
