#include <gtest/gtest.h>

#include <random>

#include "sovo/vo/photometric_problem.h"
#include "window_test_support.h"

namespace sovo {
namespace {

constexpr int kScatterKeyframes = 3;

double scatter_of(Window* window) {
  WorkerPool pool(1);
  PhotometricProblem problem(WindowConfig(), collect_points(window), window, &pool);
  WindowLinearization at;
  problem.linearize(problem.stored(), {}, &at);
  return problem.gradient_scatter(at, kScatterKeyframes - 1);
}

TEST(GradientScatter, IsOneForNoise) {
  Window window = test::scene_window(kScatterKeyframes);
  std::mt19937 random(2);
  std::normal_distribution<float> noise(0.0F, 6.0F);
  for (int h = 0; h < window.size(); ++h) {
    for (Point& p : window[h].points) {
      for (float& colour : p.colour) colour += noise(random);
    }
  }
  EXPECT_NEAR(scatter_of(&window), 1.0, 0.25);
}

TEST(GradientScatter, IsFarMoreForPatternsThatAreMovedAsAWhole) {
  Window window = test::scene_window(kScatterKeyframes);
  std::mt19937 random(2);
  const auto pixel = [&](float at) {
    return static_cast<int>(at) + static_cast<int>(random() % 3U) - 1;
  };
  for (int h = 0; h < window.size(); ++h) {
    const ImageF& image = window[h].pyramid->level(0);
    for (Point& p : window[h].points) {
      p.colour = test::make_point(image, pixel(p.u), pixel(p.v), 1.0).colour;
    }
  }
  EXPECT_GT(scatter_of(&window), 3.0);
  EXPECT_LT(scatter_of(&window), 8.0);
}

TEST(GradientScatter, IsOneWhereNothingTellsIt) {
  Window window = test::scene_window(kScatterKeyframes);
  for (int h = 0; h < window.size(); ++h) window[h].points.clear();
  EXPECT_DOUBLE_EQ(scatter_of(&window), 1.0);
}

}  // namespace
}  // namespace sovo
