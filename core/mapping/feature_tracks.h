#pragma once
// Tracks: features of many pictures that show one thing, from matches between pairs of pictures.
// The surest matches are joined first. A match that would join two features of one picture is
// ignored, as one thing is not at two places. Pure; allocates.

#include <vector>

namespace alidade {

struct PictureFeature {
  int picture = 0;  // index
  int feature = 0;  // index within the picture
};

struct TrackMatch {
  PictureFeature a, b;
  double doubt = 0;  // smaller is surer
};

// Tracks of two features or more; the features of a track are in increasing order of pictures.
// features: the number of features in each picture; matches with other indices are ignored.
[[nodiscard]] std::vector<std::vector<PictureFeature>> feature_tracks(
    const std::vector<int>& features, std::vector<TrackMatch> matches);

}  // namespace alidade
