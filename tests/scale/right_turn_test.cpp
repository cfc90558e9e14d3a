#include "sovo/scale/right_turn.h"

#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "support/numeric.h"

namespace sovo {
namespace {

constexpr double kFocal = 400.0;

/// How keyframes show a turn, alike about all axes unless it is said.
struct Shown {
  double scatter_px = 0.02;
  Vec3 sigma_px = Vec3::Constant(0.03);
  Vec3 disagreement_px = Vec3::Zero();
  bool doubtful = false;
};

/// Feeds keyframes that see `px`, whatever is undone.
class Keyframes {
 public:
  explicit Keyframes(const RightTurnConfig& config = {}, unsigned seed = 1)
      : turn(config, kFocal), random_(seed) {}

  void see(const Vec3& px, int count, const Shown& shown = {}) {
    std::normal_distribution<double> normal(0.0, shown.scatter_px);
    for (int i = 0; i < count; ++i) {
      const Vec3 noise(normal(random_), normal(random_), normal(random_));
      const SO3 given = turn.turn();
      const SO3 total = SO3::exp((px + noise) / kFocal);
      turn.note({true,
                 (total * given.inverse()).log(),
                 shown.sigma_px / kFocal,
                 {},
                 shown.disagreement_px / kFocal,
                 shown.doubtful},
                given);
    }
  }

  RightTurn turn;

 private:
  std::mt19937 random_;
};

/// Of a lens that is described a little badly: parts of the image disagree about each axis [px].
Shown disagreeing(double px) { return {.disagreement_px = Vec3::Constant(px)}; }

Vec3 undone_px(const RightTurn& turn) { return kFocal * turn.turn().log(); }

TEST(RightTurn, OfOnePixelIsUndoneAfterFiveKeyframes) {
  for (const Vec3& px : {Vec3(1, 0, 0), Vec3(0, -1, 0), Vec3(0, 0, 1)}) {
    Keyframes keyframes;
    keyframes.see(px, 4);
    EXPECT_FALSE(keyframes.turn.decalibrated());
    keyframes.see(px, 1);
    EXPECT_TRUE(keyframes.turn.decalibrated());
    EXPECT_LT((undone_px(keyframes.turn) - px).norm(), 0.1);
    keyframes.see(px, 100);
    EXPECT_LT((undone_px(keyframes.turn) - px).norm(), 0.02);
  }
}

TEST(RightTurn, OfAFifthOfAPixelTakesMany) {
  Keyframes keyframes;
  keyframes.see({0, 0.2, 0}, 10, disagreeing(0.015));
  EXPECT_FALSE(keyframes.turn.decalibrated());
  EXPECT_TRUE(undone_px(keyframes.turn).isZero(0.0));
  keyframes.see({0, 0.2, 0}, 60, disagreeing(0.015));
  EXPECT_TRUE(keyframes.turn.decalibrated());
  EXPECT_NEAR(undone_px(keyframes.turn).y(), 0.2, 0.02);
}

TEST(RightTurn, OfAFifthOfAPixelTakesFewWhereAllPartsAgree) {
  for (const Vec3& px : {Vec3(0.2, 0, 0), Vec3(0, -0.2, 0), Vec3(0, 0, 0.2)}) {
    Keyframes keyframes;
    keyframes.see(px, 5);
    EXPECT_FALSE(keyframes.turn.decalibrated()) << px.transpose();
    keyframes.see(px, 1);
    EXPECT_TRUE(keyframes.turn.decalibrated()) << px.transpose();
    EXPECT_LT((undone_px(keyframes.turn) - px).norm(), 0.03) << px.transpose();
  }
  Keyframes smaller;
  smaller.see({0, 0.08, 0}, 40);
  EXPECT_TRUE(smaller.turn.decalibrated());
  EXPECT_NEAR(undone_px(smaller.turn).y(), 0.08, 0.02);
}

TEST(RightTurn, ACalibrationThatFitsIsLeftAsItIs) {
  for (unsigned flight = 0; flight < 50; ++flight) {
    Keyframes keyframes({}, flight);
    for (int i = 0; i < 60; ++i) {
      keyframes.see({0, 0, 0}, 1, {.scatter_px = 0.06});
      ASSERT_FALSE(keyframes.turn.decalibrated()) << flight << " " << i;
    }
  }
}

// A lens shows that it is described badly about one axis, and looks like a turn about another.
TEST(RightTurn, WhatPartsDisagreeAboutIsBadForAllAxes) {
  Keyframes keyframes;
  keyframes.see({0, 0.3, 0}, 12, {.disagreement_px = {0.0, 0.0, 0.1}});
  EXPECT_FALSE(keyframes.turn.decalibrated());
  Keyframes unseen;
  unseen.see({0, 0.3, 0}, 12, {.sigma_px = {0.03, 0.03, 0.5}});
  EXPECT_FALSE(unseen.turn.decalibrated()) << "nor is known whether they would disagree";
}

TEST(RightTurn, WhatManyKeyframesShowInPartIsOne) {
  Keyframes keyframes;
  for (int i = 0; i < 30; ++i) {
    keyframes.see({0, 0.4, 0}, 1);
    keyframes.see({0, 0.9, 0}, 1);
  }
  EXPECT_TRUE(keyframes.turn.decalibrated());
  EXPECT_NEAR(undone_px(keyframes.turn).y(), 0.65, 0.15);
}

TEST(RightTurn, WhatScattersIsNone) {
  for (unsigned flight = 0; flight < 50; ++flight) {
    Keyframes keyframes({}, flight);
    for (int i = 0; i < 20; ++i) {
      keyframes.see({0.1, 0.25, -0.3}, 10, {.scatter_px = 0.25});
      ASSERT_FALSE(keyframes.turn.decalibrated()) << flight << " " << i;
    }
  }
}

TEST(RightTurn, SomeKeyframesThatErrMoveNothing) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 40);
  for (int i = 0; i < 10; ++i) {
    keyframes.see({0, 2, 0}, 5);
    keyframes.see({0, 0, 0}, 2);
    EXPECT_FALSE(keyframes.turn.decalibrated());
    EXPECT_LT(keyframes.turn.mean_px().norm(), 0.05);
  }
}

