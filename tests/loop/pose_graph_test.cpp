#include "sovo/loop/pose_graph.h"

#include <gtest/gtest.h>

#include "place/place_test_support.h"

namespace sovo {
namespace {

Vec6 random_vector(double sigma, std::mt19937& random) {
  Vec6 x;
  for (int i = 0; i < 6; ++i) x[i] = sigma * test::normal(random);
  return x;
}

TEST(PoseGraph, JacobianIsThatOfCentralDifferences) {
  std::mt19937 random(2);
  for (int trial = 0; trial < 5; ++trial) {
    const SE3 T_w_i = SE3::exp(random_vector(1.0, random));
    const SE3 T_w_j = SE3::exp(random_vector(1.0, random));
    GraphEdge edge;
    // The error is large: half a radian.
    edge.T_i_j = SE3::exp(random_vector(0.3, random)) * (T_w_i.inverse() * T_w_j);
    const Mat6 J = edge_jacobian(edge, T_w_i, T_w_j);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      Vec6 x = Vec6::Zero();
      x[k] = kStep;
      const Vec6 by_i = (edge_error(edge, SE3::exp(x) * T_w_i, T_w_j) -
                         edge_error(edge, SE3::exp(-x) * T_w_i, T_w_j)) /
                        (2.0 * kStep);
      const Vec6 by_j = (edge_error(edge, T_w_i, SE3::exp(x) * T_w_j) -
                         edge_error(edge, T_w_i, SE3::exp(-x) * T_w_j)) /
                        (2.0 * kStep);
      EXPECT_LT((by_i - J.col(k)).norm(), 1e-7 * (1.0 + J.col(k).norm()));
      EXPECT_LT((by_j + J.col(k)).norm(), 1e-7 * (1.0 + J.col(k).norm()));
    }
  }
}

/// A walk along a circle, with steps that err as they say, and its end tied to its beginning.
struct Walk {
  std::vector<SE3> truth;
  std::vector<SE3> walked;
  std::vector<GraphEdge> edges;

  explicit Walk(unsigned seed) {
    constexpr int kSteps = 60;
    constexpr double kMetres = 0.02;
    constexpr double kRadians = 0.01;
    std::mt19937 random(seed);
    Vec6 sigma;
    sigma << Vec3::Constant(kMetres), Vec3::Constant(kRadians);
    for (int i = 0; i <= kSteps; ++i) {
      const double angle = 2.0 * M_PI * i / kSteps;
      truth.emplace_back(SO3::exp(Vec3(0.0, 0.0, angle)),
                         Vec3(5.0 * std::sin(angle), 5.0 * (1.0 - std::cos(angle)), 0.0));
    }
    walked.push_back(truth.front());
    for (std::size_t i = 0; i + 1 < truth.size(); ++i) {
      GraphEdge edge;
      edge.i = i;
      edge.j = i + 1;
      const Vec6 noise = sigma.cwiseProduct(random_vector(1.0, random));
      edge.T_i_j = SE3::exp(noise) * (truth[i].inverse() * truth[i + 1]);
      edge.information = sigma.cwiseProduct(sigma).cwiseInverse().asDiagonal();
      edges.push_back(edge);
      walked.push_back(walked.back() * edge.T_i_j);
    }
  }

  GraphEdge loop(std::size_t i, std::size_t j) const {
    return {i, j, truth[i].inverse() * truth[j], 1e6 * Mat6::Identity(), true};
  }

  static double rms(const std::vector<SE3>& poses, const std::vector<SE3>& truth) {
    double sum = 0.0;
    for (std::size_t i = 0; i < poses.size(); ++i) {
      sum += (poses[i].translation() - truth[i].translation()).squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(poses.size()));
  }
};

TEST(PoseGraph, ALoopTakesMostOfTheDriftAway) {
  double before = 0.0;
  double after = 0.0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    Walk walk(seed);
    std::vector<SE3> poses = walk.walked;
    walk.edges.push_back(walk.loop(0, 60));
    walk.edges.push_back(walk.loop(1, 59));
    const GraphResult result = optimize_graph(walk.edges, &poses);
    EXPECT_LT(result.iterations, 30);
    before += Walk::rms(walk.walked, walk.truth);
    after += Walk::rms(poses, walk.truth);
    EXPECT_LT((poses.back().translation() - walk.truth.back().translation()).norm(), 0.01);
    EXPECT_EQ(poses.front().matrix(), walk.walked.front().matrix());
  }
  EXPECT_LT(after, 0.4 * before);
}

TEST(PoseGraph, WithoutALoopNothingMoves) {
  const Walk walk(3);
  std::vector<SE3> poses = walk.walked;
  const GraphResult result = optimize_graph(walk.edges, &poses);
  EXPECT_LT(result.energy, 1e-12);
  EXPECT_LT(Walk::rms(poses, walk.walked), 1e-9);
}

TEST(PoseGraph, AWrongLoopBendsNothingMuch) {
  Walk walk(4);
  walk.edges.push_back(walk.loop(0, 60));
  std::vector<SE3> without = walk.walked;
  optimize_graph(walk.edges, &without);
  GraphEdge wrong = walk.loop(10, 40);
  wrong.T_i_j.translation() += Vec3(3.0, -2.0, 1.0);
  walk.edges.push_back(wrong);
  std::vector<SE3> robust = walk.walked;
  optimize_graph(walk.edges, &robust);
  EXPECT_LT(Walk::rms(robust, without), 0.02);
  walk.edges.back().may_be_wrong = false;
  std::vector<SE3> believed = walk.walked;
  optimize_graph(walk.edges, &believed);
  EXPECT_GT(Walk::rms(believed, without), 0.5);
}

TEST(PoseGraph, FindsTheWayFromFarOff) {
  // Every step is wrong by ten degrees before the loops are known.
  Walk walk(5);
  std::vector<SE3> poses{walk.truth.front()};
  for (std::size_t i = 0; i + 1 < walk.truth.size(); ++i) {
    poses.push_back(poses.back() * walk.edges[i].T_i_j *
                    SE3(SO3::exp(Vec3(0.0, 0.0, 0.17)), Vec3::Zero()));
  }
  walk.edges.push_back(walk.loop(0, 60));
  optimize_graph(walk.edges, &poses);
  EXPECT_LT(Walk::rms(poses, walk.truth), 0.3);
}

TEST(PoseGraph, OnePoseIsNoGraph) {
  std::vector<SE3> poses{SE3()};
  EXPECT_EQ(optimize_graph({}, &poses).iterations, 0);
}

}  // namespace
}  // namespace sovo
