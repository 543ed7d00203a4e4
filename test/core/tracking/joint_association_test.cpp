#include "core/tracking/joint_association.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "core/tracking/target_filter.h"
#include "test/core/tracking/stone_soup_weights.h"

namespace alidade {
namespace {

// Every event, one by one: the definition.
void enumerate(const std::vector<std::vector<double>>& r, const std::vector<double>& m,
               std::size_t target, double weight, std::vector<int>* choice,
               std::vector<char>* taken, std::vector<std::vector<double>>* sums, double* total) {
  if (target == r.size()) {
    *total += weight;
    for (std::size_t t = 0; t < r.size(); ++t) {
      if ((*choice)[t] >= 0) (*sums)[t][static_cast<std::size_t>((*choice)[t])] += weight;
    }
    return;
  }
  (*choice)[target] = -1;
  enumerate(r, m, target + 1, weight * m[target], choice, taken, sums, total);
  for (std::size_t d = 0; d < r[target].size(); ++d) {
    if ((*taken)[d] || r[target][d] == 0) continue;
    (*taken)[d] = 1;
    (*choice)[target] = static_cast<int>(d);
    enumerate(r, m, target + 1, weight * r[target][d], choice, taken, sums, total);
    (*taken)[d] = 0;
  }
  (*choice)[target] = -1;
}

std::vector<std::vector<double>> by_enumeration(const std::vector<std::vector<double>>& r,
                                                const std::vector<double>& m) {
  std::vector<std::vector<double>> sums(r.size(), std::vector<double>(r[0].size(), 0.0));
  std::vector<int> choice(r.size(), -1);
  std::vector<char> taken(r[0].size(), 0);
  double total = 0;
  enumerate(r, m, 0, 1, &choice, &taken, &sums, &total);
  for (auto& row : sums) {
    for (double& weight : row) weight /= total;
  }
  return sums;
}

std::vector<GatedPair> pairs_of(const std::vector<std::vector<double>>& r) {
  std::vector<GatedPair> pairs;
  for (std::size_t t = 0; t < r.size(); ++t) {
    for (std::size_t d = 0; d < r[t].size(); ++d) {
      if (r[t][d] > 0) pairs.push_back({static_cast<int>(t), static_cast<int>(d), r[t][d], -1});
    }
  }
  return pairs;
}

std::vector<std::vector<double>> random_ratios(int targets, int detections, double gated,
                                               std::mt19937* random) {
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<std::vector<double>> r(static_cast<std::size_t>(targets));
  for (auto& row : r) {
    row.resize(static_cast<std::size_t>(detections));
    for (double& ratio : row) {
      ratio = unit(*random) < gated ? std::pow(10, 10 * unit(*random) - 4) : 0;
    }
  }
  return r;
}

void weigh(AssociationMethod method, const std::vector<std::vector<double>>& r,
           const std::vector<double>& m, JointAssociation* association,
           std::vector<GatedPair>* pairs) {
  *pairs = pairs_of(r);
  association->weigh(method, m.data(), static_cast<int>(r.size()), pairs->data(),
                     static_cast<int>(pairs->size()));
}

TEST(JointAssociation, ExactWeightsAreThoseOfAllEvents) {
  std::mt19937 random(1);
  JointAssociation association(12, 12);
  int compared = 0;
  for (int run = 0; run < 120; ++run) {
    const int targets = 1 + run % 6;
    const int detections = 1 + (run / 6) % 6;
    const auto r = random_ratios(targets, detections, run % 3 == 0 ? 1.0 : 0.5, &random);
    std::vector<double> m;
    for (int t = 0; t < targets; ++t) m.push_back(t % 2 == 0 ? 0.1 : 1.0);
    const auto expected = by_enumeration(r, m);
    std::vector<GatedPair> pairs;
    weigh(AssociationMethod::kExact, r, m, &association, &pairs);
    EXPECT_EQ(association.cheap_clusters(), 0);
    for (const GatedPair& pair : pairs) {
      EXPECT_NEAR(
          pair.weight,
          expected[static_cast<std::size_t>(pair.target)][static_cast<std::size_t>(pair.detection)],
          1e-12);
      ++compared;
    }
  }
  EXPECT_GT(compared, 700);
}

TEST(JointAssociation, WeightsAreStoneSoups) {
  JointAssociation association(5, 5);
  int compared = 0;
  for (const test::StoneSoupScene& scene : test::kStoneSoupScenes) {
    std::vector<GatedPair> pairs;
    const std::vector<double> missed(5, 1 - test::kSceneDetected * test::kSceneGate);
    for (int t = 0; t < scene.targets; ++t) {
      const auto& given = scene.target[static_cast<std::size_t>(t)];
      TargetState state;
      state.mean << given[0], given[1], given[2], given[3];
      state.cov.diagonal() << given[4], given[4], given[5], given[5];
      predict_target(TargetSpace::kPlane, test::kSceneDt, test::kSceneAcceleration, &state);
      const auto expected = expected_place(TargetSpace::kPlane, state, Matrix3<double>::Identity());
      ASSERT_TRUE(expected);
      for (int d = 0; d < scene.detections; ++d) {
        const auto& place = scene.detection[static_cast<std::size_t>(d)];
        const Innovation innovation = innovation_of(
            *expected, {{place[0], place[1]},
                        test::kSceneSigma * test::kSceneSigma * Matrix2<double>::Identity()});
        if (innovation.distance_squared > -2 * std::log(1 - test::kSceneGate)) continue;
        pairs.push_back({t, d, test::kSceneDetected * innovation.density / test::kSceneClutter, 0});
      }
    }
    association.weigh(AssociationMethod::kExact, missed.data(), scene.targets, pairs.data(),
                      static_cast<int>(pairs.size()));
    auto weight = scene.weight;
    for (const GatedPair& pair : pairs) {
      double& theirs =
          weight[static_cast<std::size_t>(pair.target)][static_cast<std::size_t>(pair.detection)];
      EXPECT_NEAR(pair.weight, theirs, 1e-9);
      theirs = 0;
      ++compared;
    }
    for (const auto& row : weight) {
      for (const double left : row) EXPECT_EQ(left, 0) << "theirs is in a gate, ours is not";
    }
  }
  EXPECT_GT(compared, 80);
}

TEST(JointAssociation, CheapWeightsOfOneTargetAreThoseOfPda) {
  std::mt19937 random(2);
  JointAssociation association(1, 8);
  for (int run = 0; run < 20; ++run) {
    const auto r = random_ratios(1, 8, 0.7, &random);
    const auto expected = by_enumeration(r, {0.1});
    std::vector<GatedPair> pairs;
    weigh(AssociationMethod::kCheap, r, {0.1}, &association, &pairs);
    for (const GatedPair& pair : pairs) {
      EXPECT_NEAR(pair.weight, expected[0][static_cast<std::size_t>(pair.detection)], 1e-12);
    }
  }
}

// By hand: r = [[4, 2], [1, 3]], m = 0.5.
TEST(JointAssociation, CheapWeightsAreFitzgeralds) {
  JointAssociation association(2, 2);
  std::vector<GatedPair> pairs;
  weigh(AssociationMethod::kCheap, {{4, 2}, {1, 3}}, {0.5, 0.5}, &association, &pairs);
  ASSERT_EQ(pairs.size(), 4U);
  EXPECT_NEAR(pairs[0].weight, 4 / (6 + 1 + 0.5), 1e-15);
  EXPECT_NEAR(pairs[1].weight, 2 / (6 + 3 + 0.5), 1e-15);
  EXPECT_NEAR(pairs[2].weight, 1 / (4 + 4 + 0.5), 1e-15);
  EXPECT_NEAR(pairs[3].weight, 3 / (4 + 2 + 0.5), 1e-15);
}

TEST(JointAssociation, LargeClustersAreWeighedCheaplyAndSmallOnesBesideThemExactly) {
  std::mt19937 random(3);
  auto r = random_ratios(9, 9, 0, &random);
  const auto large = random_ratios(7, 7, 1, &random);
  for (std::size_t t = 0; t < 7; ++t) std::copy(large[t].begin(), large[t].end(), r[t].begin());
  r[7][7] = 5;
  r[8][7] = 2;
  r[8][8] = 3;
  const std::vector<double> m(9, 0.2);
  JointAssociation association(9, 9);
  std::vector<GatedPair> mixed;
  weigh(AssociationMethod::kExact, r, m, &association, &mixed);
  EXPECT_EQ(association.cheap_clusters(), 1);
  EXPECT_EQ(association.exact_clusters(), 1);
  std::vector<GatedPair> cheap;
  weigh(AssociationMethod::kCheap, r, m, &association, &cheap);
  const auto small = by_enumeration({{5, 0}, {2, 3}}, {0.2, 0.2});
  for (std::size_t i = 0; i < 49; ++i) EXPECT_EQ(mixed[i].weight, cheap[i].weight);
  EXPECT_NEAR(mixed[49].weight, small[0][0], 1e-14);
  EXPECT_NEAR(mixed[50].weight, small[1][0], 1e-14);
  EXPECT_NEAR(mixed[51].weight, small[1][1], 1e-14);
}

TEST(JointAssociation, WeightsOfATargetAndExactOnesOfADetectionNeverExceedOne) {
  std::mt19937 random(4);
  JointAssociation association(10, 10);
  for (const AssociationMethod method : {AssociationMethod::kExact, AssociationMethod::kCheap}) {
    for (int run = 0; run < 50; ++run) {
      std::vector<GatedPair> pairs;
      weigh(method, random_ratios(10, 10, 0.2, &random), std::vector<double>(10, 0.01),
            &association, &pairs);
      std::vector<double> of_target(10, 0.0);
      for (const GatedPair& pair : pairs) {
        EXPECT_GE(pair.weight, 0);
        of_target[static_cast<std::size_t>(pair.target)] += pair.weight;
      }
      for (const double sum : of_target) EXPECT_LE(sum, 1 + 1e-12);
    }
  }
}

TEST(JointAssociation, NearestGivesEachDetectionToOneTargetBestFirst) {
  JointAssociation association(3, 3);
  std::vector<GatedPair> pairs;
  weigh(AssociationMethod::kNearest, {{5, 4, 0}, {9, 3, 0}, {0, 2, 0}}, {0.1, 0.1, 0.1},
        &association, &pairs);
  ASSERT_EQ(pairs.size(), 5U);
  const double expected[] = {0, 1, 1, 0, 0};
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(pairs[i].weight, expected[i]) << i;
}

}  // namespace
}  // namespace alidade
