#include <algorithm>
#include <map>

#include "sovo/driver/dataset/layout.h"
#include "sovo/io/photometric_file.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

void sort_by_stamp(ImageList* images) {
  std::stable_sort(images->begin(), images->end(),
                   [](const ImageRef& a, const ImageRef& b) { return a.stamp_ns < b.stamp_ns; });
  const auto same = [](const ImageRef& a, const ImageRef& b) { return a.stamp_ns == b.stamp_ns; };
  images->erase(std::unique(images->begin(), images->end(), same), images->end());
}

/// data.csv: `stamp [ns],file name`, `#` begins a comment.
Result<ImageList> read_data_csv(const fs::path& camera) {
  const std::string file = (camera / "data.csv").string();
  const auto text = read_text_file(file);
  if (!text) return text.failure();
  ImageList images;
  int number = 0;
  for (const std::string_view line : split_lines(*text)) {
    ++number;
    const auto fields = split(line, ", \t");
    if (fields.empty() || fields[0].front() == '#') continue;
    const auto stamp = parse_integer(fields[0]);
    if (!stamp || fields.size() < 2) {
      return Error{file + ":" + std::to_string(number) + ": wanted `stamp [ns],file name`, not '" +
                   std::string(line) + "'"};
    }
    images.push_back({*stamp, camera / "data" / std::string(fields[1])});
  }
  return images;
}

/// Without data.csv the names of the images are their stamps.
Result<ImageList> images_of(const fs::path& camera) {
  if (fs::exists(camera / "data.csv")) return read_data_csv(camera);
  const auto files = list_images(camera / "data");
  if (!files) return files.failure();
  ImageList images;
  for (const fs::path& path : *files) {
    const auto stamp = parse_integer(path.stem().string());
    if (!stamp) return Error{path.string() + ": the name is not a stamp in nanoseconds"};
    images.push_back({*stamp, path});
  }
  return images;
}

/// Exposures by name of the image, from DSO's times.txt; empty without the file.
Result<std::map<std::string, double>> exposures_by_name(const fs::path& file) {
  std::map<std::string, double> exposures;
  if (!fs::exists(file)) return exposures;
  const auto times = read_exposure_times(file.string());
  if (!times) return times.failure();
  for (const ExposureTime& time : *times) exposures.emplace(time.id, time.exposure_s);
  return exposures;
}

Result<ImageList> camera_images(const fs::path& mav, const std::string& camera) {
  auto images = images_of(mav / camera);
  if (!images) return images;
  const auto exposures = exposures_by_name(mav / ".." / "dso" / camera / "times.txt");
  if (!exposures) return exposures.failure();
  for (ImageRef& image : *images) {
    const auto found = exposures->find(image.path.stem().string());
    if (found != exposures->end()) image.exposure_s = static_cast<float>(found->second);
  }
  sort_by_stamp(&*images);
  return images;
}

}  // namespace

std::optional<Result<DatasetLayout>> find_euroc(const fs::path& path) {
  const fs::path mav = fs::is_directory(path / "mav0") ? path / "mav0" : path;
  if (!fs::is_directory(mav / "cam0") || !fs::is_directory(mav / "cam1")) return std::nullopt;
  DatasetLayout layout;
  layout.root = mav == path ? (path / "..").lexically_normal() : path;
  const bool tum_vi = fs::exists(mav / ".." / "dso" / "camchain.yaml");
  layout.kind = tum_vi ? LayoutKind::kTumVi : LayoutKind::kEuroc;
  const auto left = camera_images(mav, "cam0");
  if (!left) return left.failure();
  const auto right = camera_images(mav, "cam1");
  if (!right) return right.failure();
  layout.list = pair_by_stamp(*left, *right);
  return layout;
}

}  // namespace sovo
