#include "sovo/bridge/frame_number.h"

#include "sovo/bridge/cdr_codec.h"

namespace sovo::bridge {

std::optional<FrameNumber> frame_number(CdrBytes stereo_frame) {
  cdr_detail::Decoder decoder(stereo_frame);
  msg::Header header{};
  FrameNumber number;
  decoder.read(header);
  decoder.read(number.session);
  decoder.read(number.sequence);
  if (!decoder.error().empty()) return std::nullopt;
  return number;
}

}  // namespace sovo::bridge
