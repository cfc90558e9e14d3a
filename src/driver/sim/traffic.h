#pragma once

#include <vector>

#include "sovo/driver/sim/motion.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/driver/sim/vehicles.h"

namespace sovo::sim {

/// Materials of the vehicles of a road.
struct TrafficMaterials {
  std::vector<int> car_paints;
  int lorry_paint = 0;
  int glass = 0;
  int shadow = 0;
};

/// Puts vehicles on the way of the camera's `motion`. They keep to it, or to the lane at its left,
/// and are no part of the ground truth's world: they move on their own.
void add_traffic(Traffic traffic, const Motion& motion, const TrafficMaterials& materials,
                 SceneBuilder& b);

}  // namespace sovo::sim
