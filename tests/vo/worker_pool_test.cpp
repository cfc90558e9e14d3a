#include "sovo/vo/worker_pool.h"

#include <gtest/gtest.h>

#include <numeric>
#include <thread>

namespace sovo {
namespace {

class Pool : public ::testing::TestWithParam<int> {};

TEST_P(Pool, RunsEachIndexOnceAndReturnsWhenAllAreDone) {
  WorkerPool pool(GetParam());
  EXPECT_EQ(pool.threads(), GetParam());
  for (int round = 0; round < 200; ++round) {
    const int n = round % 23;
    std::vector<int> calls(static_cast<std::size_t>(n), 0);
    pool.run(n, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
    EXPECT_EQ(std::accumulate(calls.begin(), calls.end(), 0), n);
    for (const int c : calls) EXPECT_EQ(c, 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Threads, Pool, ::testing::Values(1, 2, 4));

TEST(WorkerPool, AsksForAtLeastOneThread) {
  WorkerPool pool(0);
  EXPECT_EQ(pool.threads(), 1);
  int sum = 0;
  pool.run(4, [&](int i) { sum += i; });
  EXPECT_EQ(sum, 6);
}

TEST(WorkerPool, ResultsOfOneLoopAreSeenByTheNext) {
  WorkerPool pool(3);
  std::vector<int> a(1000, 0);
  std::vector<int> neighbour(1000, 0);
  for (int round = 1; round <= 50; ++round) {
    pool.run(1000, [&](int i) { ++a[static_cast<std::size_t>(i)]; });
    pool.run(1000, [&](int i) {
      neighbour[static_cast<std::size_t>(i)] = a[static_cast<std::size_t>((i + 1) % 1000)];
    });
    EXPECT_EQ(neighbour, std::vector<int>(1000, round));
  }
}

TEST(WorkerPool, TwoCallersAtOnceEachGetTheirOwnLoop) {
  // Tracking and mapping are threads of their own, and share the pool.
  WorkerPool pool(3);
  const auto many_loops = [&](int size, int* wrong) {
    for (int round = 0; round < 300; ++round) {
      std::vector<int> calls(static_cast<std::size_t>(size), 0);
      pool.run(size, [&](int i) { ++calls[static_cast<std::size_t>(i)]; });
      *wrong += calls == std::vector<int>(static_cast<std::size_t>(size), 1) ? 0 : 1;
    }
  };
  int wrong_here = 0;
  int wrong_there = 0;
  std::thread other([&] { many_loops(37, &wrong_there); });
  many_loops(23, &wrong_here);
  other.join();
  EXPECT_EQ(wrong_here, 0);
  EXPECT_EQ(wrong_there, 0);
}

TEST(WorkerPool, EndsWithoutEverHavingRun) { const WorkerPool pool(4); }

}  // namespace
}  // namespace sovo
