#pragma once
// Places that two pictures of a recording both show. Corners of the first picture (FAST) are
// searched for in the second by patch alignment, around the places that the orientations of both
// give. The corners are chosen anew: they are not the landmarks that OE mode used. The pictures lie
// at least kReturnGapLeast_s apart, so that neighbours do not count as returns. Pixels as in
// CONVENTIONS.md. Pure; allocates.

#include <vector>

#include "core/model/linear_algebra.h"
#include "edge_app/verify/seen_frame.h"

namespace alidade {

struct PlaceMatch {
  Vector2<double> first;       // px, where it is in the first picture
  Vector2<double> second;      // px, where it was found in the second
  Matrix2<double> covariance;  // px^2, of `second`, by noise of both pictures
};

struct PlacePair {
  std::size_t first = 0;  // index of the frame
  std::size_t second = 0;
  std::vector<PlaceMatch> places;
};

// frames: by time. For each frame at most 8 partners are chosen, at all distances in time. In each
// pair at most 24 places are looked for. A pair with fewer than six places that agree is left out.
[[nodiscard]] std::vector<PlacePair> match_places(const std::vector<SeenFrame>& frames);

}  // namespace alidade
