#pragma once
// make_scene_map(): turns an adjustment into a scene map: keyframes, and landmarks with
// covariances. A landmark is a track with two or more observations that the adjustment kept, or a
// single feature that is in no track, or that the adjustment left out of its track. A landmark's
// own covariance comes from its observations, in tangent_basis(d_b). Its common covariance comes
// from pose and f of the keyframe in which its direction is known best. A landmark that is_valid()
// refuses is left out. Base frame, rad and px. Batch work: allocates.

#include <optional>
#include <vector>

#include "core/mapping/feature_tracks.h"
#include "core/mapping/map_building.h"
#include "core/mapping/place_noise.h"

namespace alidade {

// Borrowed for the call. Pictures are indexed as in `found`. The observations of `evidence` are the
// features of the tracks, track by track.
struct MapMaterial {
  const MapBuildOptions& options;
  const MapAdjustment& found;
  const MapEvidence& evidence;
  const std::vector<std::vector<PictureFeature>>& tracks;
  const PlaceNoise& noise;
  std::vector<const MapView*> views;
  std::vector<const LinkedPicture*> pictures;
};

// Norm of each observation's residual, px; empty if the observation was left out or has no pixel.
[[nodiscard]] std::vector<std::optional<double>> errors_px(const MapEvidence& evidence,
                                                           const MapAdjustment& found);

// Sets out->map, the counts of its tracks and observations, and its residuals.
void make_scene_map(const MapMaterial& material, MapBuild* out);

}  // namespace alidade
