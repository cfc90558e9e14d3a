#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace sovo {

/// Layout of raw pixels as a camera delivers them.
enum class PixelFormat : std::uint8_t {
  kMono8,
  kMono16,  ///< Little endian; full scale is 65535.
};

/// One camera's image of a stereo pair.
struct SideImage {
  bool valid = false;  ///< False: this side is missing; tracking may go on with the other.
  int width = 0;       ///< [px]
  int height = 0;      ///< [px]
  PixelFormat format = PixelFormat::kMono8;
  int step = 0;  ///< Bytes from one row to the next.
  /// height * step bytes. Shared, never changed after it was filled.
  std::shared_ptr<const std::vector<std::uint8_t>> data;
  float exposure_s = 0.0F;           ///< 0 when unknown.
  float gain_db = 0.0F;              ///< 0 when unknown.
  std::int64_t stamp_offset_ns = 0;  ///< This side's mid-exposure less the frame's stamp.
  std::uint64_t dropped = 0;         ///< Images this side lost since the camera started.
};

/// Both images of one instant.
struct StereoFrame {
  std::int64_t stamp_ns = 0;   ///< Mid-exposure, UTC.
  std::uint64_t session = 0;   ///< Random number of the camera process's run.
  std::uint64_t sequence = 0;  ///< Counts every device frame: gaps are losses.
  std::uint8_t clock = 0;      ///< Which clock stamped: 0 host, 1 device tracked, 2 PTP, 3 dataset.
  double stamp_sigma_s = 0.0;  ///< Standard deviation of the stamp; 0 when unknown.
  double pair_error_s = 0.0;   ///< Time between the two exposures.
  std::string frame_id;        ///< Left optical frame, e.g. "cam_left_camera_optical_frame".
  SideImage left;
  SideImage right;
};

}  // namespace sovo
