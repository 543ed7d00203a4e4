#pragma once
// OeOptions: all options of OE mode. Each estimator's are in its own struct in its own header.

#include "core/realtime/image/image_noise.h"
#include "core/realtime/lens/lens_follower.h"
#include "core/realtime/oe_mode/base_tie.h"
#include "core/realtime/oe_mode/landmark_maker.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/map_shear.h"
#include "core/realtime/oe_mode/map_upkeep.h"
#include "core/realtime/oe_mode/motion_prediction.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/orientation_solve.h"

namespace alidade {

// When and where landmarks are looked for, and what it means if none hold.
struct LookOptions {
  // px, at the image's centre: largest sigma of a prediction at which fine landmarks are looked for
  // although the coarse octaves do not fit.
  double nearby_px = 2;
  // 0 to 1; share of the chosen landmarks. If fewer are inliers, there is a second look, where the
  // previous motion leads, as the coarse octaves can match a repeated texture elsewhere.
  double least_held = 0.6;
  // Inliers that a second look needs, as fewer can agree by chance.
  int least_held_again = 40;
  // Chosen landmarks, and coarse ones in use; a view with fewer of both is new to the map. few is
  // also the number of visible ones that must be left when a handed-over map is doubted.
  int few = 10;
  int few_coarse = 5;
  // Only with a learnt focal length:
  // Factor of the landmarks' covariances, > 1. Beyond it the lens may have moved unnoticed, though
  // all landmarks may still be inliers.
  double misfit = 6;
  // 0 to 1; if enough landmarks held before (least_held), a lens found by another look holds only
  // if its own factor of the covariances is less than this share of the factor before.
  double better = 0.5;
  // px, in the image's corners, > 0; a lens found farther from the expected one is looked through
  // again.
  double other_lens_px = 0.5;
  // px, in the image's corners, > 0; from there on a change of the map's lens is put into the
  // calibration. Below it the linear problem has it.
  double shown_lens_px = 0.1;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

struct OeOptions {
  int max_width = 1920;      // px
  int max_height = 1080;     // px
  int max_landmarks = 4096;  // in the map
  OctaveOptions octaves;
  RunningNoiseOptions noise;
  MotionPredictionOptions prediction;
  LandmarkSearchOptions search;
  LookOptions look;
  SolveLimits solve;
  MapOffsetOptions offset;
  BaseTieOptions tie;
  LensFollowerOptions lens;
  MapShearOptions shear;
  MapUpkeepOptions upkeep;
  LandmarkMakerOptions maker;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

}  // namespace alidade
