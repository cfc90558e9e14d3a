#include "sovo/io/calibration_check.h"

#include <algorithm>
#include <cmath>

#include "sovo/image/pyramid.h"
#include "sovo/image/static_matcher.h"
#include "sovo/image/undistorter.h"
#include "sovo/io/calibration.h"
#include "sovo/io/text.h"

namespace sovo {
namespace {

constexpr int kCells = 18;            // points a row and a column of the image
constexpr float kMinGradient = 8.0F;  // [grey levels a pixel]
constexpr int kMinPoints = 30;        // textured ones needed to say anything
constexpr double kMinShare = 0.15;    // of matches, below which something is wrong
constexpr double kGoodShare = 0.5;    // of matches, above which the curves are right
constexpr double kMaxAcrossPx = 1.0;  // median over the points
constexpr float kMaxAcrossSigmaPx = 0.5F;
constexpr double kFarthestMedian = 300;  // [m]
constexpr double kNearestMedian = 0.02;  // [m]
constexpr int kSearchPx = 32;            // how far beside its curve a lost match is looked for
constexpr int kSearchStepPx = 4;

struct Matches {
  int points = 0;
  std::vector<double> depth, across;  // across: of the matches whose texture tells
  int count() const { return static_cast<int>(depth.size()); }
  double share() const { return points == 0 ? 0.0 : count() / static_cast<double>(points); }
};

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_abs(std::vector<double> values) {
  for (double& value : values) value = std::abs(value);
  return median(std::move(values));
}

/// The pixel of strongest gradient of each cell of a grid.
std::vector<std::pair<int, int>> textured_points(const ImageF& image, const ImageU8& valid) {
  constexpr int kBorder = 8;
  std::vector<std::pair<int, int>> points;
  const int cell_w = std::max(1, (image.width() - 2 * kBorder) / kCells);
  const int cell_h = std::max(1, (image.height() - 2 * kBorder) / kCells);
  for (int y0 = kBorder; y0 + cell_h < image.height() - kBorder; y0 += cell_h) {
    for (int x0 = kBorder; x0 + cell_w < image.width() - kBorder; x0 += cell_w) {
      float best = kMinGradient;
      std::pair<int, int> at{-1, -1};
      for (int y = y0; y < y0 + cell_h; ++y) {
        for (int x = x0; x < x0 + cell_w; ++x) {
          // Along the rows: that is where disparity shows.
          const float gradient = 0.5F * std::abs(image.at(x + 1, y) - image.at(x - 1, y));
          if (gradient > best && valid.at(x, y) != 0) {
            best = gradient;
            at = {x, y};
          }
        }
      }
      if (at.first >= 0) points.push_back(at);
    }
  }
  return points;
}

ImagePyramid pyramid_of(const ImageF& image) {
  return {image, ImagePyramid::num_levels_for(image.width(), image.height())};
}

/// Matches `base`, seen by the rig's left camera, in `target`, seen by the right one.
void match_pair(const StereoRig& rig, const ImageF& base, const ImageF& target, Matches* out) {
  StereoRig pinhole = rig;
  pinhole.left = optimal_pinhole(rig.left, UndistortionConfig{});
  const Undistorter undistorter(rig.left, pinhole.left);
  ImageF undistorted;
  undistorter.apply(base, &undistorted);
  const auto points = textured_points(undistorted, undistorter.valid_mask(ImageU8{}));
  StaticMatcherConfig config;
  // Depths in baselines, so that the search is the same whatever the unit.
  config.min_depth = 3.0 * rig.baseline();
  const StaticMatcher matcher(config, pinhole);
  const ImagePyramid left = pyramid_of(undistorted);
  const ImagePyramid right = pyramid_of(target);
  for (const auto& [x, y] : points) {
    const StaticMatch match =
        matcher.match(left, right, static_cast<float>(x), static_cast<float>(y), {.across = true});
    if (match.state == MatchState::kOutOfView || match.state == MatchState::kNoTexture) continue;
    ++out->points;
    if (match.state != MatchState::kMatched) continue;
    out->depth.push_back(1.0 / std::max(1e-9, static_cast<double>(match.inverse_depth)));
    if (match.across_sigma_px < kMaxAcrossSigmaPx) {
      out->across.push_back(static_cast<double>(match.across_px));
    }
  }
}

Matches match_all(const StereoRig& rig, std::span<const ImagePair> pairs, bool exchanged) {
  Matches matches;
  for (const ImagePair& pair : pairs) {
    match_pair(rig, exchanged ? pair.right : pair.left, exchanged ? pair.left : pair.right,
               &matches);
  }
  return matches;
}

/// How many rows off its epipolar curves the right image lies, when turning the right camera by as
/// much makes clearly more than `share` of the points match; 0 when nothing does.
int find_row_offset(const StereoRig& rig, std::span<const ImagePair> pairs, double share) {
  int best_offset = 0;
  double best_share = std::max(2.0 * kMinShare, 1.5 * share);
  for (int offset = -kSearchPx; offset <= kSearchPx; offset += kSearchStepPx) {
    if (offset == 0) continue;
    StereoRig turned = rig;
    const Vec3 turn(-offset / rig.right.fy, 0.0, 0.0);
    turned.T_right_left = SE3(SO3::exp(turn), Vec3::Zero()) * rig.T_right_left;
    const Matches matches = match_all(turned, pairs.first(1), false);
    if (matches.points >= kMinPoints && matches.share() > best_share) {
      best_share = matches.share();
      best_offset = offset;
    }
  }
  return best_offset;
}

std::string share_text(const Matches& matches) {
  return std::to_string(matches.count()) + " of " + std::to_string(matches.points) + " points";
}

void add_scale_finding(double depth, CalibrationReport* report) {
  const bool far = depth > kFarthestMedian;
  if (!far && depth > kNearestMedian) return;
  report->findings.push_back(
      {CalibrationFault::kScale, "the median depth of the matches is " +
                                     format_fixed(depth, far ? 0 : 4) + " m: the baseline looks " +
                                     (far ? "like millimetres" : "a thousand times too small") +
                                     "; translations of the calibration must be in metres"});
}

void add_decalibration_finding(double offset_px, CalibrationReport* report) {
  report->findings.push_back(
      {CalibrationFault::kDecalibrated,
       "decalibrated: matches lie " + format_fixed(offset_px, 1) +
           " px beside their epipolar lines (below " + format_fixed(kMaxAcrossPx, 0) +
           " px is good); a camera has moved, or the calibration belongs to other cameras or "
           "another resolution: calibrate again"});
}

void judge(const StereoRig& rig, std::span<const ImagePair> pairs, const Matches& normal,
           const Matches& exchanged, CalibrationReport* report) {
  if (std::max(normal.points, exchanged.points) < kMinPoints) {
    report->findings.push_back({CalibrationFault::kLittleTexture,
                                "the images show too little texture to check the calibration; "
                                "take others, in better light"});
    return;
  }
  if (exchanged.share() > kMinShare && exchanged.share() > 2.0 * normal.share()) {
    report->findings.push_back(
        {CalibrationFault::kSwapped,
         "left and right look swapped: " + share_text(exchanged) +
             " match with the images exchanged, " + share_text(normal) +
             " as they are (disparities are negative); exchange the cameras' devices or topics"});
    return;
  }
  const int offset = normal.share() < kGoodShare ? find_row_offset(rig, pairs, normal.share()) : 0;
  if (offset != 0) {
    add_decalibration_finding(std::abs(offset), report);
    return;
  }
  if (normal.share() > kMinShare && normal.count() >= kMinPoints / 2) {
    add_scale_finding(report->median_depth, report);
    if (report->median_abs_across_px > kMaxAcrossPx) {
      add_decalibration_finding(report->median_abs_across_px, report);
    }
    return;
  }
  report->findings.push_back(
      {CalibrationFault::kUnmatched,
       "only " + share_text(normal) +
           " match: the images are not of one instant, a lens is covered or out of focus, or the "
           "calibration belongs to other cameras"});
}

/// Faults that are seen before any matching.
void check_preconditions(const StereoRig& rig, std::span<const ImagePair> pairs,
                         CalibrationReport* report) {
  for (const std::string& problem : check_rig(rig)) {
    report->findings.push_back({CalibrationFault::kInvalid, problem});
  }
  const auto fits = [](const ImageF& image, const CameraModel& camera) {
    return image.width() == camera.width && image.height() == camera.height;
  };
  for (const ImagePair& pair : pairs) {
    if (fits(pair.left, rig.left) && fits(pair.right, rig.right)) continue;
    report->findings.push_back(
        {CalibrationFault::kImageSize,
         "the images are " + std::to_string(pair.left.width()) + "x" +
             std::to_string(pair.left.height()) + " and " + std::to_string(pair.right.width()) +
             "x" + std::to_string(pair.right.height()) + ", the calibrated cameras " +
             std::to_string(rig.left.width) + "x" + std::to_string(rig.left.height) + " and " +
             std::to_string(rig.right.width) + "x" + std::to_string(rig.right.height) +
             "; calibrate at the resolution that is used"});
    return;
  }
}

}  // namespace

CalibrationReport check_calibration_on_images(const StereoRig& rig,
                                              std::span<const ImagePair> pairs) {
  CalibrationReport report;
  check_preconditions(rig, pairs, &report);
  if (!report.findings.empty() || pairs.empty()) return report;
  const Matches normal = match_all(rig, pairs, false);
  const bool same_size = rig.left.width == rig.right.width && rig.left.height == rig.right.height;
  const Matches exchanged = same_size ? match_all(rig, pairs, true) : Matches{};
  report.points = normal.points;
  report.matches = normal.count();
  report.exchanged_matches = exchanged.count();
  report.median_depth = median(normal.depth);
  report.median_across_px = median(normal.across);
  report.median_abs_across_px = median_abs(normal.across);
  judge(rig, pairs, normal, exchanged, &report);
  return report;
}

}  // namespace sovo
