#include "core/mapping/feature_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

namespace alidade::test {
namespace {

// As far apart as descriptors of different things are.
std::vector<Descriptor> random_descriptors(int count, unsigned seed) {
  std::mt19937_64 random(seed);
  std::exponential_distribution<double> value(1.0 / 35);
  std::vector<Descriptor> out(static_cast<std::size_t>(count));
  for (Descriptor& descriptor : out) {
    for (std::uint8_t& entry : descriptor) {
      entry = static_cast<std::uint8_t>(std::min(255.0, value(random)));
    }
  }
  return out;
}

std::vector<Descriptor> noisy(std::vector<Descriptor> descriptors, double sigma, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, sigma);
  for (Descriptor& descriptor : descriptors) {
    for (std::uint8_t& entry : descriptor) {
      entry = static_cast<std::uint8_t>(std::clamp(entry + noise(random), 0.0, 255.0));
    }
  }
  return descriptors;
}

TEST(FeatureMatching, FindsWhatIsTheSameButForNoise) {
  const std::vector<Descriptor> indexed = random_descriptors(1500, 1);
  std::vector<Descriptor> queries = noisy(indexed, 6, 2);
  std::reverse(queries.begin(), queries.end());
  const std::vector<FeatureMatch> matches = FeatureIndex(indexed).match(queries);
  int right = 0;
  for (const FeatureMatch& match : matches) right += match.query + match.indexed == 1499 ? 1 : 0;
  EXPECT_GE(right, 1350);
  EXPECT_LE(static_cast<int>(matches.size()) - right, 5);
}

TEST(FeatureMatching, BelievesNothingOfWhatIsThereTwice) {
  const std::vector<Descriptor> things = random_descriptors(300, 3);
  std::vector<Descriptor> indexed = noisy(things, 6, 11);
  const std::vector<Descriptor> again = noisy(things, 6, 4);
  indexed.insert(indexed.end(), again.begin(), again.end());
  const std::vector<Descriptor> queries = noisy(things, 6, 5);
  EXPECT_LE(FeatureIndex(indexed).match(queries).size(), 15U);
}

TEST(FeatureMatching, GivesEachIndexedFeatureToOneQuery) {
  const std::vector<Descriptor> indexed = random_descriptors(200, 6);
  std::vector<Descriptor> queries = noisy(indexed, 12, 7);
  const std::vector<Descriptor> nearer = noisy(indexed, 3, 8);
  queries.insert(queries.end(), nearer.begin(), nearer.end());
  std::set<int> taken;
  int of_nearer = 0;
  for (const FeatureMatch& match : FeatureIndex(indexed).match(queries)) {
    EXPECT_TRUE(taken.insert(match.indexed).second);
    of_nearer += match.query >= 200 ? 1 : 0;
  }
  EXPECT_GE(of_nearer, 190);
}

TEST(FeatureMatching, IsTheSameEachTime) {
  const std::vector<Descriptor> indexed = random_descriptors(500, 9);
  const std::vector<Descriptor> queries = noisy(indexed, 25, 10);
  const auto pairs = [&] {
    std::vector<std::pair<int, int>> out;
    for (const FeatureMatch& match : FeatureIndex(indexed).match(queries)) {
      out.emplace_back(match.query, match.indexed);
    }
    return out;
  };
  const auto first = pairs();
  ASSERT_FALSE(first.empty());
  EXPECT_EQ(first, pairs());
}

TEST(NearestFeatures, AreThoseOfAll) {
  const std::vector<Descriptor> indexed = random_descriptors(50, 12);
  const std::vector<Descriptor> queries = random_descriptors(7, 13);
  const auto near = nearest_features(queries, indexed);
  ASSERT_EQ(near.size(), queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    std::vector<std::pair<float, int>> all;
    for (std::size_t j = 0; j < indexed.size(); ++j) {
      float square = 0;
      for (std::size_t n = 0; n < queries[i].size(); ++n) {
        const float off = static_cast<float>(queries[i][n]) - static_cast<float>(indexed[j][n]);
        square += off * off;
      }
      all.emplace_back(square, static_cast<int>(j));
    }
    std::sort(all.begin(), all.end());
    for (std::size_t k = 0; k < kNearFeatures; ++k) {
      EXPECT_EQ(near[i][k].indexed, all[k].second);
      EXPECT_EQ(near[i][k].square, all[k].first);
    }
  }
}

TEST(NearestFeatures, OfFewAreFew) {
  const auto near = nearest_features(random_descriptors(1, 1), random_descriptors(2, 2));
  EXPECT_GE(near[0][1].indexed, 0);
  EXPECT_EQ(near[0][2].indexed, -1);
  EXPECT_TRUE(believed_matches({NearFeatures{}}, 0.8).empty());
}

TEST(BelievedMatches, TakeNoRivalForWhatIsTheSameThing) {
  NearFeatures near;
  near[0] = {3, 100};
  near[1] = {5, 110};
  near[2] = {7, 900};
  EXPECT_TRUE(believed_matches({near}, 0.8).empty());
  const auto is_same = [](int a, int b) { return a + b == 8; };
  const auto matches = believed_matches({near}, 0.8, is_same);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].indexed, 3);
  EXPECT_NEAR(matches[0].ratio, 1.0 / 3, 1e-12);
}

TEST(FeatureMatching, OfNothingOrOneThereAreNone) {
  EXPECT_TRUE(FeatureIndex({}).match(random_descriptors(5, 1)).empty());
  EXPECT_TRUE(FeatureIndex(random_descriptors(1, 1)).match(random_descriptors(1, 1)).empty());
  EXPECT_TRUE(FeatureIndex(random_descriptors(50, 1)).match({}).empty());
}

}  // namespace
}  // namespace alidade::test