TEST(RightTurn, AKnockIsNoticedAfterALongCalm) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 500);
  keyframes.see({0, 0.8, 0}, 6);
  EXPECT_TRUE(keyframes.turn.decalibrated());
  EXPECT_NEAR(undone_px(keyframes.turn).y(), 0.8, 0.1);
  keyframes.see({0, 2.0, 0}, 8);  // and another one
  EXPECT_NEAR(undone_px(keyframes.turn).y(), 2.0, 0.1);
  keyframes.see({0, 0, 0}, 30);  // bent back
  EXPECT_FALSE(keyframes.turn.decalibrated());
  EXPECT_TRUE(undone_px(keyframes.turn).isZero(0.0));
}

// Depths that are wrong after a narrow turn of the vehicle look like a yaw until they are mended.
TEST(RightTurn, WhatGoesBackAgainWasNoKnock) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 500);
  for (const double px : {1.41, 1.51, 1.26, 1.33, 1.12, 1.06, 0.71, 0.53, 0.52, 0.3, 0.1, 0.0}) {
    keyframes.see({0, px, 0}, 1);
    EXPECT_FALSE(keyframes.turn.decalibrated()) << px;
  }
  keyframes.see({0, 0, 0}, 10);
  keyframes.see({0, 1.2, 0}, 6, {.scatter_px = 0.06});
  EXPECT_TRUE(keyframes.turn.decalibrated()) << "what stays was one";
}

TEST(RightTurn, WhatPartsOfTheImageDisagreeAboutIsNone) {
  for (const int count : {5, 40}) {
    Keyframes lens;
    lens.see({0, 0.8, 0}, count, disagreeing(0.1));
    EXPECT_FALSE(lens.turn.decalibrated()) << count;
    Keyframes turned;
    turned.see({0, 0.8, 0}, count, disagreeing(0.04));
    EXPECT_TRUE(turned.turn.decalibrated()) << count;
  }
}

