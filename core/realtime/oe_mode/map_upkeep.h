#pragma once
// MapUpkeep: what the frames say of the landmarks that are there: how good each is, which have to go, and
// whether the map fits at all (PTCEE 36). New ones are landmark_maker.h's.
//
// A landmark that held is refined (Kalman), on its own part of its covariance. One that is missed often, or
// rarely found, is retired. A map that is contradicted, or lost, for many frames in a row is of no use; one
// that was handed over and is not found in view is doubted sooner.
// No allocation. One thread.

#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/processed_frame.h"

namespace alidade {

struct MapUpkeepOptions {
  int max_misses = 15;         // in a row, that retire a landmark
  int probation = 20;          // times it was looked for, before it can be unreliable
  double least_matched = 0.3;  // share of these; with less it is
  double memory = 0.1;         // weight of the latest residual in a landmark's running mean square
  double alike = 0.6;          // correlation of a coarse landmark's patch that counts as found
  // Of a measurement's covariance, so much is left to be learnt always: textures alias, and the light changes.
  double least_covariance = 0.01;
  int contradictions_to_forget = 50;  // frames in a row, after which the map is of no use
  int lost_to_forget = 1000;          // frames in a row
  int missed_to_doubt = 50;           // frames in a row that lack landmarks they should show

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class MapUpkeep {
 public:
  // options: valid.
  explicit MapUpkeep(const MapUpkeepOptions& options) : options_(options) {}

  // For another map.
  void reset();

  // Each frame whose image was searched: landmarks held.
  void note_held() { reset(); }
  // ... or they did not: contradiction: they exclude telemetry; missed: they should have been in view.
  void note_lost(bool contradiction, bool missed);

  // Too many frames in a row say so.
  [[nodiscard]] bool is_useless() const {
    return contradictions_ > options_.contradictions_to_forget || lost_ > options_.lost_to_forget;
  }
  [[nodiscard]] bool is_doubtful() const { return missed_ > options_.missed_to_doubt; }

  // Fine landmarks of a frame that held: refined by what was found, or missed.
  void refine(const ProcessedFrame& frame, const LandmarkSearch& search, LandmarkMap* map) const;
  // Coarse ones: found where the frame's motion sees them, or missed.
  void judge_coarse(const Calibration& calibration, const Pyramid& pyramid,
                    const ProcessedFrame& frame, const LandmarkSearch& search,
                    LandmarkMap* map) const;
  // Landmarks that were never looked for in a frame that held, as they came with a map from elsewhere. Where
  // they should be in view and are not found they have gone, or were never there. What was found here once is
  // another matter: fog lifts.
  [[nodiscard]] bool has_unproven(const std::vector<VisibleLandmark>& visible,
                                  const LandmarkMap& map) const;
  // Returns how many went.
  int retire_unproven(const std::vector<VisibleLandmark>& visible, LandmarkMap* map) const;

 private:
  void mark(std::uint32_t frame, int slot, bool matched, double residual_square,
            LandmarkMap* map) const;

  MapUpkeepOptions options_;
  // Frames in a row.
  int contradictions_ = 0;
  int lost_ = 0;
  int missed_ = 0;
};

}  // namespace alidade
