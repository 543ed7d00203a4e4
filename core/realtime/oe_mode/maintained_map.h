#pragma once
// MaintainedMap: OE mode's landmarks, with the shear that they share, and what processed frames do
// to them:
//   refine()           better directions, and less shear (map_upkeep.h, map_shear.h)
//   judge_coarse()     coarse landmarks found or missed
//   make()             landmarks where cells are empty (landmark_maker.h)
//   retire_unproven()  removes handed-over landmarks that are not there
// Every `calibration` is that of the landmarks; change_lens() announces another lens of it. The
// constructor takes all memory; only state() allocates. One thread.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/image_octaves.h"
#include "core/realtime/oe_mode/landmark_maker.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/lens_scale.h"
#include "core/realtime/oe_mode/map_shear.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/oe_mode/map_upkeep.h"
#include "core/realtime/oe_mode/oe_options.h"
#include "core/realtime/oe_mode/processed_frame.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

// The landmark's direction with parameters that are `change` * direction away.
[[nodiscard]] Vector3<double> moved_direction(const Landmark& landmark, double change,
                                              const ParameterDirection& direction);

class MaintainedMap {
 public:
  // options: valid.
  explicit MaintainedMap(const OeOptions& options);

  // For images of another size; the map is then to begin anew.
  void reset(const Calibration& calibration) { in_view_.reset(calibration, cone_margin_); }
  // An empty map without shear.
  void begin(const Calibration& calibration);
  // Takes the landmarks of a map that was handed over, and its shear. Invalid landmarks, those of
  // other octaves and those without room are left out. False if none is left.
  bool take(const MapState& map, const Octaves& octaves);
  // Without the offset. Allocates.
  [[nodiscard]] MapState state() const;

  // For another lens of the calibration.
  void change_lens(const Calibration& calibration) {
    in_view_.change_lens(calibration, cone_margin_);
    shear_.change_lens(calibration);
  }
  // Retires the landmark in this slot, if it still has this id.
  void retire(int slot, std::uint32_t id) {
    if (landmarks_.occupied(slot) && landmarks_.at(slot).id == id) landmarks_.retire(slot);
  }
  // Moves all landmarks to parameters that are `change` * direction away.
  void move(double change, const ParameterDirection& direction);

  [[nodiscard]] const LandmarkMap& landmarks() const { return landmarks_; }
  [[nodiscard]] bool empty() const { return landmarks_.size() == 0; }
  // The shear as seen by a frame at the tilt (rad) of the last look_at().
  [[nodiscard]] const MapShear& shear() const { return shear_; }
  void look_at(double tilt) { shear_.move_to(tilt); }
  // The zoom, in the map's cells, of landmarks made at this focal length (px): see LandmarkMap.
  [[nodiscard]] int zoom_of(double focal_length) const;

  // Whether landmarks held in a frame, see MapUpkeep.
  void note_held() { upkeep_.note_held(); }
  void note_lost(bool contradiction, bool missed) { upkeep_.note_lost(contradiction, missed); }
  [[nodiscard]] bool is_useless() const { return upkeep_.is_useless(); }
  [[nodiscard]] bool is_doubtful() const { return upkeep_.is_doubtful(); }
  // Retires landmarks in view that were handed over and never found: they are gone or were never
  // there, if the image has texture. Returns how many are left in view; nothing, and retires none,
  // if none is unproven or the image lacks texture. across_octaves: see VisibleLandmarks.
  [[nodiscard]] std::optional<int> retire_unproven(const Calibration& calibration,
                                                   const ImageOctaves& image,
                                                   const ProcessedFrame& frame,
                                                   bool across_octaves);

  // Sets the shear to that of a map made in this frame.
  void begin_shear(const ProcessedFrame& frame) { shear_.begin(frame.motion, frame.covariance); }
  // For a frame that landmarks answered. Returns the correction by which the landmarks were
  // straightened; none while the lens moves.
  [[nodiscard]] std::optional<ShearCorrection> refine(const Calibration& calibration,
                                                      const ProcessedFrame& frame,
                                                      const LandmarkSearch& search,
                                                      bool lens_moves);
  // Forgets landmarks that remain crooked. New ones are made with this frame's motion, which is
  // right now.
  void forget_crooked(const Calibration& calibration, const ProcessedFrame& frame);
  void judge_coarse(const Calibration& calibration, const ImageOctaves& image,
                    const ProcessedFrame& frame, const LandmarkSearch& search) {
    upkeep_.judge_coarse(calibration, image.pyramid(), frame, search, &landmarks_);
  }
  // lens: if the frame has its own, as in SearchedFrame. Returns the share of new landmarks in
  // view, 0 to 1.
  double make(const Calibration& calibration, const ImageOctaves& image,
              const ProcessedFrame& frame, const LensColumns* lens);

  // Without its own size.
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  [[nodiscard]] const std::vector<VisibleLandmark>& find_in_view(const Calibration& calibration,
                                                                 const ImageOctaves& image,
                                                                 const ProcessedFrame& frame,
                                                                 bool across_octaves);
  void clear(const Calibration& calibration);

  double cone_margin_;  // see VisibleLandmarks
  LandmarkMap landmarks_;
  MapShear shear_;
  MapUpkeep upkeep_;
  LandmarkMaker maker_;
  VisibleLandmarks in_view_;
  double share_of_new_ = 0;        // share of landmarks in view that the last make() made
  double cells_focal_length_ = 1;  // px, of the map's cells
};

}  // namespace alidade