// Light that moves over what is seen bends the depths of a map until that is left behind.
TEST(RightTurn, KeyframesThatHardlyFitTellLess) {
  const Shown doubtful{.scatter_px = 0.15,
                       .sigma_px = Vec3::Constant(0.07),
                       .disagreement_px = Vec3::Constant(0.1),
                       .doubtful = true};
  Keyframes bent;
  bent.see({0, -2, 0}, 8, doubtful);
  EXPECT_FALSE(bent.turn.decalibrated());
  bent.see({0, 0, 0}, 40, {.scatter_px = 0.05, .sigma_px = Vec3::Constant(0.07)});
  EXPECT_FALSE(bent.turn.decalibrated());
  EXPECT_NEAR(bent.turn.mean_px().y(), -2.0 * 2.0 / 42.0, 0.05) << "each has a quarter's weight";

  Keyframes turned;
  turned.see({0, -2, 0}, 20, doubtful);
  EXPECT_TRUE(turned.turn.decalibrated()) << "but many tell it, too";
  EXPECT_NEAR(undone_px(turned.turn).y(), -2.0, 0.2);
}

TEST(RightTurn, IsNotInDoubtForLong) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 40);
  int in_doubt = 0;
  for (int i = 0; i < 40; ++i) {
    keyframes.see({0, i % 2 == 0 ? 0.6 : 1.6, 0}, 1);
    in_doubt += keyframes.turn.in_doubt() ? 1 : 0;
  }
  EXPECT_GE(in_doubt, 8);
  EXPECT_LE(in_doubt, 12);
}

TEST(RightTurn, IsInDoubtWhileAKeyframeShowsAnother) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 40);
  EXPECT_FALSE(keyframes.turn.in_doubt());
  for (int i = 0; i < 5; ++i) {
    keyframes.see({0, 0.8, 0}, 1);
    EXPECT_TRUE(keyframes.turn.in_doubt());
  }
  keyframes.see({0, 0.8, 0}, 1);  // now it is believed
  EXPECT_FALSE(keyframes.turn.in_doubt());
  keyframes.see({0, 0.8, 0}, 20);
  keyframes.see({0, 0, 0}, 1);
  EXPECT_TRUE(keyframes.turn.in_doubt());
  keyframes.see({0, 0.8, 0}, 1);
  EXPECT_FALSE(keyframes.turn.in_doubt());
}

TEST(RightTurn, AKeyframeThatShowsNoTurnPutsNothingInDoubt) {
  Keyframes keyframes;
  keyframes.see({0, 0, 0}, 40);
  keyframes.see({0, 0.8, 0}, 1);
  EXPECT_TRUE(keyframes.turn.in_doubt());
  keyframes.see({0, 0.8, 0}, 1, {.sigma_px = Vec3::Constant(0.5)});
  EXPECT_FALSE(keyframes.turn.in_doubt());
}

TEST(RightTurn, AnAxisThatIsNotSeenSaysNothing) {
  Keyframes keyframes;
  keyframes.see({0, 3, 0}, 100, {.sigma_px = Vec3::Constant(0.5)});
  EXPECT_FALSE(keyframes.turn.decalibrated());
  EXPECT_EQ(keyframes.turn.mean_px().norm(), 0.0);
  keyframes.turn.note({}, SO3());
  EXPECT_EQ(keyframes.turn.mean_px().norm(), 0.0);
}

TEST(RightTurn, IsOnlyMeasuredWhereItIsNotToBeUndone) {
  RightTurnConfig config;
  config.undo = false;
  Keyframes keyframes(config);
  keyframes.see({1, 0, 0}, 50);
  EXPECT_FALSE(keyframes.turn.decalibrated());
  EXPECT_TRUE(undone_px(keyframes.turn).isZero(0.0));
  EXPECT_NEAR(keyframes.turn.mean_px().x(), 1.0, 0.02);
  keyframes.see({3, 0, 0}, 2);
  EXPECT_FALSE(keyframes.turn.in_doubt());
}

TEST(RightTurn, WhatIsNoNumberIsForgotten) {
  Keyframes keyframes;
  keyframes.see({0, 1, 0}, 10);
  const Vec3 nan = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
  keyframes.turn.note({true, nan, Vec3::Constant(1e-5), {}}, keyframes.turn.turn());
  EXPECT_NEAR(undone_px(keyframes.turn).y(), 1.0, 0.05);
}

}  // namespace
}  // namespace sovo
