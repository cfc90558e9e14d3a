#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "sovo/driver/dataset/image_list.h"
#include "sovo/io/result.h"

namespace sovo {

/// How a dataset lies on disk.
enum class LayoutKind {
  kKittiGrey,
  kKittiColour,
  kKittiRawGrey,
  kKittiRawColour,
  kEuroc,
  kTumVi,
  kFolders
};

/// "KITTI odometry (grey)", "EuRoC", ...
std::string to_string(LayoutKind kind);

/// A recognised dataset: its pairs in order of time, and where its calibration is.
struct DatasetLayout {
  LayoutKind kind = LayoutKind::kFolders;
  std::filesystem::path root;  ///< Folder that holds calibration and image folders.
  PairList list;
  std::vector<std::string> notes;  ///< For people: what was assumed or left out.
};

/// Recognises the layout of a folder by what lies in it and lists its images. Frames of folders
/// without stamps come at `frame_rate` [Hz]. The error lists what was looked for.
///  - KITTI odometry: `calib.txt`, `times.txt`, `image_0` + `image_1` or `image_2` + `image_3`;
///  - KITTI raw, a drive: `image_00` + `image_01` or `image_02` + `image_03` with `data/` and
///    `timestamps.txt`; `calib_cam_to_cam.txt` in it or beside it;
///  - EuRoC ASL: `mav0/cam0` + `mav0/cam1` with `data.csv`, `data/`; also given as `mav0` itself;
///  - TUM-VI: the same with `dso/camchain.yaml` beside `mav0`; exposures from `dso/cam*/times.txt`;
///  - plain: `left/` + `right/`, names stamps [ns] or counters, `calibration.yaml`, and `times.txt`
///    (seconds, a line an image) if there is one.
Result<DatasetLayout> find_layout(const std::filesystem::path& path, double frame_rate);

// The readers of the single layouts: nothing when the folder is not of their kind.
std::optional<Result<DatasetLayout>> find_kitti(const std::filesystem::path& path);
std::optional<Result<DatasetLayout>> find_kitti_raw(const std::filesystem::path& path);
std::optional<Result<DatasetLayout>> find_euroc(const std::filesystem::path& path);
std::optional<Result<DatasetLayout>> find_folders(const std::filesystem::path& path,
                                                  double frame_rate);

}  // namespace sovo
