#pragma once

#include <memory>
#include <optional>
#include <string>

#include "sovo/driver/aravis/aravis_options.h"
#include "sovo/driver/aravis/gige_network.h"
#include "sovo/driver/aravis/sync_choice.h"
#include "sovo/driver/live/capture_device.h"
#include "sovo/driver/live/image_pool.h"

namespace sovo::aravis {

struct GigeOptions;

/// What a camera says when it is tried.
struct GigeProbe {
  SyncAbility ability;
  double frame_rate = 0.0;  ///< [Hz]; 0 when it does not tell.
};

/// Opens a camera, sets what can be set before the synchronization is known, and closes it.
Result<GigeProbe> probe_gige(const GigeOptions& options, const GigeInfo& info);

/// Finds a camera by serial number, sets it up and starts its stream. Images are stamped in the
/// middle of their exposure by the camera's clock.
Result<std::unique_ptr<CaptureDevice>> open_gige(const GigeOptions& options);

}  // namespace sovo::aravis
