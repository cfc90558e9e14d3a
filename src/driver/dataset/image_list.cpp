#include "sovo/driver/dataset/image_list.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <map>
#include <optional>

#include "sovo/io/text.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

bool is_image(const fs::path& path) {
  std::string extension = path.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  constexpr std::array<std::string_view, 5> kKnown{".png", ".pgm", ".ppm", ".jpg", ".jpeg"};
  return std::find(kKnown.begin(), kKnown.end(), extension) != kKnown.end();
}

std::int64_t median_period(const ImageList& images) {
  std::vector<std::int64_t> periods;
  for (std::size_t i = 1; i < images.size(); ++i) {
    periods.push_back(images[i].stamp_ns - images[i - 1].stamp_ns);
  }
  if (periods.empty()) return 0;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

/// Index of the image nearest to a stamp. Precondition: not empty.
std::size_t nearest(const ImageList& images, std::int64_t stamp) {
  const auto after =
      std::lower_bound(images.begin(), images.end(), stamp,
                       [](const ImageRef& image, std::int64_t t) { return image.stamp_ns < t; });
  if (after == images.begin()) return 0;
  const auto index = static_cast<std::size_t>(after - images.begin());
  if (after == images.end()) return index - 1;
  return after->stamp_ns - stamp < stamp - (after - 1)->stamp_ns ? index : index - 1;
}

/// Images by number; the error names the image without a number, or two with the same.
Result<std::map<std::int64_t, fs::path>> images_by_number(const fs::path& folder) {
  const auto files = list_images(folder);
  if (!files) return files.failure();
  std::map<std::int64_t, fs::path> numbered;
  for (const fs::path& file : *files) {
    const auto number = number_in_name(file);
    if (!number) return Error{file.string() + ": the name has no frame number"};
    if (!numbered.emplace(*number, file).second) {
      return Error{file.string() + ": a second image with the number " + std::to_string(*number)};
    }
  }
  return numbered;
}

/// The image of a number, or the name that it would have beside its neighbour `like`.
ImageRef image_of(const std::map<std::int64_t, fs::path>& images, std::int64_t number) {
  const auto found = images.find(number);
  if (found != images.end()) return {0, found->second};
  const fs::path& like = images.begin()->second;
  const std::string digits = std::to_string(number);
  const std::size_t width = like.stem().string().size();
  const std::string zeros(width > digits.size() ? width - digits.size() : 0, '0');
  return {0, like.parent_path() / (zeros + digits + like.extension().string())};
}

}  // namespace

Result<std::vector<fs::path>> list_images(const fs::path& folder) {
  std::error_code code;
  std::vector<fs::path> files;
  for (fs::directory_iterator it(folder, code), end; !code && it != end; it.increment(code)) {
    if (is_image(it->path())) files.push_back(it->path());
  }
  if (code) return Error{folder.string() + ": cannot be listed: " + code.message()};
  if (files.empty()) return Error{folder.string() + ": no images (png, pgm, ppm, jpg) in it"};
  std::sort(files.begin(), files.end(), [](const fs::path& a, const fs::path& b) {
    return std::pair(number_in_name(a), a) < std::pair(number_in_name(b), b);
  });
  return files;
}

std::optional<std::int64_t> number_in_name(const fs::path& path) {
  const std::string stem = path.stem().string();
  const std::size_t before = stem.find_last_not_of("0123456789");
  return parse_integer(before == std::string::npos ? stem : stem.substr(before + 1));
}

PairList pair_by_stamp(const ImageList& left, const ImageList& right) {
  PairList list;
  if (left.empty() || right.empty()) {
    list.unpaired = left.size() + right.size();
    return list;
  }
  const std::int64_t tolerance = median_period(left) / 2;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const ImageRef& partner = right[nearest(right, left[i].stamp_ns)];
    if (std::abs(partner.stamp_ns - left[i].stamp_ns) > tolerance) continue;
    if (nearest(left, partner.stamp_ns) == i) list.pairs.push_back({left[i], partner});
  }
  list.unpaired = left.size() + right.size() - 2 * list.pairs.size();
  return list;
}

Result<PairList> pair_by_number(const fs::path& left, const fs::path& right) {
  const auto left_images = images_by_number(left);
  if (!left_images) return left_images.failure();
  const auto right_images = images_by_number(right);
  if (!right_images) return right_images.failure();
  const std::int64_t first = std::min(left_images->begin()->first, right_images->begin()->first);
  const std::int64_t last = std::max(left_images->rbegin()->first, right_images->rbegin()->first);
  constexpr std::int64_t kMost = 10'000'000;
  if (last - first > kMost) {
    return Error{left.string() + ": image numbers from " + std::to_string(first) + " to " +
                 std::to_string(last) + " are no counter; name images by counter or by stamp [ns]"};
  }
  PairList list;
  for (std::int64_t n = first; n <= last; ++n) {
    list.pairs.push_back({image_of(*left_images, n), image_of(*right_images, n)});
    list.unpaired += left_images->count(n) != right_images->count(n) ? 1U : 0U;
  }
  return list;
}

void trim_absent(PairList* list) {
  const auto is_there = [](const PairRef& pair) {
    return fs::exists(pair.left.path) || fs::exists(pair.right.path);
  };
  auto& pairs = list->pairs;
  const std::size_t before = pairs.size();
  const auto last = std::find_if(pairs.rbegin(), pairs.rend(), is_there);
  pairs.erase(last.base(), pairs.end());
  pairs.erase(pairs.begin(), std::find_if(pairs.begin(), pairs.end(), is_there));
  list->absent += before - pairs.size();
}

}  // namespace sovo
