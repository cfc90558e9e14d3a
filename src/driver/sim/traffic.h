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

/// Lanes beside the camera's, to the left of it, and who drives there.
struct Lanes {
  double other = 0.0;           ///< Middle of the next one in the same direction [m].
  double oncoming = 0.0;        ///< Middle of the one for the other direction [m].
  double faster = 0.0;          ///< How much faster those drive who overtake [m/s].
  double oncoming_speed = 0.0;  ///< [m/s]
};

/// Puts vehicles on the way of the camera's `motion`. They keep to it, or to the lanes at its left,
/// and are no part of the ground truth's world: they move on their own.
void add_traffic(Traffic traffic, const Motion& motion, const Lanes& lanes,
                 const TrafficMaterials& materials, SceneBuilder& b);

}  // namespace sovo::sim
