#include <arv.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

#include "driver/aravis/aravis_fixture.h"

namespace sovo {
namespace {

constexpr int kFakeWidth = 640;
constexpr int kFakeHeight = 480;
#ifdef __SANITIZE_ADDRESS__  // several times slower
constexpr std::int64_t kFakePeriodUs = 66'667;
#else
constexpr std::int64_t kFakePeriodUs = 33'333;
#endif
constexpr std::size_t kFakeDisparity = 24;

/// A row of noise that moves by three pixels an instant, seen by two cameras: what is at x in the
/// right image is at x + disparity in the left one.
class NoiseScene {
 public:
  NoiseScene() : noise_(1U << 16U) {
    std::uint32_t state = 1;
    for (std::uint8_t& value : noise_) {
      state = state * 1664525U + 1013904223U;
      value = static_cast<std::uint8_t>(state >> 24U);
    }
  }

  void draw(std::uint64_t instant, bool right, std::uint8_t* pixels) const {
    for (std::size_t y = 0; y < kFakeHeight; ++y) {
      const std::size_t row = y * 131 + 3 * instant + (right ? kFakeDisparity : 0);
      for (std::size_t x = 0; x < kFakeWidth; ++x) {
        pixels[y * kFakeWidth + x] = noise_[(row + x) % noise_.size()];
      }
    }
    std::memcpy(pixels, &instant, sizeof instant);
  }

 private:
  std::vector<std::uint8_t> noise_;
};

/// libaravis' own fake camera, which shows a scene.
class FakeCamera {
 public:
  FakeCamera(const char* address, const char* serial, bool right, const NoiseScene& scene)
      : right_(right), scene_(scene), camera_(arv_gv_fake_camera_new(address, serial)) {
    ArvFakeCamera* fake = arv_gv_fake_camera_get_fake_camera(camera_);
    for (const auto& [address_of, value] :
         {std::pair{ARV_FAKE_CAMERA_REGISTER_SENSOR_WIDTH, kFakeWidth},
          std::pair{ARV_FAKE_CAMERA_REGISTER_SENSOR_HEIGHT, kFakeHeight},
          std::pair{ARV_FAKE_CAMERA_REGISTER_WIDTH, kFakeWidth},
          std::pair{ARV_FAKE_CAMERA_REGISTER_HEIGHT, kFakeHeight}}) {
      arv_fake_camera_write_register(fake, address_of, static_cast<guint32>(value));
    }
    arv_fake_camera_set_fill_pattern(fake, fill, this);
  }
  ~FakeCamera() { g_object_unref(camera_); }
  FakeCamera(const FakeCamera&) = delete;
  FakeCamera& operator=(const FakeCamera&) = delete;

  bool is_running() const { return arv_gv_fake_camera_is_running(camera_) != FALSE; }

 private:
  /// The two run by themselves; what they show is of the last whole multiple of the period.
  static void fill(ArvBuffer* buffer, void* self, guint32, guint32, ArvPixelFormat) {
    const auto* camera = static_cast<const FakeCamera*>(self);
    const auto instant = static_cast<std::uint64_t>(g_get_real_time() / kFakePeriodUs);
    // Until the driver has set it up, it may be asked for images of another size.
    if (arv_buffer_get_image_width(buffer) != kFakeWidth) return;
    if (arv_buffer_get_image_height(buffer) != kFakeHeight) return;
    const void* data = arv_buffer_get_data(buffer, nullptr);
    camera->scene_.draw(instant, camera->right_,
                        static_cast<std::uint8_t*>(const_cast<void*>(data)));
    arv_buffer_set_timestamp(buffer, instant * static_cast<std::uint64_t>(kFakePeriodUs) * 1000U);
  }

  bool right_;
  const NoiseScene& scene_;
  ArvGvFakeCamera* camera_;
};

using FakeCameras = AravisTest;

TEST_F(FakeCameras, EveryPairShowsOneInstant) {
  const NoiseScene scene;
  FakeCamera left("127.0.0.2", "LEFT", false, scene);
  FakeCamera right("127.0.0.3", "RIGHT", true, scene);
  if (!left.is_running() || !right.is_running()) {
    GTEST_SKIP() << "libaravis' fake cameras do not start here";
  }
  options_.sync = aravis::Sync::kFree;
  options_.frame_rate = std::round(1e6 / kFakePeriodUs);
  // Larger ones take more of the socket's buffer on the loopback interface than they carry.
  options_.packet_size = 1400;
  auto opened = open(kFakeWidth, kFakeHeight);
  ASSERT_TRUE(opened) << opened.error();
  LiveSource& source = *opened->source;
  const bool longer = std::getenv("SOVO_TEST_LONG") != nullptr;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(longer ? 60 : 5);
  std::vector<std::uint8_t> wanted(std::size_t{kFakeWidth} * kFakeHeight);
  std::size_t pairs = 0;
  double worst_error = 0.0;
  while (std::chrono::steady_clock::now() < end || pairs < 10) {
    ASSERT_LT(std::chrono::steady_clock::now(), end + std::chrono::seconds(60)) << pairs;
    const auto next = source.next(std::chrono::milliseconds(100));
    if (next.state != SourceState::kFrame || !next.frame.right.valid) continue;
    ++pairs;
    worst_error = std::max(worst_error, next.frame.pair_error_s);
    std::uint64_t instant = 0;
    std::memcpy(&instant, next.frame.left.data->data(), sizeof instant);
    for (const bool is_right : {false, true}) {
      const SideImage& image = is_right ? next.frame.right : next.frame.left;
      scene.draw(instant, is_right, wanted.data());
      const auto odd = std::mismatch(wanted.begin(), wanted.end(), image.data->begin());
      ASSERT_EQ(odd.first - wanted.begin(), std::ptrdiff_t{kFakeWidth} * kFakeHeight)
          << "right: " << is_right << ", pair " << pairs;
    }
  }
  const LiveReport report = source.report();
  std::printf("%zu pairs, largest error %.3f ms\n", pairs, 1e3 * worst_error);
  for (const CameraReport& camera : report.cameras) {
    const CameraCounts& counts = camera.counts;
    std::printf("%s: %llu images, %llu skipped, %llu damaged; completed %s, failures %s\n",
                camera.name.c_str(), static_cast<unsigned long long>(counts.images),
                static_cast<unsigned long long>(counts.skipped),
                static_cast<unsigned long long>(counts.damaged),
                counter(camera, "completed").c_str(), counter(camera, "failures").c_str());
    EXPECT_EQ(counts.disconnects, 0U);
  }
  // Every left image is in a pair, or was given alone, or waits, or was one the queue had no room
  // for.
  EXPECT_LE(report.pairs.pairs + report.pairs.unpaired_left, report.cameras[0].counts.images);
  EXPECT_EQ(report.frames + report.queue_dropped <= report.cameras[0].counts.images, true);
}

}  // namespace
}  // namespace sovo
