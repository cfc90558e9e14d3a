#include <algorithm>
#include <cmath>

#include "sovo/driver/dataset/layout.h"
#include "sovo/io/text.h"
#include "sovo/io/trajectory_file.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// The stamp that a name is: nanoseconds ("1403636584763555584") or decimal seconds with a point
/// ("1403636584.763556"); nothing for counters and other names.
std::optional<std::int64_t> stamp_in_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  if (stem.find('.') != std::string::npos) return parse_seconds_as_ns(stem);
  constexpr std::int64_t kLeast = 1'000'000'000'000;  // No camera counts that far.
  const auto number = parse_integer(stem);
  return number && *number >= kLeast ? number : std::nullopt;
}

/// Images with their names' stamps; nothing when a name is none.
std::optional<ImageList> images_by_stamp(const std::vector<fs::path>& files) {
  ImageList images;
  for (const fs::path& path : files) {
    const auto stamp = stamp_in_name(path);
    if (!stamp) return std::nullopt;
    images.push_back({*stamp, path});
  }
  std::sort(images.begin(), images.end(),
            [](const ImageRef& a, const ImageRef& b) { return a.stamp_ns < b.stamp_ns; });
  return images;
}

/// Stamps for counted images: line n of times.txt is that of the n-th pair; else a fixed rate.
Result<void> set_stamps(const fs::path& times_file, double frame_rate, DatasetLayout* layout) {
  auto& pairs = layout->list.pairs;
  std::vector<std::int64_t> times;
  if (fs::exists(times_file)) {
    auto read = read_kitti_times(times_file.string());
    if (!read) return read.failure();
    times = std::move(*read);
    if (times.size() != pairs.size()) {
      return Error{times_file.string() + ": has " + std::to_string(times.size()) + " times for " +
                   std::to_string(pairs.size()) + " pairs; one line a pair is needed"};
    }
  } else {
    layout->notes.push_back("images without stamps and no times.txt: " + format_double(frame_rate) +
                            " frames a second assumed");
  }
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const double nominal = static_cast<double>(i) * 1e9 / frame_rate;
    const std::int64_t stamp = times.empty() ? std::llround(nominal) : times[i];
    pairs[i].left.stamp_ns = stamp;
    pairs[i].right.stamp_ns = stamp;
  }
  return {};
}

}  // namespace

std::optional<Result<DatasetLayout>> find_folders(const fs::path& path, double frame_rate) {
  if (!fs::is_directory(path / "left") || !fs::is_directory(path / "right")) return std::nullopt;
  DatasetLayout layout;
  layout.kind = LayoutKind::kFolders;
  layout.root = path;
  const auto left = list_images(path / "left");
  if (!left) return left.failure();
  const auto right = list_images(path / "right");
  if (!right) return right.failure();
  const auto left_stamped = images_by_stamp(*left);
  const auto right_stamped = images_by_stamp(*right);
  if (left_stamped && right_stamped) {
    layout.list = pair_by_stamp(*left_stamped, *right_stamped);
    return layout;
  }
  auto list = pair_by_number(path / "left", path / "right");
  if (!list) return list.failure();
  layout.list = std::move(*list);
  const auto stamped = set_stamps(path / "times.txt", frame_rate, &layout);
  if (!stamped) return stamped.failure();
  return layout;
}

}  // namespace sovo
