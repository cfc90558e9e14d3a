#include "sovo/driver/v4l2/extension_unit.h"

#include <linux/usb/video.h>
#include <linux/uvcvideo.h>

#include <array>
#include <string>

namespace sovo::v4l2 {

Result<void> UvcExtensionUnit::query(std::uint8_t what, std::span<std::uint8_t> data) const {
  uvc_xu_control_query request{};
  request.unit = unit_;
  request.selector = selector_;
  request.query = what;
  request.size = static_cast<std::uint16_t>(data.size());
  request.data = data.data();
  if (file_.control(UVCIOC_CTRL_QUERY, &request) == 0) return {};
  return Error{"extension unit " + std::to_string(unit_) + ": " + errno_text()};
}

Result<std::size_t> UvcExtensionUnit::message_size() {
  std::array<std::uint8_t, 2> length{};
  if (auto asked = query(UVC_GET_LEN, length); !asked) return asked.failure();
  return static_cast<std::size_t>(length[0] + 256 * length[1]);
}

Result<void> UvcExtensionUnit::send(std::span<std::uint8_t> message) {
  return query(UVC_SET_CUR, message);
}

Result<void> UvcExtensionUnit::receive(std::span<std::uint8_t> message) {
  return query(UVC_GET_CUR, message);
}

}  // namespace sovo::v4l2
