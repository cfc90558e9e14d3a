#include "sovo/io/photometric_file.h"

#include <algorithm>

#include "sovo/io/image_file.h"
#include "sovo/io/number_lines.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

float pixel(const GreyImage& image, std::size_t i) {
  if (image.format == PixelFormat::kMono8) return static_cast<float>(image.data[i]);
  return static_cast<float>(image.data[2 * i] | image.data[2 * i + 1] << 8);
}

Result<GreyImage> read_of_size(const std::string& path, int width, int height) {
  auto image = read_grey_image(path);
  if (!image) return image.failure();
  if (image->width != width || image->height != height) {
    return Error{path + ": is " + std::to_string(image->width) + "x" +
                 std::to_string(image->height) + ", but the camera's images are " +
                 std::to_string(width) + "x" + std::to_string(height)};
  }
  return image;
}

}  // namespace

Result<std::vector<float>> read_response(const std::string& path) {
  const auto file = NumberFile::read(path, " \t,");
  if (!file) return file.failure();
  std::vector<double> values;
  for (const NumberLine& line : file->lines()) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const auto value = line.number(i, "value " + std::to_string(values.size() + 1));
      if (!value) return value.failure();
      if (!values.empty() && *value <= values.back()) {
        return line.error(
            "value " + std::to_string(values.size() + 1) +
            " is not greater than the one before; the inverse response must increase");
      }
      values.push_back(*value);
    }
  }
  if (values.size() != 256) {
    return Error{path + ": has " + std::to_string(values.size()) +
                 " values; the inverse response needs 256"};
  }
  const double scale = 255.0 / (values.back() - values.front());
  std::vector<float> response;
  for (const double value : values) {
    response.push_back(static_cast<float>((value - values.front()) * scale));
  }
  return response;
}

Result<ImageF> read_vignette(const std::string& path, int width, int height, ImageU8* mask) {
  const auto image = read_of_size(path, width, height);
  if (!image) return image.failure();
  ImageF vignette(width, height);
  for (std::size_t i = 0; i < vignette.size(); ++i) vignette.data()[i] = pixel(*image, i);
  const float brightest = *std::max_element(vignette.data(), vignette.data() + vignette.size());
  if (brightest <= 0.0F) return Error{path + ": is black everywhere, which no vignette is"};
  for (std::size_t i = 0; i < vignette.size(); ++i) {
    float& v = vignette.data()[i];
    if (v > 0.0F) {
      v /= brightest;
      continue;
    }
    if (mask->empty()) {
      mask->resize(width, height);
      mask->fill(255);
    }
    mask->data()[i] = 0;
    v = 1.0F;
  }
  return vignette;
}

Result<ImageU8> read_mask(const std::string& path, int width, int height) {
  const auto image = read_of_size(path, width, height);
  if (!image) return image.failure();
  ImageU8 mask(width, height);
  for (std::size_t i = 0; i < mask.size(); ++i) {
    mask.data()[i] = pixel(*image, i) > 0.0F ? 255 : 0;
  }
  return mask;
}

Result<std::vector<ExposureTime>> read_exposure_times(const std::string& path) {
  const auto file = NumberFile::read(path, " \t,");
  if (!file) return file.failure();
  std::vector<ExposureTime> times;
  for (const NumberLine& line : file->lines()) {
    if (line.size() < 2) return line.error("id, stamp [s] and exposure [ms] are needed");
    const auto stamp = parse_seconds_as_ns(line.field(1));
    if (!stamp) return line.bad_field(1, "the stamp", "seconds");
    double exposure_s = 0.0;
    if (line.size() > 2) {
      const auto exposure_ms = line.number(2, "the exposure");
      if (!exposure_ms) return exposure_ms.failure();
      if (*exposure_ms < 0.0) return line.bad_field(2, "the exposure", "milliseconds");
      exposure_s = *exposure_ms * 1e-3;
    }
    times.push_back({std::string(line.field(0)), *stamp, exposure_s});
  }
  return times;
}

}  // namespace sovo
