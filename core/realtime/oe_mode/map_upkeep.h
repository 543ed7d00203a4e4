#pragma once
// MapUpkeep: quality of the landmarks in the map: which are refined, which are retired, and whether
// the map fits at all (PTCEE 36). landmark_maker.h makes new ones.
// A landmark that held is refined (Kalman) in its own part of the covariance. A landmark that is
// missed in many frames in a row, or rarely found, is retired. A map that is contradicted or lost
// for many frames in a row is useless. A map whose landmarks should be in view and are not found is
// doubtful sooner: then handed-over landmarks that were never found go.
// No allocation. One thread.

#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/processed_frame.h"

namespace alidade {

struct MapUpkeepOptions {
  int max_misses = 15;         // misses in a row that retire a landmark
  int probation = 20;          // looks before a landmark can be unreliable
  double least_matched = 0.3;  // share of looks; a landmark with less is unreliable
  double memory = 0.1;         // weight of the latest residual in the running mean square
  double alike = 0.6;          // correlation of a coarse patch that counts as found
  // Share of a measurement's covariance that a landmark always keeps: textures alias, and the light
  // changes.
  double least_covariance = 0.01;
  int contradictions_to_forget = 50;  // frames in a row; with more the map is useless
  int lost_to_forget = 1000;          // frames since landmarks held; with more it is useless
  int missed_to_doubt = 50;           // of these, without landmarks that should be seen: doubtful

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

class MapUpkeep {
 public:
  // options: valid.
  explicit MapUpkeep(const MapUpkeepOptions& options) : options_(options) {}

  // For another map.
  void reset();

  // Call one of the two for each frame whose image was searched. Landmarks held.
  void note_held() { reset(); }
  // Landmarks did not hold. contradiction: they exclude telemetry. missed: they should have been in
  // view.
  void note_lost(bool contradiction, bool missed);

  // True after more such frames than the options allow.
  [[nodiscard]] bool is_useless() const {
    return contradictions_ > options_.contradictions_to_forget || lost_ > options_.lost_to_forget;
  }
  [[nodiscard]] bool is_doubtful() const { return missed_ > options_.missed_to_doubt; }

  // Fine landmarks of a frame that held: refined if inliers, and marked as matched or missed.
  void refine(const ProcessedFrame& frame, const LandmarkSearch& search, LandmarkMap* map) const;
  // Coarse ones: found where the frame's motion predicts them, or missed.
  void judge_coarse(const Calibration& calibration, const Pyramid& pyramid,
                    const ProcessedFrame& frame, const LandmarkSearch& search,
                    LandmarkMap* map) const;
  // True if a landmark is unproven: handed over, and never looked for in a frame that held. If
  // unproven landmarks should be in view and are not found, they are gone or were never there. A
  // landmark that was found here once may come back: fog lifts.
  [[nodiscard]] bool has_unproven(const std::vector<VisibleLandmark>& visible,
                                  const LandmarkMap& map) const;
  // Returns the number retired.
  int retire_unproven(const std::vector<VisibleLandmark>& visible, LandmarkMap* map) const;

 private:
  void mark(std::uint32_t frame, int slot, bool matched, double residual_square,
            LandmarkMap* map) const;

  MapUpkeepOptions options_;
  int contradictions_ = 0;  // frames in a row
  int lost_ = 0;            // frames since landmarks held
  int missed_ = 0;          // of these
};

}  // namespace alidade
