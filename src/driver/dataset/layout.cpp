#include "sovo/driver/dataset/layout.h"

namespace sovo {
namespace {

namespace fs = std::filesystem;

/// Help for someone who pointed at the folder above the datasets.
std::string hint_for(const fs::path& path) {
  std::error_code code;
  for (const char* name : {"sequences", "dataset"}) {
    if (fs::is_directory(path / name, code)) {
      return "; give one of the folders in " + (path / name).string();
    }
  }
  // A day of KITTI raw holds its drives.
  for (fs::directory_iterator it(path, code), end; !code && it != end; it.increment(code)) {
    if (fs::is_directory(it->path() / "image_00", code)) {
      return "; give one of the drives in it, as " + it->path().string();
    }
  }
  return "";
}

}  // namespace

std::string to_string(LayoutKind kind) {
  switch (kind) {
    case LayoutKind::kKittiGrey:
      return "KITTI odometry (grey)";
    case LayoutKind::kKittiColour:
      return "KITTI odometry (colour)";
    case LayoutKind::kKittiRawGrey:
      return "KITTI raw (grey)";
    case LayoutKind::kKittiRawColour:
      return "KITTI raw (colour)";
    case LayoutKind::kEuroc:
      return "EuRoC";
    case LayoutKind::kTumVi:
      return "TUM-VI";
    case LayoutKind::kFolders:
      return "left and right folders";
  }
  return "unknown";
}

Result<DatasetLayout> find_layout(const fs::path& path, double frame_rate) {
  std::error_code code;
  if (!fs::is_directory(path, code)) {
    return Error{path.string() + ": no such folder; give the folder of a dataset"};
  }
  auto layout = find_kitti(path);
  if (!layout) layout = find_kitti_raw(path);
  if (!layout) layout = find_euroc(path);
  if (!layout) layout = find_folders(path, frame_rate);
  if (!layout) {
    return Error{path.string() +
                 ": not a dataset: neither image_0 and image_1 (KITTI), image_00 and image_01 "
                 "(KITTI raw), mav0/cam0 and mav0/cam1 "
                 "(EuRoC, TUM-VI), nor left and right are in it" +
                 hint_for(path)};
  }
  if (!layout->ok()) return layout->failure();
  DatasetLayout& found = layout->value();
  trim_absent(&found.list);
  if (found.list.pairs.empty()) {
    return Error{path.string() + ": no stereo pair in it: " + to_string(found.kind) +
                 " layout, but no left image has a right one"};
  }
  if (found.list.unpaired > 0) {
    found.notes.push_back(std::to_string(found.list.unpaired) +
                          " images have no partner in the other camera");
  }
  if (found.list.absent > 0) {
    found.notes.push_back(std::to_string(found.list.absent) +
                          " pairs are listed but not there, at the beginning or the end");
  }
  return layout->value();
}

}  // namespace sovo
