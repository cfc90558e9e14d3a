#include "sovo/bridge/dashboard/client_queue.h"

#include <gtest/gtest.h>

namespace sovo::bridge {
namespace {

QueuedMessage message(std::uint32_t subscription, Importance importance, std::size_t bytes = 936) {
  return {subscription, 0, importance, std::make_shared<std::vector<std::uint8_t>>(bytes)};
}

TEST(ClientQueue, GivesMessagesInOrder) {
  ClientQueue queue(1 << 20);
  queue.push(message(1, Importance::kPose));
  queue.push(message(2, Importance::kImage));
  queue.push(message(3, Importance::kState));
  EXPECT_EQ(queue.pop()->subscription, 1U);
  EXPECT_EQ(queue.pop()->subscription, 2U);
  EXPECT_EQ(queue.pop()->subscription, 3U);
  EXPECT_FALSE(queue.pop());
  EXPECT_EQ(queue.bytes(), 0U);
  EXPECT_FALSE(queue.has_missed());
}

TEST(ClientQueue, DropsImagesFirstAndPosesLast) {
  ClientQueue queue(4000);  // four messages of 1000 bytes
  queue.push(message(1, Importance::kPose));
  queue.push(message(2, Importance::kImage));
  queue.push(message(3, Importance::kCloud));
  queue.push(message(4, Importance::kState));
  for (int i = 0; i < 3; ++i) queue.push(message(1, Importance::kPose));
  const auto missed = queue.take_missed();
  EXPECT_EQ(missed, (std::map<std::uint32_t, std::uint64_t>{{2, 1}, {3, 1}, {4, 1}}));
  EXPECT_EQ(queue.size(), 4U);
  queue.push(message(1, Importance::kPose));  // now the oldest pose goes
  EXPECT_EQ(queue.take_missed(), (std::map<std::uint32_t, std::uint64_t>{{1, 1}}));
  queue.push(message(2, Importance::kImage));  // and an image is not kept at its price
  EXPECT_EQ(queue.take_missed(), (std::map<std::uint32_t, std::uint64_t>{{2, 1}}));
  while (const auto m = queue.pop()) EXPECT_EQ(m->subscription, 1U);
}

TEST(ClientQueue, KeepsTheNewestTwoImagesOfACamera) {
  ClientQueue queue(1 << 20);
  for (std::int64_t i = 0; i < 5; ++i) {
    auto image = message(7, Importance::kImage);
    image.stamp_ns = i;
    queue.push(std::move(image));
  }
  EXPECT_EQ(queue.pop()->stamp_ns, 3);
  EXPECT_EQ(queue.pop()->stamp_ns, 4);
  EXPECT_EQ(queue.take_missed().at(7), 3U);
}

TEST(ClientQueue, TakesNothingLargerThanItself) {
  ClientQueue queue(1000);
  queue.push(message(1, Importance::kPose, 5000));
  EXPECT_EQ(queue.size(), 0U);
  EXPECT_EQ(queue.take_missed().at(1), 1U);
}

TEST(ClientQueue, ForgetsASubscription) {
  ClientQueue queue(1 << 20);
  queue.push(message(1, Importance::kPose));
  queue.push(message(2, Importance::kPose));
  queue.remove(1);
  EXPECT_EQ(queue.size(), 1U);
  EXPECT_EQ(queue.pop()->subscription, 2U);
  EXPECT_EQ(queue.bytes(), 0U);
}

}  // namespace
}  // namespace sovo::bridge
