#include "sovo/bridge/image_conversion.h"

#include <algorithm>

#include "sovo/bridge/borrow.h"

namespace sovo::bridge {
namespace {

/// Mean of the pixels of columns [x0, x1) and rows [y0, y1).
std::uint8_t mean_of_block(const GreyView& image, int x0, int x1, int y0, int y1) {
  std::uint32_t sum = 0;
  for (int y = y0; y < y1; ++y) {
    const std::uint8_t* row = image.data + static_cast<std::ptrdiff_t>(y) * image.step;
    for (int x = x0; x < x1; ++x) sum += row[x];
  }
  const auto count = static_cast<std::uint32_t>((x1 - x0) * (y1 - y0));
  return static_cast<std::uint8_t>((sum + count / 2) / count);
}

}  // namespace

msg::Image to_image(const SideImage& side, const msg::Header& header) {
  msg::Image m{};
  m.header = header;
  m.width = static_cast<std::uint32_t>(side.width);
  m.height = static_cast<std::uint32_t>(side.height);
  m.encoding = borrow(side.format == PixelFormat::kMono16 ? "mono16" : "mono8");
  m.step = static_cast<std::uint32_t>(side.step);
  borrow(m.data, *side.data);
  return m;
}

GreyView grey_view(const SideImage& side, std::vector<std::uint8_t>* storage) {
  if (side.format == PixelFormat::kMono8) {
    return {side.data->data(), side.width, side.height, side.step};
  }
  storage->resize(static_cast<std::size_t>(side.width) * side.height);
  std::uint8_t* out = storage->data();
  for (int y = 0; y < side.height; ++y) {
    const std::uint8_t* row = side.data->data() + static_cast<std::ptrdiff_t>(y) * side.step;
    for (int x = 0; x < side.width; ++x) *out++ = row[2 * x + 1];
  }
  return {storage->data(), side.width, side.height, side.width};
}

GreyView reduced(const GreyView& image, int width, std::vector<std::uint8_t>* storage) {
  if (image.width <= width) return image;
  const int height = std::max(1, image.height * width / image.width);
  storage->resize(static_cast<std::size_t>(width) * height);
  std::uint8_t* out = storage->data();
  for (int y = 0; y < height; ++y) {
    const int y0 = y * image.height / height;
    const int y1 = (y + 1) * image.height / height;
    for (int x = 0; x < width; ++x) {
      *out++ = mean_of_block(image, x * image.width / width, (x + 1) * image.width / width, y0, y1);
    }
  }
  return {storage->data(), width, height, width};
}

}  // namespace sovo::bridge
