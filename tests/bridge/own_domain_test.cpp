#include "own_domain.h"

#include <gtest/gtest.h>

#include <list>
#include <set>

namespace sovo::bridge {
namespace {

TEST(OwnDomain, IsNobodyElsesWhileItIsHeld) {
  std::list<OwnDomain> held;
  std::set<int> numbers;
  for (int i = 0; i < 40; ++i) {
    const int number = held.emplace_back().number();
    EXPECT_TRUE(numbers.insert(number).second) << number << " is taken twice";
    // Ports of domains above 101 lie where Linux takes ports for outgoing connections.
    EXPECT_TRUE(number >= 1 && number <= 101) << number;
  }
}

TEST(OwnDomain, IsFreeAgainWithItsHolderGone) {
  for (int i = 0; i < 300; ++i) EXPECT_NO_THROW(OwnDomain());
}

}  // namespace
}  // namespace sovo::bridge
