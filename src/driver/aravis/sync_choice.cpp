#include "sovo/driver/aravis/sync_choice.h"

namespace sovo::aravis {

const char* to_string(Sync sync) {
  for (const auto& [value, name] : enum_names(sync)) {
    if (value == sync) return name;
  }
  return "?";
}

bool is_able(const SyncAbility& ability, Sync sync) {
  switch (sync) {
    case Sync::kHardware:
      return ability.line;
    case Sync::kAction:
      return ability.ptp && ability.action;
    case Sync::kPtp:
      return ability.ptp;
    case Sync::kSoftware:
      return ability.software;
    default:
      return true;
  }
}

Sync best_sync(const SyncAbility& left, const SyncAbility& right, bool line_is_named) {
  for (const Sync sync : {Sync::kHardware, Sync::kAction, Sync::kPtp, Sync::kSoftware}) {
    // That a camera has a line says nothing of a wire.
    if (sync == Sync::kHardware && !line_is_named) continue;
    if (is_able(left, sync) && is_able(right, sync)) return sync;
  }
  return Sync::kFree;
}

Result<Sync> SyncChoice::choose(CameraSide side, const SyncAbility& ability) {
  const std::scoped_lock lock(mutex_);
  if (wish_ != Sync::kAuto) chosen_ = wish_;
  seen_[static_cast<std::size_t>(side)] = ability;
  if (!chosen_ && seen_[0] && seen_[1]) chosen_ = best_sync(*seen_[0], *seen_[1], line_is_named_);
  if (!chosen_) {
    return Error{
        "waiting for the other camera: sync auto needs to see both; --sync free begins with one"};
  }
  if (is_able(ability, *chosen_)) return *chosen_;
  return Error{std::string("this camera cannot be synchronized by ") + to_string(*chosen_) +
               (*chosen_ == Sync::kHardware ? ": it has no such trigger source; see "
                                              "camera.aravis.trigger_source"
                                            : "; take --sync auto")};
}

}  // namespace sovo::aravis
