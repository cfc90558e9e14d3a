#include "sovo/image/pyramid_pool.h"

#include <gtest/gtest.h>

#include <memory>
#include <set>
#include <vector>

namespace sovo::test {

TEST(PyramidPool, GivesWhatNobodyHoldsAndGrowsOtherwise) {
  PyramidPool pool;
  auto first = pool.take();
  const ImagePyramid* const was = first.get();
  const auto second = pool.take();
  EXPECT_NE(second.get(), was);
  first.reset();
  EXPECT_EQ(pool.take().get(), was);
}

TEST(PyramidPool, WhatIsReservedHasItsMemoryAlready) {
  PyramidPool pool;
  pool.reserve(3, 200, 100, 2);
  std::vector<std::shared_ptr<ImagePyramid>> taken;
  std::set<const float*> memory;
  for (int i = 0; i < 3; ++i) {
    taken.push_back(pool.take());
    EXPECT_EQ(taken.back()->num_levels(), 2);
    EXPECT_EQ((*taken.back())[1].width(), 100);
    const float* const before = (*taken.back())[0].data();
    taken.back()->rebuild(2, [](ImageF* image) { image->resize(200, 100); });
    EXPECT_EQ((*taken.back())[0].data(), before);
    memory.insert(before);
  }
  EXPECT_EQ(memory.size(), 3U);
  EXPECT_EQ(pool.take()->num_levels(), 0) << "a fourth is made when it is needed";
}

}  // namespace sovo::test
