#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "sovo/bridge/image_topics.h"
#include "sovo/bridge/stereo_pairing.h"
#include "sovo/driver/frame_source.h"
#include "sovo/io/recording.h"

namespace sovo::bridge {

/// Makes stereo frames of recorded images, Image or CompressedImage, one at a time:
///
///     pairer.add(message);
///     while (auto result = pairer.next()) { ... }
///
/// An image that cannot be used comes out as kBadFrame with the reason. Frames are numbered from 0;
/// their session is the same whenever the same recording is read.
class ImagePairer {
 public:
  /// `tolerance_s`: largest difference of the stamps of a pair.
  ImagePairer(ImageTopics topics, double tolerance_s);

  /// Takes a message of one of the two topics.
  void add(const RecordedMessage& message);
  /// No image will follow: those that wait for a partner are given alone.
  void end();
  std::optional<SourceResult> next();

  const ImageTopics& topics() const { return topics_; }

 private:
  void take_pairs();

  ImageTopics topics_;
  StereoPairing pairing_;
  std::deque<SourceResult> results_;
  std::uint64_t session_ = 0;
  std::uint64_t sequence_ = 0;
};

}  // namespace sovo::bridge
