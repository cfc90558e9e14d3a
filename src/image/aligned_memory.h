#pragma once

#include <cstddef>
#include <new>
#include <vector>

#if defined(__linux__)
#include <sys/mman.h>
#endif

namespace sovo {

/// Memory aligned to a cache line, which is the widest vector register too. Where that adds at most
/// half, it is whole huge pages: an image has some hundred small ones, each of which costs
/// microseconds when it is touched first, and a place in the TLB whenever a pattern's rows are
/// sampled.
struct AlignedMemory {
  static constexpr std::size_t kLine = 64;
  static constexpr std::size_t kHugePage = std::size_t{1} << 21;

  /// Throws std::bad_alloc where there is none.
  static void* allocate(std::size_t bytes) {
    if (!takes_huge_pages(bytes)) return ::operator new(bytes, std::align_val_t(kLine));
    const std::size_t rounded = huge_pages(bytes) * kHugePage;
    void* memory = ::operator new(rounded, std::align_val_t(kHugePage));
#if defined(__linux__)
    // A system without them has small ones there.
    (void)::madvise(memory, rounded, MADV_HUGEPAGE);
#endif
    return memory;
  }
  /// `bytes` as it was asked for.
  static void free(void* memory, std::size_t bytes) {
    ::operator delete(memory, std::align_val_t(takes_huge_pages(bytes) ? kHugePage : kLine));
  }
  /// How many hold so much.
  static constexpr std::size_t huge_pages(std::size_t bytes) {
    return (bytes + kHugePage - 1) / kHugePage;
  }
  /// Whether rounding up to them adds at most half.
  static constexpr bool takes_huge_pages(std::size_t bytes) {
    constexpr std::size_t kMost = std::size_t{1} << 30;  // beyond it rounding up is no gain
    return bytes > 0 && bytes <= kMost && 2 * huge_pages(bytes) * kHugePage <= 3 * bytes;
  }
};

/// Allocator of such memory.
template <class T>
struct AlignedAllocator {
  using value_type = T;

  AlignedAllocator() = default;
  template <class U>
  explicit AlignedAllocator(const AlignedAllocator<U>& /*other*/) {}

  T* allocate(std::size_t n) { return static_cast<T*>(AlignedMemory::allocate(n * sizeof(T))); }
  void deallocate(T* p, std::size_t n) { AlignedMemory::free(p, n * sizeof(T)); }
  bool operator==(const AlignedAllocator& /*other*/) const { return true; }
};

template <class T>
using AlignedVector = std::vector<T, AlignedAllocator<T>>;

}  // namespace sovo
