#include "sovo/driver/dataset/layout.h"
#include "sovo/io/trajectory_file.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

constexpr std::int64_t kNominalPeriodNs = 100'000'000;

/// Gives frame n the n-th time of times.txt, or n tenths of a second without one.
Result<void> set_stamps(const fs::path& times_file, DatasetLayout* layout) {
  std::vector<std::int64_t> times;
  if (fs::exists(times_file)) {
    auto read = read_kitti_times(times_file.string());
    if (!read) return read.failure();
    times = std::move(*read);
  } else {
    layout->notes.push_back("no times.txt: 10 frames a second assumed");
  }
  for (PairRef& pair : layout->list.pairs) {
    const auto number = static_cast<std::size_t>(number_in_name(pair.left.path).value_or(0));
    if (!times.empty() && number >= times.size()) {
      return Error{times_file.string() + ": has " + std::to_string(times.size()) +
                   " times, none for image " + pair.left.path.string()};
    }
    pair.left.stamp_ns =
        times.empty() ? static_cast<std::int64_t>(number) * kNominalPeriodNs : times[number];
    pair.right.stamp_ns = pair.left.stamp_ns;
  }
  return {};
}

}  // namespace

std::optional<Result<DatasetLayout>> find_kitti(const fs::path& path) {
  DatasetLayout layout;
  layout.root = path;
  const auto has = [&](const char* name) { return fs::is_directory(path / name); };
  if (has("image_0") && has("image_1")) {
    layout.kind = LayoutKind::kKittiGrey;
  } else if (has("image_2") && has("image_3")) {
    layout.kind = LayoutKind::kKittiColour;
  } else {
    return std::nullopt;
  }
  const bool grey = layout.kind == LayoutKind::kKittiGrey;
  auto list =
      pair_by_number(path / (grey ? "image_0" : "image_2"), path / (grey ? "image_1" : "image_3"));
  if (!list) return list.failure();
  layout.list = std::move(*list);
  const auto stamped = set_stamps(path / "times.txt", &layout);
  if (!stamped) return stamped.failure();
  return layout;
}

}  // namespace sovo
