#include "sovo/bridge/dashboard/static_files.h"

#include <fstream>
#include <functional>
#include <iterator>

namespace sovo::bridge {
namespace {

constexpr std::uintmax_t kLargestFile = 16U << 20U;

std::string content_type(const std::filesystem::path& path) {
  static const std::map<std::string, std::string> types = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".svg", "image/svg+xml"},
      {".woff2", "font/woff2"},
      {".png", "image/png"},
      {".json", "application/json"}};
  const auto found = types.find(path.extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

}  // namespace

StaticFiles StaticFiles::read(const std::filesystem::path& root) {
  StaticFiles result;
  std::error_code error;
  for (std::filesystem::recursive_directory_iterator it(root, error), end; !error && it != end;
       it.increment(error)) {
    std::error_code ignored;
    if (!it->is_regular_file(ignored) || it->file_size(ignored) > kLargestFile) continue;
    std::ifstream stream(it->path(), std::ios::binary);
    StaticFile file;
    file.body.assign(std::istreambuf_iterator<char>(stream), {});
    file.content_type = content_type(it->path());
    file.etag = '"' + std::to_string(std::hash<std::string>{}(file.body)) + '"';
    result.files_["/" + it->path().lexically_relative(root).generic_string()] = std::move(file);
  }
  if (result.files_.count("/index.html") == 0) result.files_.clear();
  return result;
}

const StaticFile* StaticFiles::find(const std::string& path) const {
  const auto found = files_.find(path == "/" ? "/index.html" : path);
  return found == files_.end() ? nullptr : &found->second;
}

std::filesystem::path page_folder() {
  std::error_code error;
  const auto binary = std::filesystem::read_symlink("/proc/self/exe", error);
  return binary.parent_path().parent_path() / "share" / "sovo" / "dashboard";
}

}  // namespace sovo::bridge
