#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "sovo/io/result.h"

namespace sovo {

/// Compresses grey images to JPEG, with memory that is used again.
class JpegEncoder {
 public:
  JpegEncoder();
  ~JpegEncoder();
  JpegEncoder(const JpegEncoder&) = delete;
  JpegEncoder& operator=(const JpegEncoder&) = delete;

  /// JPEG of a grey image of `height` rows, `step` bytes apart; `quality` is 1 to 100. The bytes
  /// are valid until the next call.
  Result<std::span<const std::uint8_t>> encode(const std::uint8_t* grey, int width, int height,
                                               int step, int quality);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace sovo
