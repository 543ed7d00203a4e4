#pragma once
// Tracks: which features of many pictures are one thing, from matches of twos of pictures. The surest matches go first, and none
// joins two features of one picture: the same cannot be at two places. Pure.

#include <vector>

namespace alidade {

struct PictureFeature {
  int picture = 0;
  int feature = 0;
};

struct TrackMatch {
  PictureFeature a, b;
  double doubt = 0;  // the smaller the surer
};

// Of two features or more, each in increasing order of pictures; features: how many each picture has. What is outside is left out.
[[nodiscard]] std::vector<std::vector<PictureFeature>> feature_tracks(
    const std::vector<int>& features, std::vector<TrackMatch> matches);

}  // namespace alidade
