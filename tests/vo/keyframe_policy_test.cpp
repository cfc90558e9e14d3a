#include "sovo/vo/keyframe_policy.h"

#include <gtest/gtest.h>

namespace sovo {
namespace {

class KeyframeDecision : public ::testing::Test {
 protected:
  KeyframeDecision() {
    camera_.width = 640;
    camera_.height = 480;
  }

  /// Flow of the whole image without rotation [px], residual over that of the first frame.
  bool wanted(double flow_px, double rmse_ratio, double log_gain = 0.0) const {
    TrackingResult tracked;
    tracked.flow_translation = tracked.flow_total = flow_px;
    tracked.rmse = rmse_ratio;
    tracked.affine.a = log_gain;
    return wants_keyframe(KeyframeConfig(), camera_, TrackingReference(), tracked, 0.0, 1.0);
  }

  CameraModel camera_;
};

TEST_F(KeyframeDecision, FlowOrBrightnessAloneSuffices) {
  EXPECT_FALSE(wanted(16.0, 1.0));
  EXPECT_TRUE(wanted(17.0, 1.0));
  EXPECT_FALSE(wanted(0.0, 1.0, 0.49));
  EXPECT_TRUE(wanted(0.0, 1.0, 0.51));
  EXPECT_TRUE(wanted(0.0, 1.0, -0.51));
}

TEST_F(KeyframeDecision, ABadFitMakesOneWhereThereIsParallax) {
  EXPECT_FALSE(wanted(8.0, 1.9));
  EXPECT_TRUE(wanted(8.0, 2.1));
}

TEST_F(KeyframeDecision, ABadFitOfACameraAtRestDoesNot) {
  EXPECT_FALSE(wanted(0.2, 2.1));
  EXPECT_FALSE(wanted(0.0, 10.0));
}

}  // namespace
}  // namespace sovo
