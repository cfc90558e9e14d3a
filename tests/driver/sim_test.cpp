#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "sovo/driver/dataset/dataset_source.h"
#include "sovo/driver/sim/sim_export.h"
#include "sovo/driver/sim/sim_source.h"
#include "support/cameras.h"

namespace sovo::sim {
namespace {

/// Small cameras of one model, the right one different and turned.
StereoRig small_rig(Distortion distortion) {
  StereoRig rig;
  rig.name = "small";
  const bool fisheye = distortion == Distortion::kEquidistant;
  const double f = fisheye ? 62.0 : 95.0;
  switch (distortion) {
    case Distortion::kNone:
      rig.left = test::make_camera(160, 112, f, f, 79.5, 55.5);
      rig.right = test::make_camera(160, 112, f + 1, f, 81.0, 54.0);
      break;
    case Distortion::kRadtan:
      rig.left =
          test::make_camera(160, 112, f, f, 79.0, 56.0, distortion, {-0.28, 0.07, 2e-4, 2e-5});
      rig.right =
          test::make_camera(160, 112, f, f + 1, 80.0, 57.0, distortion, {-0.27, 0.07, 1e-4, 0});
      break;
    case Distortion::kEquidistant:
      rig.left =
          test::make_camera(160, 112, f, f, 79.0, 56.0, distortion, {0.01, -0.01, 0.006, -0.0017});
      rig.right =
          test::make_camera(160, 112, f, f, 81.0, 55.0, distortion, {0.013, -0.015, 0.009, -0.002});
      break;
  }
  rig.T_right_left = SE3(SO3::exp({0.006, -0.008, 0.004}), Vec3(-0.12, 0.002, 0.003));
  return rig;
}

SimConfig quiet(World world) {
  SimConfig config;
  config.world = world;
  config.frames = 2;
  config.sensor.motion_blur = false;
  config.sensor.vignette = 0.0;
  return config;
}

SimSource make_source(const SimConfig& config, const StereoRig& rig) {
  Calibration calibration;
  calibration.rig = rig;
  return SimSource(config, calibration, own_motion(config.world));
}

StereoFrame first_frame(SimSource& source) {
  const SourceResult result = source.next(std::chrono::seconds(60));
  EXPECT_EQ(result.state, SourceState::kFrame) << result.message;
  return result.frame;
}

double sample(const SideImage& image, const Vec2& p) {
  const int x = static_cast<int>(std::floor(p.x()));
  const int y = static_cast<int>(std::floor(p.y()));
  const double fx = p.x() - x;
  const double fy = p.y() - y;
  const auto at = [&](int i, int j) {
    return static_cast<double>((*image.data)[static_cast<std::size_t>(j * image.step + i)]);
  };
  return (1 - fy) * ((1 - fx) * at(x, y) + fx * at(x + 1, y)) +
         fy * ((1 - fx) * at(x, y + 1) + fx * at(x + 1, y + 1));
}

struct Residuals {
  std::vector<double> absolute;  ///< Sorted.
  double contrast = 0.0;         ///< Mean absolute difference of neighbouring pixels.

