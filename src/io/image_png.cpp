#include <png.h>
#include <zlib.h>

#include <csetjmp>
#include <cstring>
#include <string>

#include "sovo/io/image_codecs.h"

namespace sovo::codecs {
namespace {

/// What libpng's callbacks work on. Its errors leave by longjmp, so whatever owns memory lives
/// outside the functions that call setjmp.
struct PngJob {
  std::span<const std::uint8_t> input;
  std::size_t at = 0;
  std::vector<std::uint8_t> output;
  RawPixels pixels;
  std::string error;
};

void on_error(png_structp png, png_const_charp message) {
  static_cast<PngJob*>(png_get_error_ptr(png))->error = message;
  std::longjmp(*png_set_longjmp_fn(png, std::longjmp, sizeof(jmp_buf)), 1);
}

void on_warning(png_structp /*png*/, png_const_charp /*message*/) {}

void read_bytes(png_structp png, png_bytep to, std::size_t size) {
  auto* job = static_cast<PngJob*>(png_get_io_ptr(png));
  if (size > job->input.size() - job->at) png_error(png, "the file ends too early");
  std::memcpy(to, job->input.data() + job->at, size);
  job->at += size;
}

void write_bytes(png_structp png, png_bytep from, std::size_t size) {
  auto* job = static_cast<PngJob*>(png_get_io_ptr(png));
  job->output.insert(job->output.end(), from, from + size);
}

void flush_nothing(png_structp /*png*/) {}

/// Asks for 8 or 16 bits, grey or RGB, without transparency, in the machine's byte order.
void set_transforms(png_structp png, png_infop info) {
  const int colour = png_get_color_type(png, info);
  if (colour == PNG_COLOR_TYPE_PALETTE) png_set_palette_to_rgb(png);
  if (png_get_bit_depth(png, info) < 8) png_set_expand_gray_1_2_4_to_8(png);
  if ((colour & PNG_COLOR_MASK_ALPHA) != 0) png_set_strip_alpha(png);
  if (png_get_bit_depth(png, info) == 16) png_set_swap(png);
  png_set_interlace_handling(png);
  png_read_update_info(png, info);
}

bool read_header(png_structp png, png_infop info, PngJob* job) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_read_fn(png, job, read_bytes);
  png_read_info(png, info);
  const std::int64_t count =
      std::int64_t{png_get_image_width(png, info)} * png_get_image_height(png, info);
  if (count > kMaxPixels) png_error(png, "the image is too large");
  set_transforms(png, info);
  job->pixels.width = static_cast<int>(png_get_image_width(png, info));
  job->pixels.height = static_cast<int>(png_get_image_height(png, info));
  job->pixels.channels = png_get_channels(png, info);
  job->pixels.bits = png_get_bit_depth(png, info);
  return true;
}

bool read_rows(png_structp png, png_bytepp rows) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_read_image(png, rows);
  png_read_end(png, nullptr);
  return true;
}

bool write_all(png_structp png, png_infop info, const GreyImage* image, png_bytepp rows,
               PngJob* job) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  png_set_write_fn(png, job, write_bytes, flush_nothing);
  // Camera noise leaves little else to find: as small in half the time.
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_set_compression_level(png, 1);
  png_set_compression_strategy(png, Z_RLE);
  png_set_IHDR(png, info, static_cast<png_uint_32>(image->width),
               static_cast<png_uint_32>(image->height), 8 * image->bytes_per_pixel(),
               PNG_COLOR_TYPE_GRAY, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_write_info(png, info);
  if (image->format == PixelFormat::kMono16) png_set_swap(png);
  png_write_image(png, rows);
  png_write_end(png, nullptr);
  return true;
}

std::vector<png_bytep> row_pointers(std::uint8_t* data, int height, std::size_t step) {
  std::vector<png_bytep> rows(static_cast<std::size_t>(height));
  for (std::size_t y = 0; y < rows.size(); ++y) rows[y] = data + y * step;
  return rows;
}

Error damaged(const PngJob& job) { return Error{"damaged PNG: " + job.error}; }

}  // namespace

Result<RawPixels> decode_png(std::span<const std::uint8_t> bytes) {
  PngJob job;
  job.input = bytes;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
  if (png == nullptr) return Error{"the PNG decoder cannot be started"};
  png_infop info = png_create_info_struct(png);
  bool good = info != nullptr && read_header(png, info, &job);
  if (good) {
    const std::size_t step = png_get_rowbytes(png, info);
    job.pixels.data.resize(step * job.pixels.height);
    auto rows = row_pointers(job.pixels.data.data(), job.pixels.height, step);
    good = read_rows(png, rows.data());
  }
  png_destroy_read_struct(&png, &info, nullptr);
  if (!good) return damaged(job);
  return std::move(job.pixels);
}

Result<std::vector<std::uint8_t>> encode_png(const GreyImage& image) {
  const std::size_t step = static_cast<std::size_t>(image.step());
  if (image.width < 1 || image.height < 1 || image.data.size() != step * image.height) {
    return Error{"the image has no pixels, or not as many as its size says"};
  }
  PngJob job;
  std::vector<std::uint8_t> pixels = image.data;
  auto rows = row_pointers(pixels.data(), image.height, step);
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &job, on_error, on_warning);
  if (png == nullptr) return Error{"the PNG encoder cannot be started"};
  png_infop info = png_create_info_struct(png);
  const bool good = info != nullptr && write_all(png, info, &image, rows.data(), &job);
  png_destroy_write_struct(&png, &info);
  if (!good) return Error{"PNG encoding failed: " + job.error};
  return std::move(job.output);
}

}  // namespace sovo::codecs
