#include "core/mapping/feature_tracks.h"

#include <gtest/gtest.h>

namespace alidade::test {
namespace {

std::vector<std::vector<std::pair<int, int>>> plain(
    const std::vector<std::vector<PictureFeature>>& tracks) {
  std::vector<std::vector<std::pair<int, int>>> out;
  for (const auto& track : tracks) {
    out.emplace_back();
    for (const PictureFeature& f : track) out.back().emplace_back(f.picture, f.feature);
  }
  return out;
}

using Tracks = std::vector<std::vector<std::pair<int, int>>>;

TEST(FeatureTracks, GoOnFromPictureToPicture) {
  const auto tracks = feature_tracks({3, 3, 3}, {{{1, 2}, {2, 0}, 0.5}, {{0, 1}, {1, 2}, 0.6}});
  EXPECT_EQ(plain(tracks), (Tracks{{{0, 1}, {1, 2}, {2, 0}}}));
}

TEST(FeatureTracks, NeverHoldTwoFeaturesOfOnePicture) {
  // Picture 2's features 0 and 1 both claim what picture 0 saw; the surer has it.
  const auto tracks = feature_tracks(
      {1, 1, 2}, {{{0, 0}, {1, 0}, 0.1}, {{1, 0}, {2, 0}, 0.7}, {{0, 0}, {2, 1}, 0.3}});
  EXPECT_EQ(plain(tracks), (Tracks{{{0, 0}, {1, 0}, {2, 1}}}));
}

TEST(FeatureTracks, LeaveOutWhatIsOutside) {
  EXPECT_TRUE(
      feature_tracks({1, 1}, {{{0, 1}, {1, 0}, 0}, {{-1, 0}, {1, 0}, 0}, {{0, 0}, {2, 0}, 0}})
          .empty());
  EXPECT_TRUE(feature_tracks({}, {}).empty());
}

}  // namespace
}  // namespace alidade::test