  double quantile(double q) const {
    return absolute[static_cast<std::size_t>(q * static_cast<double>(absolute.size() - 1))];
  }
};

/// A pair with its truth.
struct Pair {
  StereoRig rig;
  SideImage left;
  SideImage right;
  ImageF range;
};

SideImage take(const ImageF& light, const ExposureControl& exposure, std::uint64_t seed) {
  SensorConfig config;
  config.vignette = 0.0;
  SideImage side;
  side.step = light.width();
  side.data = std::make_shared<const std::vector<std::uint8_t>>(
      Sensor(config, light.width(), light.height()).expose(light, exposure, false, seed));
  return side;
}

/// Compares left pixels with where the truth, its depth multiplied by `factor`, puts them into the
/// right image.
Residuals warp(const Pair& pair, double factor) {
  const StereoRig& rig = pair.rig;
  Residuals residuals;
  for (int y = 3; y < rig.left.height - 3; ++y) {
    for (int x = 3; x < rig.left.width - 3; ++x) {
      const double range = double{pair.range.at(x, y)} * factor;
      const auto ray = rig.left.unproject({x, y});
      if (!ray || !std::isfinite(range)) continue;
      const auto pixel = rig.right.project(rig.T_right_left * Vec3(*ray * range));
      if (!pixel || !rig.right.contains(*pixel, 2.0)) continue;
      const double here = sample(pair.left, Vec2(x, y));
      residuals.absolute.push_back(std::abs(sample(pair.right, *pixel) - here));
      residuals.contrast += std::abs(sample(pair.left, Vec2(x + 1, y)) - here);
    }
  }
  residuals.contrast /= static_cast<double>(residuals.absolute.size());
  std::sort(residuals.absolute.begin(), residuals.absolute.end());
  return residuals;
}

class WarpTest : public ::testing::TestWithParam<World> {};

TEST_P(WarpTest, TruthCarriesLeftIntoRightThroughAnyCamera) {
  const Motion motion = own_motion(GetParam());
  const Scene scene = build_scene(GetParam(), motion, 1);
  for (const auto distortion : {Distortion::kNone, Distortion::kRadtan, Distortion::kEquidistant}) {
    SCOPED_TRACE(to_string(distortion));
    const StereoRig rig = small_rig(distortion);
    RenderedImage left;
    RenderedImage right;
    const SE3 pose = motion.at(6.0);
    Renderer(scene, rig.left).render(pose, 6.0, &left);
    Renderer(scene, rig.right).render(pose * rig.T_right_left.inverse(), 6.0, &right);
    ExposureControl exposure({}, scene.exposure_s);
    exposure.settle(left.light);
    const Pair pair{rig, take(left.light, exposure, 1), take(right.light, exposure, 2), left.range};
    const Residuals truth = warp(pair, 1.0);
    ASSERT_GT(truth.absolute.size(), 3000U);
    // Two noises of about 1, and what bilinear interpolation loses of texture.
    EXPECT_LT(truth.quantile(0.5), 2.0 + 0.12 * truth.contrast) << "contrast " << truth.contrast;
    const Residuals wrong = warp(pair, 1.25);
    // On a highway most of what is seen is asphalt, or far.
    const double factor = GetParam() == World::kHighway ? 1.1 : 1.25;
    EXPECT_GT(wrong.quantile(0.7), factor * truth.quantile(0.7));
  }
}

INSTANTIATE_TEST_SUITE_P(AllWorlds, WarpTest,
                         ::testing::Values(World::kLawn, World::kPool, World::kStreet, World::kHall,
                                           World::kSand, World::kHighway));

TEST(RendererTest, RowsOfARollingShutterAreOfTheirOwnInstants) {
  for (const World world : {World::kStreet, World::kPool}) {
    const Motion motion = own_motion(world);
    const Scene scene = build_scene(world, motion, 1);
    const StereoRig rig = small_rig(Distortion::kRadtan);
    Renderer renderer(scene, rig.left);
    const auto view_of = [&](double row) {
      const double t = 6.0 + 3e-4 * (row - 55.5);
      return Renderer::View{motion.at(t), t};
    };
    RenderedImage rolled;
    renderer.render_rolling(view_of, &rolled);
    RenderedImage at_once;
    renderer.render(motion.at(6.0), 6.0, &at_once);
    EXPECT_FALSE(std::equal(at_once.light.row(4), at_once.light.row(5), rolled.light.row(4)));
    // Four rows share an instant.
    for (const int y : {4, 7, 16, 55, 108, 111}) {
      const Renderer::View view = view_of(4 * (y / 4) + 1.5);
      renderer.render(view.T_world_camera, view.t, &at_once);
      EXPECT_TRUE(std::equal(at_once.light.row(y), at_once.light.row(y) + rig.left.width,
                             rolled.light.row(y)))
          << name_of(world) << " " << y;
      EXPECT_TRUE(std::equal(at_once.range.row(y), at_once.range.row(y) + rig.left.width,
                             rolled.range.row(y)))
          << name_of(world) << " " << y;
    }
  }
}

TEST(SimSourceTest, ARollingShutterGoesOnWhenTheFlightIsReversed) {
  SimConfig config = quiet(World::kHall);
  config.sensor.read_noise = config.sensor.shot_noise = 0.0;
  config.start = 40;
  config.frames = 1;
  config.sensor.readout_ms = 20.0;
  config.sensor.auto_exposure = false;
  // The same place on the way, there and back: rows that come later see what lies ahead, or behind.
  const StereoRig rig = small_rig(Distortion::kNone);
  SimSource forward = make_source(config, rig);
  const StereoFrame there = first_frame(forward);
  config.reverse = true;
  const double duration = own_motion(World::kHall).duration_s();
  config.start = static_cast<int>(std::lround(duration * 20.0)) - 40;
  SimSource backward = make_source(config, rig);
  const StereoFrame back = first_frame(backward);
  const auto differing = [&](int row) {
    int count = 0;
    for (int x = 0; x < there.left.width; ++x) {
      const auto i = static_cast<std::size_t>(row * there.left.step + x);
      count += (*there.left.data)[i] != (*back.left.data)[i] ? 1 : 0;
    }
    return count;
  };
  EXPECT_GT(differing(0) + differing(111), 2 * (differing(54) + differing(57)));
}

TEST(SimSourceTest, EqualSeedsGiveEqualBytesWithAnyNumberOfThreads) {
  SimConfig config = quiet(World::kHall);
  config.sensor = {};
  const StereoRig rig = small_rig(Distortion::kRadtan);
  config.threads = 1;
  SimSource a = make_source(config, rig);
  config.threads = 2;
  SimSource b = make_source(config, rig);
  config.seed = 2;
  SimSource c = make_source(config, rig);
  for (int i = 0; i < 2; ++i) {
    const StereoFrame fa = first_frame(a);
    const StereoFrame fb = first_frame(b);
    EXPECT_EQ(*fa.left.data, *fb.left.data);
    EXPECT_EQ(*fa.right.data, *fb.right.data);
    EXPECT_EQ(fa.left.exposure_s, fb.left.exposure_s);
    EXPECT_NE(*fa.left.data, *first_frame(c).left.data);
  }
  EXPECT_EQ(a.next(std::chrono::seconds(10)).state, SourceState::kEndOfStream);
}

TEST(SimSourceTest, DepthOfPlacesIsThatOfTheImage) {
  const SimConfig config = quiet(World::kPool);
  SimSource source = make_source(config, small_rig(Distortion::kNone));
  const std::int64_t stamp = source.truth().front().stamp_ns;
  const ImageF depth = source.depth_at(stamp);
  const auto places = source.depth_at(stamp, {{80, 90}, {20, 100}, {80.5, 90}});
  EXPECT_NEAR(places[0], depth.at(80, 90), 1e-4);
  EXPECT_NEAR(places[1], depth.at(20, 100), 1e-4);
  EXPECT_NEAR(places[2], 0.5 * (depth.at(80, 90) + depth.at(81, 90)), 2e-2);
}

TEST(SimSourceTest, DarkCameraAndDroppedPairs) {
  SimConfig config = quiet(World::kLawn);
  config.frames = 9;
  config.sensor.drop_rate = 0.4;
  config.sensor.dark = Side::kRight;
  config.sensor.right_offset_ms = 1.5;
  SimSource source = make_source(config, small_rig(Distortion::kNone));
  ASSERT_LT(*source.size(), 9U);
  ASSERT_GT(*source.size(), 2U);
  const StereoFrame frame = first_frame(source);
  const auto mean = [](const SideImage& image) {
    double sum = 0.0;
    for (const std::uint8_t p : *image.data) sum += p;
    return sum / static_cast<double>(image.data->size());
  };
  EXPECT_NEAR(mean(frame.left), config.sensor.target_grey, 12.0);
  EXPECT_LT(mean(frame.right), 2.0);
  EXPECT_EQ(frame.right.stamp_offset_ns, 1'500'000);
  std::uint64_t last = frame.sequence;
  bool gap = false;
  for (std::size_t i = 1; i < *source.size(); ++i) {
    const StereoFrame next = first_frame(source);
    gap |= next.sequence > last + 1;
    last = next.sequence;
  }
  EXPECT_TRUE(gap);
}

TEST(SimSourceTest, TheRightCameraIsTurnedAgainstItsCalibration) {
  SimConfig config = quiet(World::kPool);
  config.sensor.right_pitch_deg = 0.4;
  config.sensor.right_yaw_deg = -0.7;
  config.sensor.right_roll_deg = 1.5;
  const StereoRig rig = small_rig(Distortion::kRadtan);
  SimSource source = make_source(config, rig);
  EXPECT_TRUE(source.calibration().rig.T_right_left.matrix() == rig.T_right_left.matrix());
  const StereoFrame turned = first_frame(source);
  const SO3 turn = SO3::exp(M_PI / 180.0 * Vec3(0.4, -0.7, 1.5));
  SimSource expected = make_source(quiet(World::kPool), rig.turned(turn));
  const StereoFrame frame = first_frame(expected);
  EXPECT_EQ(*turned.left.data, *frame.left.data);
  EXPECT_EQ(*turned.right.data, *frame.right.data);

  config.sensor.right_turned_from_s = 0.01;  // from the second pair on
  SimSource later = make_source(config, rig);
  SimSource never = make_source(quiet(World::kPool), rig);
  EXPECT_EQ(*first_frame(later).right.data, *first_frame(never).right.data);
  EXPECT_NE(*first_frame(later).right.data, *first_frame(never).right.data);
  config.sensor.right_yaw_deg = 21.0;
  EXPECT_NE(open_sim(config).error().find("right_yaw_deg"), std::string::npos);
}

TEST(SimSourceTest, PairsAreLostForAWhileAgainAndAgain) {
  SimConfig config = quiet(World::kLawn);
  config.frames = 14;
  config.frame_rate = 10.0;
  config.sensor.gap_s = 0.2;
  config.sensor.gap_every_s = 0.5;
  SimSource source = make_source(config, small_rig(Distortion::kNone));
  std::vector<std::uint64_t> seen;
  for (std::size_t i = 0; i < *source.size(); ++i) seen.push_back(first_frame(source).sequence);
  const std::uint64_t zero = seen.front();
  for (std::uint64_t& s : seen) s -= zero;
  EXPECT_EQ(seen, (std::vector<std::uint64_t>{0, 1, 2, 3, 4, 7, 8, 9, 12, 13}));
  config.sensor.gap_every_s = 0.1;
  EXPECT_NE(open_sim(config).error().find("gap_every_s"), std::string::npos);
}

TEST(SimSourceTest, BackwardsIsTheMirrorInTime) {
  SimConfig config = quiet(World::kHall);
  SimSource forward = make_source(config, small_rig(Distortion::kNone));
  config.reverse = true;
  SimSource backward = make_source(config, small_rig(Distortion::kNone));
  const Motion motion = own_motion(World::kHall);
  const Trajectory truth = backward.truth();
  EXPECT_LT((truth.front().T_world_body.translation() -
             motion.samples().back().T_world_body.translation())
                .norm(),
            1e-9);
  EXPECT_EQ(backward.original_stamp(truth.front().stamp_ns), motion.last_ns());
  EXPECT_EQ(forward.original_stamp(motion.first_ns()), motion.first_ns());
}

TEST(SimSourceTest, ALorryKeepsItsDistanceAndTheWorldIsTheSame) {
  SimConfig config = quiet(World::kStreet);
  const StereoRig rig = small_rig(Distortion::kNone);
  SimSource empty = make_source(config, rig);
  config.traffic = Traffic::kLorry;
  SimSource source = make_source(config, rig);
  const Vec2 ahead(rig.left.cx, rig.left.cy);
  const Vec2 beside(0.1 * rig.left.width, 0.8 * rig.left.height);
  const std::int64_t first = source.truth().front().stamp_ns;
  for (const std::int64_t s : {0, 2, 5}) {
    const std::int64_t stamp = first + s * 1'000'000'000;
    const auto seen = source.depth_at(stamp, {ahead, beside});
    const auto world = empty.depth_at(stamp, {ahead, beside});
    EXPECT_NEAR(seen[0], 7.0, 0.15) << s << " s";
    EXPECT_GT(world[0], 20.0F);
    EXPECT_EQ(seen[1], world[1]);
  }
}

TEST(SimSourceTest, CarsComeTowardsTheCameraAndOvertakeIt) {
  for (const Traffic traffic : {Traffic::kOncoming, Traffic::kOvertaking}) {
    SimConfig config = quiet(World::kStreet);
    const StereoRig rig = small_rig(Distortion::kNone);
    SimSource empty = make_source(config, rig);
    config.traffic = traffic;
    SimSource source = make_source(config, rig);
    const std::int64_t first = source.truth().front().stamp_ns;
    // How much nearer a car in the lane at the left is from frame to frame; where it only stood,
    // that would be the camera's own step.
    constexpr double kPeriod = 0.1;
    const bool oncoming = traffic == Traffic::kOncoming;
    double last = 1e9;
    std::vector<double> speeds;
    for (int i = 0; i < 60; ++i) {
      const std::int64_t stamp = first + 100'000'000LL * i;
      const ImageF with = source.depth_at(stamp);
      const ImageF without = empty.depth_at(stamp);
      double nearest = 1e9;
      for (int y = 0; y < with.height(); ++y) {
        for (int x = 0; x < with.width() / 2; ++x) {
          const double depth = with.at(x, y);
          if (depth > 0.0 && std::abs(depth - without.at(x, y)) > 0.2) {
            nearest = std::min(nearest, depth);
          }
        }
      }
      const Vec3 step =
          source.pose_at(stamp).translation() - source.pose_at(stamp - 100'000'000LL).translation();
      if (i > 0 && nearest < 60.0 && last < 60.0) {
        speeds.push_back((last - nearest - (oncoming ? step.norm() : 0.0)) / kPeriod);
      }
      last = nearest;
    }
    ASSERT_GT(speeds.size(), 10U);
    std::sort(speeds.begin(), speeds.end());
    EXPECT_NEAR(speeds[speeds.size() / 2], oncoming ? 10.0 : -5.0, 1.0) << "m/s";
  }
}

/// On the highway everyone keeps to a lane of his own, and all of them are there at once.
TEST(SimSourceTest, ABusyHighwayHasCarsAheadBesideAndOnTheOtherSide) {
  SimConfig config = quiet(World::kHighway);
  const StereoRig rig = small_rig(Distortion::kNone);
  SimSource empty = make_source(config, rig);
  config.traffic = Traffic::kBusy;
  SimSource busy = make_source(config, rig);
  const std::int64_t first = busy.truth().front().stamp_ns;
  bool ahead = false;
  bool beside = false;
  bool opposite = false;
  for (int i = 0; i < 60; ++i) {
    const std::int64_t stamp = first + 100'000'000LL * i;
    const ImageF with = busy.depth_at(stamp);
    const ImageF without = empty.depth_at(stamp);
    for (int y = 0; y < with.height(); ++y) {
      for (int x = 0; x < with.width(); ++x) {
        const double depth = with.at(x, y);
        if (!(depth > 0.0) || std::abs(depth - without.at(x, y)) < 0.5) continue;
        const double left = (rig.left.cx - x) / rig.left.fx * depth;
        ahead = ahead || (std::abs(left) < 1.0 && std::abs(depth - 20.0) < 1.0);
        beside = beside || (std::abs(left - 3.6) < 1.0 && depth < 40.0);
        opposite = opposite || (std::abs(left - 15.0) < 2.0 && depth < 60.0);
      }
    }
  }
  EXPECT_TRUE(ahead);
  EXPECT_TRUE(beside);
  EXPECT_TRUE(opposite);
}

TEST(SimSourceTest, TrafficIsForRoads) {
  SimConfig config;
  config.world = World::kLawn;
  config.traffic = Traffic::kCar;
  EXPECT_NE(open_sim(config).error().find("in the street and on the highway only"),
            std::string::npos);
}

TEST(SimSourceTest, WrongValuesAreRefusedWithAReason) {
  SimConfig config;
  config.trajectory = "/nowhere/poses.txt";
  EXPECT_NE(open_sim(config).error().find("/nowhere/poses.txt"), std::string::npos);
  config = {};
  config.sensor.vignette = 2.0;
  EXPECT_NE(open_sim(config).error().find("vignette"), std::string::npos);
}

TEST(SimExportTest, ReadsBackToTheSamePixels) {
  namespace fs = std::filesystem;
  const fs::path root = fs::path(::testing::TempDir()) / "sim_export";
  fs::remove_all(root);
  SimConfig config = quiet(World::kHall);
  config.sensor.vignette = 0.3;
  config.sensor.response_gamma = 1.4;
  const StereoRig rig = small_rig(Distortion::kRadtan);
  SimSource exported = make_source(config, rig);
  const auto done = export_dataset(&exported, root.string(), true);
  ASSERT_TRUE(done) << done.error();
  DatasetOptions options;
  options.path = root.string();
  auto dataset = open_dataset(options);
  ASSERT_TRUE(dataset) << dataset.error();
  SimSource rendered = make_source(config, rig);
  for (int i = 0; i < config.frames; ++i) {
    const SourceResult read = (*dataset)->next(std::chrono::seconds(10));
    ASSERT_EQ(read.state, SourceState::kFrame) << read.message;
    const StereoFrame frame = first_frame(rendered);
    EXPECT_EQ(read.frame.stamp_ns, frame.stamp_ns);
    EXPECT_EQ(*read.frame.left.data, *frame.left.data);
    EXPECT_EQ(*read.frame.right.data, *frame.right.data);
    EXPECT_NEAR(read.frame.left.exposure_s, frame.left.exposure_s, 1e-8);
    const fs::path depth = root / "depth" / (std::to_string(frame.stamp_ns) + ".pfm");
    EXPECT_GT(fs::file_size(depth), 160U * 112U * 4U);
  }
  const StereoRig& back = (*dataset)->rig();
  EXPECT_LT((back.T_right_left.matrix() - rig.T_right_left.matrix()).norm(), 1e-12);
  EXPECT_EQ(back.right.d, rig.right.d);
  const auto& photometric = (*dataset)->calibration().left_photometric;
  ASSERT_FALSE(photometric.vignette.empty());
  EXPECT_NEAR(photometric.vignette.at(0, 0), 0.7, 2e-3);
  EXPECT_NEAR(photometric.inverse_response[128], 255.0 * std::pow(128 / 255.0, 1.4), 1e-2);
  const auto truth = read_tum((root / "groundtruth_cam0_tum.txt").string());
  ASSERT_TRUE(truth) << truth.error();
  EXPECT_EQ(truth->size(), 2U);
  EXPECT_LT((truth->back().T_world_body.translation() -
             rendered.truth().back().T_world_body.translation())
                .norm(),
            1e-8);
}

}  // namespace
}  // namespace sovo::sim
