#pragma once

#include <array>
#include <mutex>
#include <optional>
#include <string>

#include "sovo/driver/aravis/aravis_options.h"
#include "sovo/driver/live/stereo_pairer.h"
#include "sovo/io/result.h"

namespace sovo::aravis {

/// What of synchronization a camera can.
struct SyncAbility {
  bool line = false;      ///< The trigger source that the options name.
  bool ptp = false;       ///< Its clock can be set by PTP.
  bool action = false;    ///< It can be triggered by action commands.
  bool software = false;  ///< It can be triggered by a command.
};

bool is_able(const SyncAbility& ability, Sync sync);

/// The best that both cameras can, hardware only when `line_is_named`; never kAuto.
Sync best_sync(const SyncAbility& left, const SyncAbility& right, bool line_is_named);

/// Which synchronization both cameras use: the same for both, and for as long as the process lives.
/// May be used by several threads.
class SyncChoice {
 public:
  SyncChoice(Sync wish, bool line_is_named) : wish_(wish), line_is_named_(line_is_named) {}

  /// What the camera of a side shall use. An error when it cannot, or when kAuto waits for the
  /// other camera to be seen.
  Result<Sync> choose(CameraSide side, const SyncAbility& ability);

 private:
  const Sync wish_;
  const bool line_is_named_;
  std::mutex mutex_;
  std::array<std::optional<SyncAbility>, 2> seen_;
  std::optional<Sync> chosen_;
};

}  // namespace sovo::aravis
