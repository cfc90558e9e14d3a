#pragma once

#include <vector>

#include "sovo/app/report/dive.h"

namespace sovo::app {

/// Sets `run` of all statuses, poses and keyframes: an odometry that is started again counts its
/// frames and segments from zero, and has an `odom` of its own.
void number_runs(Dive* dive);

/// The dive with the poses and keyframes of one run alone, for each of the `most` runs with most
/// metric poses, in their order; all of it where there is one run.
std::vector<Dive> runs_of(const Dive& dive, std::size_t most);

/// Number of runs, from the last one's.
std::size_t count_runs(const Dive& dive);

}  // namespace sovo::app
