#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

#include "odometry/odometry_test_support.h"

namespace {

std::atomic<long> allocations{0};

}  // namespace

// Every allocation of this program is counted, but where a sanitizer has operators of its own.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kCounts = false;
#else
constexpr bool kCounts = true;

namespace {

void* allocate(std::size_t size) {
  ++allocations;
  if (void* memory = std::malloc(size)) return memory;
  throw std::bad_alloc();
}

void* allocate(std::size_t size, std::align_val_t alignment) {
  ++allocations;
  const auto unit = static_cast<std::size_t>(alignment);
  if (void* memory = std::aligned_alloc(unit, (size + unit - 1) / unit * unit)) return memory;
  throw std::bad_alloc();
}

}  // namespace

void* operator new(std::size_t size) { return allocate(size); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return allocate(size, alignment);
}
void* operator new[](std::size_t size) { return allocate(size); }
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return allocate(size, alignment);
}
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete(void* memory, std::align_val_t /*alignment*/) noexcept { std::free(memory); }
void operator delete(void* memory, std::size_t /*size*/, std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::align_val_t /*alignment*/) noexcept { std::free(memory); }
void operator delete[](void* memory, std::size_t /*size*/,
                       std::align_val_t /*alignment*/) noexcept {
  std::free(memory);
}
#endif

namespace sovo {
namespace {

using namespace test;

/// Counts keyframes, and keeps nothing.
class KeyframeCounter : public OutputSink {
 public:
  void on_frame(const OdometryOutput& output) override { tracked += output.pose_valid ? 1 : 0; }
  void on_keyframe(const KeyframeOutput& /*keyframe*/) override { ++keyframes; }
  void on_scale(const ScaleRecord& /*record*/) override {}

  int tracked = 0;
  int keyframes = 0;
};

/// Allocations of the frames of a drive, without and with a keyframe, from `first` on.
struct FrameAllocations {
  std::vector<long> plain, keyframe;
};

FrameAllocations count_allocations(Lighting lighting, int threads, int first, int frames) {
  StereoOdometryConfig config = test_config();
  config.lighting = lighting;
  config.threads = threads;
  config.vo.keyframe.max_keyframes = 4;  // the window is full early
  config.vo.keyframe.min_keyframes = 3;
  KeyframeCounter counter;
  StereoOdometry odometry(config, test_cameras(), &counter);
  FrameAllocations out;
  for (int i = 0; i < frames; ++i) {
    const StereoFrame frame = drive_frame(i);
    const int keyframes_before = counter.keyframes;
    const long before = allocations;
    odometry.process(frame);
    const long made = allocations - before;
    if (i < first) continue;
    (counter.keyframes > keyframes_before ? out.keyframe : out.plain).push_back(made);
  }
  EXPECT_EQ(counter.tracked, frames);
  return out;
}

TEST(Allocations, AFrameMakesNoneInTheSteadyState) {
  if (!kCounts) GTEST_SKIP() << "a sanitizer has allocation for itself";
  constexpr int kFrames = 48;
  constexpr int kFull = 28;  // keyframes enough by then
  for (const auto& [lighting, threads] :
       {std::pair{Lighting::kAuto, 1}, {Lighting::kAuto, 2}, {Lighting::kVehicle, 1}}) {
    const FrameAllocations made = count_allocations(lighting, threads, kFull, kFrames);
    ASSERT_GT(made.plain.size(), 10U);
    ASSERT_GT(made.keyframe.size(), 2U);
    long frames_that_do = 0;
    for (const long n : made.plain) {
      EXPECT_LE(n, 1);
      frames_that_do += n > 0 ? 1 : 0;
    }
    // The list of all frames, of which the refined trajectory is made, doubles now and then.
    EXPECT_LE(frames_that_do, 1);
    // What a keyframe gives out is new; each list is allocated at once.
    for (const long n : made.keyframe) EXPECT_LT(n, 400);
  }
}

}  // namespace
}  // namespace sovo
