#pragma once
// OeOptions: everything that OE mode can be told, each estimator's in its own struct beside it.

#include "core/realtime/image/image_noise.h"
#include "core/realtime/oe_mode/base_tie.h"
#include "core/realtime/oe_mode/landmark_maker.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/lens_follower.h"
#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/map_shear.h"
#include "core/realtime/oe_mode/map_upkeep.h"
#include "core/realtime/oe_mode/motion_prediction.h"
#include "core/realtime/oe_mode/octaves.h"

namespace alidade {

// When landmarks are looked for, where, and what it means that none hold.
struct LookOptions {
  // px, at the image's centre: where coarse octaves fit nowhere, fine landmarks are worth a look only if the
  // prediction is that sure, one standard deviation.
  double nearby_px = 2;
  // Texture that repeats can hold the coarse octaves elsewhere: where a smaller share of the chosen landmarks than
  // this are inliers, 0 to 1, there is a second look, where the motion before leads to.
  double least_held = 0.6;
  // Inliers; fewer agree by chance too, and the second look is no better.
  int least_held_again = 40;
  // Chosen landmarks, and coarse ones in use: with fewer of both a view is new to the map. Also visible ones of any octave that are
  // left when a handed-over map is doubted.
  int few = 10;
  int few_coarse = 5;

  // False and one line in *error (if not null) when a value is not valid.
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
  MapOffsetOptions offset;
  BaseTieOptions tie;
  LensFollowerOptions lens;
  MapShearOptions shear;
  MapUpkeepOptions upkeep;
  LandmarkMakerOptions maker;

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

}  // namespace alidade
