#pragma once

#include <cstdint>
#include <vector>

#include "sovo/driver/sim/scene.h"

namespace sovo::sim {

/// Materials of a vehicle.
struct VehicleMaterials {
  int paint = 0;
  int glass = 0;
  int shadow = 0;
};

/// Materials of five cars.
std::vector<int> car_paints(SceneBuilder& b, std::uint64_t seed);

/// A car of 4.2 m, the middle of its lower edge at `foot` (0.12 m above the road), with its shadow.
void add_car(SceneBuilder& b, const VehicleMaterials& m, const Vec3& foot, double yaw);

/// A lorry of 8 m by 2.5 m, 3.4 m high, that stands on the road at `foot`, with its shadow.
void add_lorry(SceneBuilder& b, const VehicleMaterials& m, const Vec3& foot, double yaw);

}  // namespace sovo::sim
