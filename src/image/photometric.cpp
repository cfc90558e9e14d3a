#include "sovo/image/photometric.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cstdint>

namespace sovo {

namespace {

/// Columns converted at a time when blocks are averaged, so that no memory is allocated.
constexpr int kChunk = 1024;

void convert_mono8(const std::uint8_t* in, const float* inverse_response, int n, float* out) {
  if (inverse_response == nullptr) {
    for (int i = 0; i < n; ++i) out[i] = static_cast<float>(in[i]);
  } else {
    for (int i = 0; i < n; ++i) out[i] = inverse_response[in[i]];
  }
}

void convert_mono16(const std::uint8_t* in, const float* inverse_response, int n, float* out) {
  for (int i = 0; i < n; ++i) {
    const std::uint32_t raw = in[2 * i] | static_cast<std::uint32_t>(in[2 * i + 1]) << 8U;
    out[i] = static_cast<float>(raw) / 257.0F;
  }
  if (inverse_response == nullptr) return;
  for (int i = 0; i < n; ++i) {
    const int below = std::min(static_cast<int>(out[i]), 254);
    const float* level = inverse_response + below;
    out[i] = level[0] + (out[i] - static_cast<float>(below)) * (level[1] - level[0]);
  }
}

/// Irradiance of `n` raw pixels from column `x` of row `y`.
void convert(const SideImage& side, const PhotometricCalibration& calibration, int x, int y, int n,
             float* out) {
  const float* inverse_response =
      calibration.inverse_response.empty() ? nullptr : calibration.inverse_response.data();
  const std::uint8_t* row =
      side.data->data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(side.step);
  if (side.format == PixelFormat::kMono8) {
    convert_mono8(row + x, inverse_response, n, out);
  } else {
    convert_mono16(row + 2 * static_cast<std::ptrdiff_t>(x), inverse_response, n, out);
  }
  if (calibration.vignette.empty()) return;
  const float* vignette = calibration.vignette.row(y) + x;
  for (int i = 0; i < n; ++i) out[i] /= vignette[i];
}

/// One row of block means from `factor` raw rows.
void reduce_row(const SideImage& side, const PhotometricCalibration& calibration, int factor,
                int row, ImageF* out) {
  std::array<float, kChunk> buffer;
  float* sums = out->row(row);
  std::fill_n(sums, out->width(), 0.0F);
  const int chunk = std::max(1, kChunk / factor);  // columns of the result
  for (int y = row * factor; y < (row + 1) * factor; ++y) {
    for (int begin = 0; begin < out->width(); begin += chunk) {
      const int n = std::min(chunk, out->width() - begin);
      convert(side, calibration, begin * factor, y, n * factor, buffer.data());
      for (int i = 0; i < n; ++i) {
        float sum = 0.0F;
        for (int k = 0; k < factor; ++k) sum += buffer[static_cast<std::size_t>(i * factor + k)];
        sums[begin + i] += sum;
      }
    }
  }
  const float weight = 1.0F / static_cast<float>(factor * factor);
  for (int i = 0; i < out->width(); ++i) sums[i] *= weight;
}

}  // namespace

void to_float(const SideImage& side, const PhotometricCalibration& calibration, int downscale,
              ImageF* out) {
  assert(side.valid && downscale >= 1 && downscale <= kChunk);
  assert(calibration.inverse_response.empty() || calibration.inverse_response.size() == 256);
  assert(calibration.vignette.empty() || (calibration.vignette.width() == side.width &&
                                          calibration.vignette.height() == side.height));
  out->resize(side.width / downscale, side.height / downscale);
  for (int y = 0; y < out->height(); ++y) {
    if (downscale == 1) {
      convert(side, calibration, 0, y, side.width, out->row(y));
    } else {
      reduce_row(side, calibration, downscale, y, out);
    }
  }
}

}  // namespace sovo
