// Feeds a v4l2loopback device with the pattern of pattern.h as YUYV.
//
//     pattern_writer DEVICE WIDTH HEIGHT RATE FRAMES

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <thread>
#include <vector>

#include "vm/pattern.h"

int main(int argc, char** argv) {
  if (argc < 6) return 2;
  const int width = std::atoi(argv[2]);
  const int height = std::atoi(argv[3]);
  const double rate = std::atof(argv[4]);
  const long frames = std::atol(argv[5]);
  const int device = ::open(argv[1], O_RDWR | O_CLOEXEC);
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  format.fmt.pix.width = static_cast<std::uint32_t>(width);
  format.fmt.pix.height = static_cast<std::uint32_t>(height);
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_YUYV;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.bytesperline = static_cast<std::uint32_t>(2 * width);
  format.fmt.pix.sizeimage = static_cast<std::uint32_t>(2 * width * height);
  if (device < 0 || ::ioctl(device, VIDIOC_S_FMT, &format) != 0) {
    std::perror("pattern_writer");
    return 1;
  }
  std::vector<std::uint8_t> image(format.fmt.pix.sizeimage);
  auto due = std::chrono::steady_clock::now();
  for (long n = 0; n < frames; ++n) {
    sovo::test::draw_pattern(static_cast<std::uint32_t>(n), width, height, image.data());
    std::this_thread::sleep_until(due);
    if (::write(device, image.data(), image.size()) != static_cast<ssize_t>(image.size())) {
      std::perror("pattern_writer: write");
      return 1;
    }
    // After a stall of the machine it goes on at its rate, and does not catch up.
    const auto period = std::chrono::nanoseconds(static_cast<long long>(1e9 / rate));
    due = std::max(due + period, std::chrono::steady_clock::now());
  }
  ::close(device);
  return 0;
}
