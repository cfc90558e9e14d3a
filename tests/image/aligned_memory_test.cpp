#include "sovo/image/aligned_memory.h"

#include <gtest/gtest.h>

#include <cstdint>

#include "sovo/image/image.h"

namespace sovo {
namespace {

std::uintptr_t place(const void* p) { return reinterpret_cast<std::uintptr_t>(p); }

TEST(AlignedMemory, TakesHugePagesWhereTheyAreMostlyFull) {
  constexpr std::size_t kPage = AlignedMemory::kHugePage;
  EXPECT_FALSE(AlignedMemory::takes_huge_pages(0));
  EXPECT_FALSE(AlignedMemory::takes_huge_pages(kPage / 2));
  EXPECT_TRUE(AlignedMemory::takes_huge_pages(752 * 480 * sizeof(float)));
  EXPECT_TRUE(AlignedMemory::takes_huge_pages(kPage));
  EXPECT_FALSE(AlignedMemory::takes_huge_pages(kPage + kPage / 4));
  EXPECT_TRUE(AlignedMemory::takes_huge_pages(1392 * 512 * sizeof(float)));
  EXPECT_FALSE(AlignedMemory::takes_huge_pages(SIZE_MAX)) << "rounding up would overflow";
}

TEST(AlignedMemory, IsAlignedAndWholeWhateverItsSize) {
  for (const std::size_t size : {1UL, 1000UL, 752UL * 480UL, 1UL << 19U, 1392UL * 512UL}) {
    AlignedVector<float> memory(size, 1.0F);
    EXPECT_EQ(place(memory.data()) % AlignedMemory::kLine, 0U);
    if (AlignedMemory::takes_huge_pages(size * sizeof(float))) {
      EXPECT_EQ(place(memory.data()) % AlignedMemory::kHugePage, 0U) << size;
    }
    memory.resize(3 * size, 2.0F);  // moves from one kind to another
    EXPECT_EQ(memory.front() + memory[size - 1] + memory[size] + memory.back(), 6.0F);
  }
}

}  // namespace
}  // namespace sovo
