#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "driver/sim_vehicle_rig.h"
#include "sovo/driver/sim/renderer.h"
#include "sovo/driver/sim/world.h"

namespace sovo::sim {
namespace {

CameraModel behind_port() {
  CameraModel camera = vehicle_rig().left;
  camera.port = {.distance = 0.05, .thickness = 0.02, .normal = Vec3(0.03, -0.02, 1).normalized()};
  camera.port->centre = *centre_behind_port(camera);
  return camera;
}

/// Whatever the renderer does with its rays: what a pixel sees is where the port lets it look.
TEST(SimPort, PixelsSeePlacesThroughThePort) {
  const CameraModel camera = behind_port();
  const Motion motion = own_motion(World::kPool);
  const Scene scene = build_scene(World::kPool, motion, 1);
  Renderer renderer(scene, camera);
  RenderedImage image;
  for (const double t : {6.0, 9.0}) {
    renderer.render(motion.at(t), t, &image);
    int seen = 0;
    double most = 0.0;
    for (int y = 0; y < camera.height; y += 3) {
      for (int x = 0; x < camera.width; x += 3) {
        const double range = double{image.range.at(x, y)};
        if (!std::isfinite(range)) continue;
        const Vec3 place = range * renderer.rays().ray(x, y).cast<double>();
        const auto pixel = camera.project(camera.direction_of(place));
        ASSERT_TRUE(pixel);
        EXPECT_LT((*pixel - Vec2(x, y)).norm(), 0.01) << x << " " << y;
        const auto central = camera.project(place);
        if (central) most = std::max(most, (*central - Vec2(x, y)).norm());
        ++seen;
      }
    }
    EXPECT_GT(seen, 1500);
    EXPECT_GT(most, 0.3) << "or the port does nothing";
  }
}

TEST(SimPort, PicturesDoNotDependOnWhatWasSeenBefore) {
  const Motion motion = own_motion(World::kHall);
  const Scene scene = build_scene(World::kHall, motion, 1);
  Renderer fresh(scene, behind_port());
  Renderer used(scene, behind_port());
  RenderedImage a;
  RenderedImage b;
  used.render(motion.at(2.0), 2.0, &b);
  fresh.render(motion.at(6.0), 6.0, &a);
  used.render(motion.at(6.0), 6.0, &b);
  EXPECT_TRUE(std::equal(a.light.data(), a.light.data() + a.light.size(), b.light.data()));
}

}  // namespace
}  // namespace sovo::sim
