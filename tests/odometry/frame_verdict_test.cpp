#include "sovo/odometry/frame_verdict.h"

#include <gtest/gtest.h>

#include <limits>

namespace sovo::test {

namespace {

/// A frame of which all is well, to be spoilt.
struct Judged {
  StereoOdometryConfig config;
  FrameTracking tracking;
  double mean_rho = 0.1;
  std::string right_problem;
  OdometryOutput out;

  Judged() {
    tracking.good = true;
    tracking.inlier_ratio = 0.9;
    out.scale_valid = true;
    out.scale_verdict = ScaleVerdict::kAccepted;
    set_sigma(0.001);
  }
  /// Of each axis of the position [m].
  void set_sigma(double sigma) {
    out.frame_covariance.setZero();
    out.frame_covariance.diagonal().head<3>().setConstant(sigma * sigma);
  }
  OdometryState state() {
    judge_frame(config, tracking, mean_rho, right_problem, &out);
    return out.state;
  }
};

}  // namespace

TEST(FrameVerdict, WhatIsWellIsTracked) {
  Judged frame;
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
  EXPECT_EQ(frame.out.reason, "");
  frame.tracking = FrameTracking();  // the frame that a map begins with
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
}

TEST(FrameVerdict, FewPixelsThatAgreeAreDegraded) {
  Judged frame;
  frame.tracking.inlier_ratio = 0.6;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_EQ(frame.out.reason, "only 60 % of the pixels agree");
  frame.config.backend = Backend::kFeatures;
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
  frame.tracking.inlier_ratio = 0.45;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_EQ(frame.out.reason, "only 45 % of the features agree");
}

TEST(FrameVerdict, RestBeforeAWorldThatMovesIsDegraded) {
  Judged frame;
  frame.tracking.rest_denied = true;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_NE(frame.out.reason.find("mask"), std::string::npos);
}

TEST(FrameVerdict, MotionBeforeAWorldThatStaysIsDegraded) {
  Judged frame;
  frame.tracking.motion_denied = true;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_NE(frame.out.reason.find("stays in its place"), std::string::npos);
}

TEST(FrameVerdict, APlaceThatTheImageDoesNotTellIsDegraded) {
  Judged frame;
  frame.set_sigma(0.022);  // 0.38 % of the mean depth of 10 m, all axes together
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
  frame.set_sigma(0.024);
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_NE(frame.out.reason.find("too little"), std::string::npos);
  frame.mean_rho = 0.05;
  EXPECT_EQ(frame.state(), OdometryState::kTracking) << "of things twice as far it tells enough";
  frame.set_sigma(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
}

TEST(FrameVerdict, ABadRightImageIsDegradedWhateverTheScaleIs) {
  Judged frame;
  frame.right_problem = "the right image is dark";
  frame.out.scale_valid = false;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_EQ(frame.out.reason, "the right image is dark; the scale is not measured");
}

TEST(FrameVerdict, AScaleThatWasSoughtInVainForLongIsUnobserved) {
  Judged frame;
  frame.out.scale_age_s = 10.0;
  EXPECT_EQ(frame.state(), OdometryState::kTracking) << "none was sought";
  frame.out.scale_verdict = ScaleVerdict::kTooFewPoints;
  EXPECT_EQ(frame.state(), OdometryState::kScaleUnobserved);
  EXPECT_NE(frame.out.reason.find("scale not measured"), std::string::npos);
  frame.out.scale_age_s = 1.0;
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
  frame.out.scale_valid = false;
  EXPECT_EQ(frame.state(), OdometryState::kScaleUnobserved);
  frame.config.mode = OdometryMode::kMono;
  EXPECT_EQ(frame.state(), OdometryState::kTracking) << "it has none";
}

TEST(FrameVerdict, ATurnedRightCameraIsToldWhereNothingIsWorse) {
  Judged frame;
  frame.out.decalibrated = true;
  EXPECT_EQ(frame.state(), OdometryState::kTracking);
  EXPECT_NE(frame.out.reason.find("calibrate again"), std::string::npos);
  frame.tracking.inlier_ratio = 0.6;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_EQ(frame.out.reason.find("calibrate again"), std::string::npos);
}

TEST(FrameVerdict, WithAnotherFocalLengthPosesAreNotGood) {
  Judged frame;
  frame.out.focal_error = -0.01;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_NE(frame.out.reason.find("sovo calib refine"), std::string::npos);
  frame.out.decalibrated = true;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded) << "that is undone, this is not";
  frame.tracking.inlier_ratio = 0.6;
  EXPECT_EQ(frame.state(), OdometryState::kDegraded);
  EXPECT_EQ(frame.out.reason.find("sovo calib refine"), std::string::npos);
}

}  // namespace sovo::test
