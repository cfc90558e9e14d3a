// Writes a dataset's pairs as a side-by-side camera would give them: YUYV, the luma that of the
// left and the right image beside each other, one image after the other.
//
//     side_by_side DATASET FILE

#include <chrono>
#include <cstdint>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

#include "sovo/driver/dataset/dataset_source.h"

namespace {

/// Appends row `y` of a grey image.
void append_row(const sovo::SideImage& image, int y, std::vector<char>* yuyv) {
  const std::uint8_t* row = image.data->data() + static_cast<std::size_t>(y) * image.step;
  for (int x = 0; x < image.width; ++x) {
    yuyv->push_back(static_cast<char>(row[x]));
    yuyv->push_back(static_cast<char>(128));
  }
}

int convert(const std::string& dataset, const std::string& path) {
  sovo::DatasetOptions options;
  options.path = dataset;
  const auto source = sovo::open_dataset(options);
  if (!source) {
    std::fprintf(stderr, "side_by_side: %s\n", source.error().c_str());
    return 1;
  }
  std::ofstream file(path, std::ios::binary);
  for (;;) {
    const sovo::SourceResult next = (*source)->next(std::chrono::seconds(60));
    if (next.state == sovo::SourceState::kEndOfStream) break;
    if (next.state != sovo::SourceState::kFrame) {
      std::fprintf(stderr, "side_by_side: %s\n", next.message.c_str());
      return 1;
    }
    std::vector<char> yuyv;
    for (int y = 0; y < next.frame.left.height; ++y) {
      append_row(next.frame.left, y, &yuyv);
      append_row(next.frame.right, y, &yuyv);
    }
    file.write(yuyv.data(), static_cast<std::streamsize>(yuyv.size()));
  }
  return file.flush() ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) { return argc == 3 ? convert(argv[1], argv[2]) : 2; }
