#pragma once

#include <string>
#include <vector>

#include "sovo/driver/sim/motion.h"
#include "sovo/driver/sim/scene.h"
#include "sovo/driver/sim/sim_config.h"
#include "sovo/geometry/stereo_rig.h"
#include "sovo/io/result.h"

namespace sovo::sim {

/// Names of the trajectories that belong to a world; the first is the one it is known for.
std::vector<std::string> own_trajectories(World world);

/// The motion of the left camera along one of them; z is up, the ground at z = 0. Precondition:
/// `name` is one of `own_trajectories`, or empty for the first.
Motion own_motion(World world, const std::string& name = {});

/// Cameras that suit a world.
StereoRig own_rig(World world);

/// Pairs a second that suit a world [Hz].
double own_frame_rate(World world);

/// The motion of the left camera from a trajectory file, brought into the world: z up, the ground
/// below it, beginning near the origin. Of which body the poses are, and which way is up, is found
/// from the axis that stays upright, unless `body` says it. On roads, on the lawn and on
/// sand slow changes of height are taken away, for their ground is level, and what would dive below
/// it lifts the whole way.
Result<Motion> load_motion(const SimConfig& config, const StereoRig& rig);

/// The world around a motion: nothing stands in its way. Precondition: `traffic` on roads
/// only.
Scene build_scene(World world, const Motion& motion, std::uint64_t seed,
                  Traffic traffic = Traffic::kNone);

// The single worlds.
Scene build_lawn(const Motion& motion, std::uint64_t seed);
Scene build_pool(const Motion& motion, std::uint64_t seed);
Scene build_street(const Motion& motion, std::uint64_t seed, Traffic traffic);
Scene build_hall(const Motion& motion, std::uint64_t seed);
Scene build_sand(const Motion& motion, std::uint64_t seed);
Scene build_highway(const Motion& motion, std::uint64_t seed, Traffic traffic);

}  // namespace sovo::sim
