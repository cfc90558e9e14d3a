#pragma once

#include <netinet/in.h>

#include <memory>
#include <optional>
#include <string>

#include "sovo/driver/aravis/aravis_options.h"
#include "sovo/driver/aravis/gige_network.h"
#include "sovo/driver/aravis/glib_owner.h"
#include "sovo/driver/aravis/grey_image.h"
#include "sovo/driver/aravis/gvcp.h"
#include "sovo/driver/aravis/sync_choice.h"
#include "sovo/driver/live/image_pool.h"
#include "sovo/io/result.h"

namespace sovo::aravis {

/// How one camera is taken.
struct GigeOptions {
  AravisOptions aravis;
  CameraSide side = CameraSide::kLeft;
  int width = 0;  ///< As calibrated [px]; asked for, and nothing else accepted.
  int height = 0;
  double trigger_rate = 30.0;       ///< Of triggers that this program sends [Hz].
  std::shared_ptr<ImagePool> pool;  ///< Of width * height pixels of two bytes.
  std::shared_ptr<GigeNetwork> network;
  std::shared_ptr<SyncChoice> sync;

  const std::string& camera() const {
    return side == CameraSide::kLeft ? aravis.left : aravis.right;
  }
  const std::string& other_camera() const {
    return side == CameraSide::kLeft ? aravis.right : aravis.left;
  }
};

/// Keys of the action commands that this program triggers with.
constexpr ActionKeys kActionKeys{0x736f766f, 1, 1};

/// Opens a camera and takes control of it.
Result<Owned<ArvCamera>> open_camera(const GigeInfo& info);

/// Stops what the camera was doing, and sets size, pixel format and, when one is given, frame rate.
Result<void> set_up_image(ArvCamera* camera, const GigeOptions& options);

SyncAbility sync_ability(ArvDevice* device, const std::string& trigger_source);
Result<void> set_up_sync(ArvDevice* device, Sync sync, const std::string& trigger_source);

/// What an image brings along.
struct ChunkUse {
  bool stamp = false;
  bool exposure = false;
};
/// Turns on stamp and exposure with each image, where the camera offers them.
ChunkUse set_up_chunks(ArvDevice* device);

/// Addresses and sizes of the connection.
struct LinkSetup {
  sockaddr_in camera{};
  InterfaceInfo interface;
  int packet_size = 0;
  int limit_mbps = 0;  ///< 0: none.
};
/// Sets packet size and throughput. `shared`: the other camera is on the same interface.
Result<LinkSetup> set_up_link(ArvCamera* camera, const AravisOptions& options, bool shared);

/// The format of a camera's pixels; nothing for what cannot be made grey.
std::optional<SensorFormat> sensor_format(ArvPixelFormat format);

}  // namespace sovo::aravis
