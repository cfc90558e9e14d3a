#pragma once

#include <span>
#include <string>
#include <vector>

#include "sovo/geometry/stereo_rig.h"
#include "sovo/image/image.h"

namespace sovo {

/// A synchronized pair of raw float images.
struct ImagePair {
  ImageF left;
  ImageF right;
};

/// What can be wrong with a calibration, as its images show.
enum class CalibrationFault {
  kInvalid,        ///< `check_rig` objects; nothing else was looked at.
  kImageSize,      ///< The images are not of the calibrated size.
  kSwapped,        ///< The images match only when exchanged: disparities are negative.
  kScale,          ///< Depths are a thousand times too large or too small: units.
  kDecalibrated,   ///< Matches lie beside the epipolar curves.
  kUnmatched,      ///< Hardly anything matches, for a reason that could not be found.
  kLittleTexture,  ///< The images show too little to tell.
};

struct CalibrationFinding {
  CalibrationFault fault = CalibrationFault::kInvalid;
  std::string message;  ///< What is wrong and what to do.
};

/// Result of a check against images. `findings` is empty when nothing is wrong.
struct CalibrationReport {
  int points = 0;                 ///< Textured points that both cameras may see.
  int matches = 0;                ///< Of them, matched.
  int exchanged_matches = 0;      ///< Matched with the images exchanged.
  double median_depth = 0.0;      ///< Of the matches [m].
  double median_across_px = 0.0;  ///< Signed displacement across the epipolar curve.
  double median_abs_across_px = 0.0;
  std::vector<CalibrationFinding> findings;
};

/// Matches textured points of each pair along the epipolar curves of the rig and tells what is
/// wrong with the calibration: swapped cameras, wrong units, cameras that have moved.
CalibrationReport check_calibration_on_images(const StereoRig& rig,
                                              std::span<const ImagePair> pairs);

}  // namespace sovo
