#include "sovo/vo/view_forecast.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace sovo {
namespace {

constexpr float kUnknown = std::numeric_limits<float>::infinity();
constexpr double kFar = 0.2;         ///< Mean inverse depths.
constexpr float kViewBorder = 4.0F;  ///< What is nearer to the edge is as good as out of view [px].

/// Takes `most` of `all` that come one after the other, evenly.
class EvenChoice {
 public:
  EvenChoice(std::size_t most, std::size_t all) : most_(std::min(most, all)), all_(all) {}
  bool takes_next() {
    const std::size_t i = next_++;
    return i * most_ / all_ != (i + 1) * most_ / all_;
  }

 private:
  std::size_t most_, all_;
  std::size_t next_ = 0;
};

}  // namespace

ViewForecast::ViewForecast(const Window& window)
    : width_(window.camera().width),
      height_(window.camera().height),
      cells_x_((width_ + kCell - 1) / kCell),
      cells_y_((height_ + kCell - 1) / kCell),
      rho_(static_cast<std::size_t>(cells_x_) * static_cast<std::size_t>(cells_y_), kUnknown),
      nearest_rho_(rho_) {
  const int newest = window.size() - 1;
  if (newest < 1) return;
  const PairGeometry& step = window.pair(newest - 1, newest);
  far_rho_ = static_cast<float>(kFar * window.mean_inverse_depth());
  KRKi_ = step.KRKi;
  Kt_ = step.Kt;
  for (int h = 0; h < newest; ++h) add_host(window[h], &window.pair(h, newest));
  add_host(window[newest], nullptr);
  fill_gaps();
}

void ViewForecast::add_host(const Keyframe& host, const PairGeometry* to_newest) {
  const auto add_seen = [&](float u, float v, float rho) {
    if (!(rho > 0.0F)) return;
    if (to_newest == nullptr) return add(u, v, rho);
    const Eigen::Vector3f p = to_newest->KRKi * Eigen::Vector3f(u, v, 1.0F) + to_newest->Kt * rho;
    if (p.z() > 0.0F) add(p.x() / p.z(), p.y() / p.z(), rho / p.z());
  };
  for (const Point& p : host.points) add_seen(p.u, p.v, static_cast<float>(p.rho));
  for (const ImmaturePoint& p : host.immature) {
    if (std::isfinite(p.rho_max)) add_seen(p.u, p.v, 0.5F * (p.rho_min + p.rho_max));
  }
}

void ViewForecast::add(float x, float y, float rho) {
  if (!(x >= 0.0F && y >= 0.0F && x < static_cast<float>(width_) &&
        y < static_cast<float>(height_))) {
    return;
  }
  const auto cell = static_cast<std::size_t>(static_cast<int>(y) / kCell * cells_x_ +
                                             static_cast<int>(x) / kCell);
  const bool first = nearest_rho_[cell] == kUnknown;
  rho_[cell] = std::min(rho_[cell], rho);
  nearest_rho_[cell] = first ? rho : std::max(nearest_rho_[cell], rho);
}

/// Cells without a point have the depth of the farthest next to them.
void ViewForecast::fill_gaps() {
  const std::vector<float> known = rho_;
  for (int y = 0; y < cells_y_; ++y) {
    for (int x = 0; x < cells_x_; ++x) {
      float& cell = rho_[static_cast<std::size_t>(y * cells_x_ + x)];
      if (cell != kUnknown) continue;
      for (int j = std::max(0, y - 1); j <= std::min(cells_y_ - 1, y + 1); ++j) {
        for (int i = std::max(0, x - 1); i <= std::min(cells_x_ - 1, x + 1); ++i) {
          cell = std::min(cell, known[static_cast<std::size_t>(j * cells_x_ + i)]);
        }
      }
    }
  }
}

double ViewForecast::keep_lasting(int wanted, std::vector<SelectedPixel>* pixels) const {
  const auto leaves = [this](const SelectedPixel& p) { return !stays(p.x, p.y); };
  const auto all = static_cast<double>(pixels->size());
  const auto leaving = std::count_if(pixels->begin(), pixels->end(), leaves);
  const bool believed = static_cast<double>(leaving) <= (1.0 - kLeastShare) * all;
  if (believed) std::erase_if(*pixels, leaves);
  const auto far = static_cast<std::size_t>(
      std::ranges::count_if(*pixels, [this](const SelectedPixel& p) { return is_far(p.x, p.y); }));
  const std::size_t near = pixels->size() - far;
  const auto most = static_cast<std::size_t>(std::max(0, wanted));
  const auto few_far = static_cast<std::size_t>(kFarShare * static_cast<double>(most));
  const std::size_t far_most = std::max(few_far, most - std::min(most, near));
  if (far <= few_far) {
    EvenChoice choice(most, near + far);
    std::erase_if(*pixels, [&](const SelectedPixel&) { return !choice.takes_next(); });
  } else {
    EvenChoice of_far(far_most, far);
    EvenChoice of_near(most - std::min(far, far_most), near);
    std::erase_if(*pixels, [&](const SelectedPixel& p) {
      return !(is_far(p.x, p.y) ? of_far : of_near).takes_next();
    });
    // Where points are close together the first ones become active.
    std::stable_partition(pixels->begin(), pixels->end(),
                          [this](const SelectedPixel& p) { return !is_far(p.x, p.y); });
  }
  const auto useful = static_cast<double>(near + std::min(few_far, far));
  return all > 0.0 ? std::max(kLeastShare, useful / all) : 1.0;
}

bool ViewForecast::is_far(int x, int y) const {
  return nearest_rho_[static_cast<std::size_t>(y / kCell * cells_x_ + x / kCell)] < far_rho_;
}

bool ViewForecast::stays(int x, int y) const {
  const float rho = rho_[static_cast<std::size_t>(y / kCell * cells_x_ + x / kCell)];
  if (rho == kUnknown) return true;
  const Eigen::Vector3f p =
      KRKi_ * Eigen::Vector3f(static_cast<float>(x), static_cast<float>(y), 1.0F) + Kt_ * rho;
  // Written so that NaN counts as out of view.
  return p.z() > 0.0F && p.x() >= kViewBorder * p.z() && p.y() >= kViewBorder * p.z() &&
         p.x() <= (static_cast<float>(width_ - 1) - kViewBorder) * p.z() &&
         p.y() <= (static_cast<float>(height_ - 1) - kViewBorder) * p.z();
}

}  // namespace sovo
