#pragma once
// What an adjustment of pictures becomes as a scene map: its keyframes, and all that can be recognised later, with covariances.
//   landmark    a track of two observations or more that the adjustment kept, or a feature that one picture alone has seen
//   covariance  its own part from its observations, in tangent_basis(d_b); the shared one of the pose and the focal length of the
//               keyframe that knows its direction best
// Base frame, rad and px. Batch work: allocates.

#include <optional>
#include <vector>

#include "core/mapping/feature_tracks.h"
#include "core/mapping/map_building.h"
#include "core/mapping/place_noise.h"

namespace alidade {

// Pictures count as in found; observations of evidence are the features of tracks, one after another.
struct MapMaterial {
  const MapBuildOptions& options;
  const MapAdjustment& found;
  const MapEvidence& evidence;
  const std::vector<std::vector<PictureFeature>>& tracks;
  const PlaceNoise& noise;
  std::vector<const MapView*> views;
  std::vector<const LinkedPicture*> pictures;
};

// The norm of what is left of each observation, px; none: it was left out.
[[nodiscard]] std::vector<std::optional<double>> errors_px(const MapEvidence& evidence,
                                                           const MapAdjustment& found);

// Fills in the map, and how many tracks and observations it rests on.
void make_scene_map(const MapMaterial& material, MapBuild* out);

}  // namespace alidade
