#include <utility>
#include <vector>

#include "sovo/vo/direct_odometry.h"
#include "sovo/vo/sparse_regions.h"

namespace sovo {

namespace {

constexpr double kMuchSparse = 0.4;  ///< Of an image, where hardly any pixels were selected;
constexpr double kMoreSparse = 0.5;  ///< as many more from there, for its share of the image.

}  // namespace

/// Where most pixels lie together on the vehicle's own body, the little there is of the world has
/// to tell that it moves: some more are chosen from what is left.
std::vector<SelectedPixel> DirectOdometry::select_pixels(const MonoFrame& frame, int wanted) {
  const ImagePyramid& pyramid = *frame.pyramid;
  std::vector<SelectedPixel> pixels = select_usable(pyramid, wanted);
  if (!config_.co_moving.enable) return pixels;
  const ImageU8 usable = co_moving_.any() ? co_moving_.mask(mask_) : mask_;
  const SparseRegions sparse =
      sparse_regions(pixels, usable, pyramid[0].width(), pyramid[0].height());
  if (sparse.share < kMuchSparse) return pixels;
  PixelSelector selector = selector_;
  std::vector<SelectedPixel> more;
  selector.select(pyramid, &sparse.mask, static_cast<int>(kMoreSparse * sparse.share * wanted),
                  &more);
  for (SelectedPixel& p : more) p.sparse = true;
  pixels.insert(pixels.end(), more.begin(), more.end());
  return pixels;
}

/// Unless they have shown the world to move, a map does without them: their depths are worse.
void DirectOdometry::drop_sparse_points() {
  Keyframe& k = window_.newest();
  const auto keep = [](auto* points, std::size_t count) {
    points->erase(points->begin() + static_cast<std::ptrdiff_t>(count), points->end());
  };
  keep(&k.points, before_sparse_->first);
  keep(&k.immature, before_sparse_->second);
  k.points_hosted = static_cast<int>(k.points.size());
  publish_reference(active_points(window_), std::nullopt);
}

}  // namespace sovo
