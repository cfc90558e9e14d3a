#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "sovo/image/image.h"
#include "sovo/image/pyramid.h"

namespace sovo {

struct PixelSelectorConfig {
  int threshold_block = 32;         ///< Side of the regions with one threshold each [px].
  double threshold_offset = 7.0;    ///< Added to a region's median gradient [grey levels / px].
  double least_offset = 2.5;        ///< As far as that may sink where there is little texture.
  double level_threshold_1 = 0.75;  ///< Threshold on the squared gradient of level 1, relative.
  double level_threshold_2 = 0.42;  ///< The same for level 2.
  int border = 4;                   ///< Nearest a pixel comes to the edge of the image [px].
  int mask_border = 3;              ///< Nearest it comes to a masked pixel (pattern + 1) [px].
  double reselect_below = 0.8;      ///< Select anew when fewer than this times the wanted number,
  double reselect_above = 4.0;      ///< or more than this times it, were found.
  /// Where pixels are spread over less than this share of the regions, texture is weak elsewhere.
  double min_spread = 0.35;
  int initial_block = 3;  ///< First side of the blocks of which each gives one pixel.
  /// Of the directions and of the thinning; follows from that of the whole odometry.
  int seed = 1;

  template <class Visitor>
  void visit(Visitor& v) {
    v("threshold_block", threshold_block, "side of the regions with one gradient threshold [px]");
    v("threshold_offset", threshold_offset, "added to the median gradient [grey levels/px]");
    v("least_offset", least_offset, "least of that, with little texture [grey levels/px]");
    v("level_threshold_1", level_threshold_1, "squared threshold at level 1, relative to level 0");
    v("level_threshold_2", level_threshold_2, "squared threshold at level 2, relative to level 0");
    v("border", border, "least distance to the edge of the image [px]");
    v("mask_border", mask_border, "least distance to a masked pixel [px]");
    v("reselect_below", reselect_below, "select anew below this share of the wanted number");
    v("reselect_above", reselect_above, "select anew above this multiple of the wanted number");
    v("min_spread", min_spread,
      "with pixels in a smaller share of the regions less texture is asked for");
    v("initial_block", initial_block, "first side of the selection blocks [px]");
  }
};

/// Pixels by |grad I| in whole grey levels a pixel; the last one's are all with more.
inline constexpr int kMostGradient = 48;
using GradientHistogram = std::array<int, kMostGradient + 1>;

/// A pixel chosen for tracking.
struct SelectedPixel {
  std::int16_t x = 0;            ///< At level 0.
  std::int16_t y = 0;            ///< At level 0.
  std::uint8_t type = 1;         ///< 1, 2, 4: found in the gradients of level 0, 1, 2.
  float gradient_squared = 0.F;  ///< At level 0 [(grey levels / px)^2].
  /// Part of `threshold_offset` that was asked of it: below 1 where the image has little texture.
  float threshold_share = 1.0F;
  bool sparse = false;  ///< Chosen in addition, from where there are hardly any others.
};

/// Chooses pixels with enough gradient, spread over the whole image (Engel, Koltun, Cremers,
/// "Direct Sparse Odometry", sec. 3.2). The image is cut into blocks of d, 2d and 4d pixels; a
/// block gives the pixel of the largest |grad I * n| above its region's threshold, n a random
/// direction; coarser blocks give one only where no finer block within them did, by gradients of
/// the coarser pyramid level. d follows the wanted number from call to call. Where even blocks of a
/// pixel or two give too few, as on sand or in turbid water, the threshold comes down nearer to the
/// region's median, and goes up again with more texture.
class PixelSelector {
 public:
  explicit PixelSelector(const PixelSelectorConfig& config = {});

  /// Fills `out` with at most `wanted` pixels, in no particular spatial order but the same one
  /// for the same object history. `mask` (level 0 size, may be null): pixels that are 0 there are
  /// left out. Fewer pixels come out where the image has no texture.
  void select(const ImagePyramid& pyramid, const ImageU8* mask, int wanted,
              std::vector<SelectedPixel>* out);

  /// Back to the state after construction: seed, block size and threshold.
  void reset();

  /// Side of the blocks that the next call begins with [px].
  int block() const { return block_; }

  /// Present part of `threshold_offset`, in (0, 1].
  double threshold_share() const { return threshold_share_; }

 private:
  void compute_medians(const ImageF& image);
  void compute_thresholds();
  void select_enough(const ImagePyramid& pyramid, int wanted, std::vector<SelectedPixel>* out);
  double spread_of(const std::vector<SelectedPixel>& selected) const;
  bool lower_threshold(const std::vector<SelectedPixel>& selected, int wanted);
  void raise_threshold();
  void erode_mask(const ImageU8& mask);
  void select_all_levels(const ImagePyramid& pyramid, std::vector<SelectedPixel>* out);
  void select_level(const ImagePyramid& pyramid, int level, std::vector<SelectedPixel>* out);
  void inherit_hits(int level, int w, int h);
  void fill_directions(int width);
  void fill_thresholds(int level, int region_row, int width, int full_width);
  void score_row(const ImageF& image, int level, int y, int first_x, int last_x);
  bool finest_pixel(const ImageF& image, int level, int x, int y, SelectedPixel* pixel) const;
  void thin(int wanted, std::vector<SelectedPixel>* pixels);
  std::uint32_t random();

  PixelSelectorConfig config_;
  std::uint64_t random_state_ = 0;
  int block_ = 3;
  double threshold_share_ = 1.0;
  int since_lowered_ = 0;  ///< Images with large blocks since the threshold was lowered.

  int regions_x_ = 0, regions_y_ = 0;
  std::vector<float> medians_, thresholds_;       // per region; thresholds are squared gradients
  std::vector<GradientHistogram> histograms_;     // per region of a row of them
  AlignedVector<std::int32_t> gradient_row_;      // per column, whole grey levels / px
  std::array<std::vector<std::uint8_t>, 3> hit_;  // per block of a level: it or a finer one hit
  std::array<int, 3> blocks_x_{}, blocks_y_{};
  AlignedVector<float> direction_x_, direction_y_, threshold_row_;  // per column of a level
  AlignedVector<float> allowed_row_;                                // per column, 1 or 0
  AlignedVector<float> best_score_;  // per column, the best over a row of blocks
  AlignedVector<std::int32_t> best_y_;
  ImageU8 mask_, allowed_, erosion_rows_;  // allowed_: mask_ eroded
  bool masked_ = false;
};

}  // namespace sovo
