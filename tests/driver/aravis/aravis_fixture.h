#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "driver/aravis/private_network.h"
#include "io/io_test_support.h"
#include "sovo/driver/aravis/aravis_source.h"

namespace sovo {

/// A pair of GigE Vision cameras in a network of the test's own.
class AravisTest : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!enter_private_network()) {
      GTEST_SKIP() << "no private network: this needs root, or user namespaces";
    }
    options_.left = "LEFT";
    options_.right = "RIGHT";
    live_.stall_s = 60.0;  // a loaded machine is no stalled camera
    live_.longest_wait_s = 0.2;
  }

  Result<aravis::OpenedSource> open(int width, int height) {
    const auto side = [&](const char* name) {
      return std::string(name) + ": {width: " + std::to_string(width) +
             ", height: " + std::to_string(height) +
             ", fx: 350, fy: 350, cx: 80, cy: 60, distortion: none}\n";
    };
    const std::string path =
        folder_.write("rig.yaml", "sovo_calibration: 1\n" + side("left") + side("right") +
                                      "T_right_left: [1,0,0,-0.12, 0,1,0,0, 0,0,1,0]\n");
    return aravis::open_aravis(options_, live_, path);
  }

  /// Up to `count` frames; fewer when they do not come within a minute or two.
  static std::vector<StereoFrame> take(
      LiveSource* source, std::size_t count,
      const std::function<bool(const StereoFrame&)>& wanted = [](const StereoFrame& frame) {
        return frame.left.valid && frame.right.valid;
      }) {
    std::vector<StereoFrame> frames;
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(90);
    while (frames.size() < count && std::chrono::steady_clock::now() < end) {
      auto next = source->next(std::chrono::milliseconds(100));
      if (next.state != SourceState::kFrame || !wanted(next.frame)) continue;
      // The camera's own buffers are needed for what comes.
      for (SideImage* image : {&next.frame.left, &next.frame.right}) {
        if (image->data) {
          image->data = std::make_shared<const std::vector<std::uint8_t>>(*image->data);
        }
      }
      frames.push_back(std::move(next.frame));
    }
    return frames;
  }

  /// The report once `done` says so, or after a while; takes frames meanwhile.
  static LiveReport report_when(LiveSource* source,
                                const std::function<bool(const LiveReport&)>& done) {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(90);
    while (!done(source->report()) && std::chrono::steady_clock::now() < end) {
      (void)source->next(std::chrono::milliseconds(50));
    }
    return source->report();
  }

  static std::string counter(const CameraReport& camera, const std::string& name) {
    for (const auto& [key, value] : camera.stream) {
      if (key == name) return value;
    }
    return "";
  }
  static double number(const CameraReport& camera, const std::string& name) {
    const std::string text = counter(camera, name);
    return text.empty() ? -1.0 : std::stod(text);
  }

  TemporaryFolder folder_;
  aravis::AravisOptions options_;
  LiveOptions live_;
};

}  // namespace sovo
