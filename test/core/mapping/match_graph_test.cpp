#include "core/mapping/match_graph.h"

#include <gtest/gtest.h>

namespace alidade::test {
namespace {

using Groups = std::vector<std::vector<int>>;

// Both pictures see `count` landmarks from `first` on.
void share(int a, int b, int first, int count, std::vector<SeenIn>* seen) {
  for (int i = first; i < first + count; ++i) {
    seen->emplace_back(a, i);
    seen->emplace_back(b, i);
  }
}

TEST(MatchGraph, ChainsHangTogether) {
  std::vector<SeenIn> seen;
  share(3, 1, 0, 5, &seen);
  share(1, 4, 10, 5, &seen);
  share(0, 2, 20, 5, &seen);
  EXPECT_EQ(connected_pictures(6, seen, 5), (Groups{{1, 3, 4}, {0, 2}, {5}}));
}

TEST(MatchGraph, TooFewInCommonDoNotTie) {
  std::vector<SeenIn> seen;
  share(0, 1, 0, 4, &seen);
  EXPECT_EQ(connected_pictures(2, seen, 5), (Groups{{0}, {1}}));
  // The same landmark twice in one picture counts once.
  seen.insert(seen.end(), 3, SeenIn{0, 0});
  EXPECT_EQ(connected_pictures(2, seen, 5), (Groups{{0}, {1}}));
  share(0, 1, 4, 1, &seen);
  EXPECT_EQ(connected_pictures(2, seen, 5), (Groups{{0, 1}}));
}

// Landmarks in common with three, a few with each, tie to none.
TEST(MatchGraph, CountsPairByPair) {
  std::vector<SeenIn> seen;
  share(0, 1, 0, 3, &seen);
  share(0, 2, 3, 3, &seen);
  share(0, 3, 6, 3, &seen);
  EXPECT_EQ(connected_pictures(4, seen, 5).size(), 4U);
}

TEST(MatchGraph, PicturesThatDoNotExistAreLeftOut) {
  std::vector<SeenIn> seen;
  share(-1, 2, 0, 9, &seen);
  share(0, 1, 0, 9, &seen);
  EXPECT_EQ(connected_pictures(2, seen, 5), (Groups{{0, 1}}));
  EXPECT_TRUE(connected_pictures(0, seen, 5).empty());
}

}  // namespace
}  // namespace alidade::test
