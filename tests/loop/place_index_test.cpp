#include "sovo/loop/place_index.h"

#include <gtest/gtest.h>

#include "place/place_test_support.h"

namespace sovo {
namespace {

std::vector<Landmark> random_landmarks(int number, std::mt19937& random) {
  std::vector<Landmark> landmarks(static_cast<std::size_t>(number));
  for (Landmark& l : landmarks) l.keypoint.descriptor = test::random_descriptor(random);
  return landmarks;
}

std::vector<Landmark> seen_again(std::vector<Landmark> landmarks, int bits, std::mt19937& random) {
  for (Landmark& l : landmarks) {
    l.keypoint.descriptor = test::disturbed(l.keypoint.descriptor, bits, random);
  }
  return landmarks;
}

class PlaceIndexOfHundred : public ::testing::Test {
 protected:
  PlaceIndexOfHundred() : random_(1) {
    for (std::uint32_t i = 0; i < 100; ++i) {
      places_.push_back(random_landmarks(200, random_));
      index_.add(i, places_.back());
    }
  }
  std::mt19937 random_;
  std::vector<std::vector<Landmark>> places_;
  PlaceIndex index_;
};

TEST_F(PlaceIndexOfHundred, NamesThePlaceThatIsSeenAgain) {
  for (const std::uint32_t place : {0U, 42U, 99U}) {
    const auto votes = index_.find(seen_again(places_[place], 25, random_), 100, 10, 3, 5);
    ASSERT_FALSE(votes.empty());
    EXPECT_EQ(votes.front().place, place);
    EXPECT_GT(votes.front().votes, 60);
  }
}

TEST_F(PlaceIndexOfHundred, NamesNoneForAPlaceThatIsNew) {
  EXPECT_TRUE(index_.find(random_landmarks(200, random_), 100, 10, 3, 5).empty());
}

TEST_F(PlaceIndexOfHundred, NamesNoneFromTheEndOn) {
  EXPECT_TRUE(index_.find(places_[42], 42, 10, 3, 5).empty());
  EXPECT_FALSE(index_.find(places_[42], 43, 10, 3, 5).empty());
}

TEST_F(PlaceIndexOfHundred, OfNeighboursOnlyTheBest) {
  // Of what is seen now, place 60 has all, 62 and 90 have half.
  const auto now = places_[60];
  std::vector<Landmark> half(now.begin(), now.begin() + 100);
  index_.add(100, half);
  index_.add(102, now);
  index_.add(200, half);
  const auto votes = index_.find(now, 300, 10, 5, 5);
  ASSERT_EQ(votes.size(), 3U);
  EXPECT_EQ(votes[0].place, 60U);
  EXPECT_EQ(votes[1].place, 102U);
  EXPECT_EQ(votes[2].place, 200U);
  EXPECT_EQ(index_.find(now, 300, 10, 2, 5).size(), 2U);
}

TEST_F(PlaceIndexOfHundred, ForgetsTheOldest) {
  index_.forget_before(50);
  EXPECT_TRUE(index_.find(places_[49], 100, 10, 3, 5).empty());
  for (const std::uint32_t place : {50U, 99U}) {
    const auto votes = index_.find(places_[place], 100, 10, 3, 5);
    ASSERT_FALSE(votes.empty());
    EXPECT_EQ(votes.front().place, place);
  }
  const auto later = random_landmarks(200, random_);
  index_.add(100, later);
  EXPECT_EQ(index_.find(later, 101, 10, 3, 5).front().place, 100U);
  EXPECT_TRUE(index_.find(places_[99], 50, 10, 3, 5).empty());  // all before 50 are forgotten
}

}  // namespace
}  // namespace sovo
