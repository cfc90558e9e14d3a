#include "sovo/driver/sim/world.h"

namespace sovo::sim {

Scene build_scene(World world, const Motion& motion, std::uint64_t seed, Traffic traffic) {
  switch (world) {
    case World::kLawn:
      return build_lawn(motion, seed);
    case World::kPool:
      return build_pool(motion, seed);
    case World::kStreet:
      return build_street(motion, seed, traffic);
    case World::kHall:
      return build_hall(motion, seed);
    case World::kHighway:
      return build_highway(motion, seed, traffic);
    case World::kSand:
      break;
  }
  return build_sand(motion, seed);
}

}  // namespace sovo::sim
