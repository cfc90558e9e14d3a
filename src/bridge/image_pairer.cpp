#include "sovo/bridge/image_pairer.h"

#include <utility>

#include "sovo/bridge/cdr_codec.h"
#include "sovo/bridge/ros_conversion.h"
#include "sovo/bridge/stereo_frame_conversion.h"
#include "sovo/io/image_file.h"

namespace sovo::bridge {
namespace {

using StampedImage = StereoPairing::Image;

Result<SideImage> decompressed(const msg::CompressedImage& message, const std::string& name) {
  if (message.header.stamp.nanosec >= 1'000'000'000U) {
    return Error{name + ".header.stamp.nanosec is a second or more"};
  }
  auto image = decode_grey_image({message.data._buffer, message.data._length});
  if (!image) return Error{name + ": " + image.error()};
  return to_side(std::move(*image));
}

Result<SideImage> side_of(const msg::Image& message, const std::string& name) {
  return from_message(message, name);
}
Result<SideImage> side_of(const msg::CompressedImage& message, const std::string& name) {
  return decompressed(message, name);
}

template <class T>
Result<StampedImage> read_image(ByteSpan data, const std::string& name) {
  const auto message = decode<T>(data);
  if (!message) return message.failure();
  auto side = side_of(**message, name);
  if (!side) return side.failure();
  const msg::Header& header = (*message)->header;
  return StampedImage{stamp_ns(header.stamp), std::move(*side), short_text(header.frame_id)};
}

Result<StampedImage> read_image(const RecordedMessage& message, const std::string& name) {
  const bool raw = message.topic->type == MessageTraits<msg::Image>::kRosName;
  return raw ? read_image<msg::Image>(message.data, name)
             : read_image<msg::CompressedImage>(message.data, name);
}

}  // namespace

ImagePairer::ImagePairer(ImageTopics topics, double tolerance_s)
    : topics_(std::move(topics)), pairing_(static_cast<std::int64_t>(1e9 * tolerance_s)) {}

void ImagePairer::add(const RecordedMessage& message) {
  const bool is_left = message.topic->topic == topics_.left;
  auto image = read_image(message, is_left ? "left" : "right");
  if (!image) {
    results_.push_back({SourceState::kBadFrame,
                        {},
                        "an image of " + message.topic->topic + " is refused: " + image.error()});
    return;
  }
  if (session_ == 0) session_ = static_cast<std::uint64_t>(image->stamp_ns);
  is_left ? pairing_.add_left(std::move(*image)) : pairing_.add_right(std::move(*image));
  take_pairs();
}

void ImagePairer::end() {
  pairing_.end();
  take_pairs();
}

void ImagePairer::take_pairs() {
  while (auto frame = pairing_.next()) {
    frame->session = session_;
    frame->sequence = sequence_++;
    results_.push_back({SourceState::kFrame, std::move(*frame), {}});
  }
}

std::optional<SourceResult> ImagePairer::next() {
  if (results_.empty()) return std::nullopt;
  SourceResult result = std::move(results_.front());
  results_.pop_front();
  return result;
}

}  // namespace sovo::bridge
