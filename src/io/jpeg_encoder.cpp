#include "sovo/io/jpeg_encoder.h"

#include <turbojpeg.h>

#include <string>

namespace sovo {

struct JpegEncoder::State {
  tjhandle handle = tjInitCompress();
  unsigned char* buffer = nullptr;  // tjCompress2 enlarges it
  unsigned long size = 0;
  ~State() {
    tjFree(buffer);
    if (handle != nullptr) tjDestroy(handle);
  }
};

JpegEncoder::JpegEncoder() : state_(std::make_unique<State>()) {}
JpegEncoder::~JpegEncoder() = default;

Result<std::span<const std::uint8_t>> JpegEncoder::encode(const std::uint8_t* grey, int width,
                                                          int height, int step, int quality) {
  if (state_->handle == nullptr) return Error{"the JPEG encoder cannot be started"};
  if (tjCompress2(state_->handle, grey, width, step, height, TJPF_GRAY, &state_->buffer,
                  &state_->size, TJSAMP_GRAY, quality, 0) != 0) {
    return Error{std::string("cannot write a JPEG: ") + tjGetErrorStr2(state_->handle)};
  }
  return std::span<const std::uint8_t>(state_->buffer, state_->size);
}

}  // namespace sovo
