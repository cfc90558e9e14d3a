#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>

namespace sovo::bridge {

/// A file of the page, as it is sent.
struct StaticFile {
  std::string content_type;
  std::string body;
  std::string etag;
};

/// The files of the web page, read once: nothing else can be asked for.
class StaticFiles {
 public:
  /// Reads everything below `root`; a missing folder gives none.
  static StaticFiles read(const std::filesystem::path& root);

  bool empty() const { return files_.empty(); }
  /// `path`: "/assets/index.js"; "/" is the page. Null when there is no such file.
  const StaticFile* find(const std::string& path) const;

 private:
  std::map<std::string, StaticFile> files_;
};

/// The folder of the page that was built or installed with this program: share/sovo/dashboard
/// beside the folder of its binary.
std::filesystem::path page_folder();

}  // namespace sovo::bridge
