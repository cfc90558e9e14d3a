#pragma once

#include <functional>
#include <string>

#include "sovo/driver/sim/sim_source.h"

namespace sovo::sim {

/// Writes all pairs of a source as a dataset in EuRoC's layout, which `open_dataset` reads back to
/// the same pixels:
///
///     DIR/mav0/cam0|cam1/{data.csv, sensor.yaml, data/STAMP.png}
///     DIR/dso/cam0|cam1/{times.txt, pcalib.txt, vignette.png}   exposures; response and vignette
///                                                              when the calibration knows them
///     DIR/groundtruth_cam0_tum.txt                             poses of the left camera
///     DIR/depth.csv                                            depth [m] at a grid of about a
///                                                              hundred left pixels of every
///                                                              tenth pair
///     DIR/depth/STAMP.pfm                                      with `depth`: distance along the
///                                                              optical axis [m], 0 for the sky
///
/// `progress` is called after every pair and stops the export by returning false.
Result<void> export_dataset(SimSource* source, const std::string& directory, bool depth,
                            const std::function<bool(std::size_t)>& progress = {});

/// A float image as PFM (little endian, rows from the bottom, as the format has it).
Result<void> write_pfm(const std::string& path, const ImageF& image);

}  // namespace sovo::sim
