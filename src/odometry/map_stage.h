#pragma once

#include "sovo/odometry/odometry_output.h"
#include "sovo/vo/monocular_backend.h"

namespace sovo {

/// As which of the odometry's stages a part of the mapping is timed.
inline Stage stage_of(MapStage stage) {
  switch (stage) {
    case MapStage::kTracing:
      return Stage::kTracing;
    case MapStage::kSelection:
      return Stage::kSelection;
    case MapStage::kStaticMatching:
      return Stage::kStaticMatching;
    case MapStage::kBundleAdjustment:
      return Stage::kBundleAdjustment;
    case MapStage::kMarginalization:
      break;
  }
  return Stage::kMarginalization;
}

}  // namespace sovo
