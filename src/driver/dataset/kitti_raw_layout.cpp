#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/dataset/layout.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// "2011-09-26 13:02:25.964389445" [ns since 1970], taken as UTC.
std::optional<std::int64_t> parse_date_and_time(std::string_view line) {
  const auto fields = split(line, " -:");
  if (fields.size() != 6) return std::nullopt;
  std::array<std::int64_t, 5> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    const auto number = parse_integer(std::string(fields[i]));
    if (!number || *number < 0 || *number > 9999) return std::nullopt;
    numbers[i] = *number;
  }
  const auto seconds = parse_double(fields[5]);
  if (!seconds || *seconds < 0.0 || *seconds > 61.0) return std::nullopt;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(numbers[0])),
                                         std::chrono::month(static_cast<unsigned>(numbers[1])),
                                         std::chrono::day(static_cast<unsigned>(numbers[2]))};
  if (!date.ok() || numbers[3] > 23 || numbers[4] > 59) return std::nullopt;
  const std::int64_t minutes = numbers[3] * 60 + numbers[4];
  const auto days = std::chrono::sys_days(date).time_since_epoch();
  return std::chrono::nanoseconds(days).count() + minutes * 60'000'000'000 +
         std::llround(*seconds * 1e9);
}

/// The times of a camera's images by their numbers, which begin at 0.
Result<std::vector<std::int64_t>> read_timestamps(const fs::path& file) {
  const auto text = read_text_file(file.string());
  if (!text) return text.failure();
  std::vector<std::int64_t> times;
  int number = 0;
  for (const std::string_view line : split_lines(*text)) {
    ++number;
    if (trim(line).empty()) continue;
    const auto time = parse_date_and_time(trim(line));
    if (!time) {
      return Error{file.string() + ":" + std::to_string(number) +
                   ": wanted a time like 2011-09-26 13:02:25.964389445, not '" +
                   std::string(excerpt(line)) + "'"};
    }
    times.push_back(*time);
  }
  return times;
}

Result<ImageList> images_with_times(const fs::path& camera) {
  const auto files = list_images(camera / "data");
  if (!files) return files.failure();
  const auto times = read_timestamps(camera / "timestamps.txt");
  if (!times) return times.failure();
  ImageList images;
  for (const fs::path& file : *files) {
    const auto number = number_in_name(file);
    if (!number || *number < 0 || *number >= std::ssize(*times)) {
      return Error{(camera / "timestamps.txt").string() + ": has " + std::to_string(times->size()) +
                   " times, none for image " + file.string()};
    }
    images.push_back({(*times)[static_cast<std::size_t>(*number)], file});
  }
  const auto later = [](const ImageRef& a, const ImageRef& b) { return a.stamp_ns >= b.stamp_ns; };
  const auto wrong = std::adjacent_find(images.begin(), images.end(), later);
  if (wrong != images.end()) {
    return Error{(camera / "timestamps.txt").string() + ": the time of " +
                 (wrong + 1)->path.filename().string() + " is not after the one before"};
  }
  return images;
}

}  // namespace

std::optional<Result<DatasetLayout>> find_kitti_raw(const fs::path& path) {
  const auto has = [&](const char* name) { return fs::is_directory(path / name / "data"); };
  const bool grey = has("image_00") && has("image_01");
  if (!grey && !(has("image_02") && has("image_03"))) return std::nullopt;
  DatasetLayout layout;
  layout.kind = grey ? LayoutKind::kKittiRawGrey : LayoutKind::kKittiRawColour;
  layout.root = path;
  const auto left = images_with_times(path / (grey ? "image_00" : "image_02"));
  if (!left) return left.failure();
  const auto right = images_with_times(path / (grey ? "image_01" : "image_03"));
  if (!right) return right.failure();
  layout.list = pair_by_stamp(*left, *right);
  // The laser scanner triggers all cameras together; what differs is when images arrived.
  for (PairRef& pair : layout.list.pairs) pair.right.stamp_ns = pair.left.stamp_ns;
  return layout;
}

}  // namespace sovo
