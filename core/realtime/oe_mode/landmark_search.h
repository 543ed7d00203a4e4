#pragma once
// LandmarkSearch: finds the map's landmarks in a frame, from a predicted motion.
//
//   1 visible  landmarks that the motion puts into the image   visible_landmarks.h
//   2          of the coarse octaves the first few of each,    coarse_alignment.h (PTCEE 30, 31)
//              together, move the prediction over pan and tilt
//   3 chosen   of the visible fine ones: they are looked for   landmark_choice.h
//   4 found    of the chosen: projected with rolling shutter,
//              each aligned by itself (PTCEE 32, 33)
//     inliers  of the found: in agreement with the solution    orientation_solve.h
//
// Each word is the name of its stage, in lists and counts alike.
// A landmark's patch is kept as this view shows it, and prepared again when the view has changed enough; until then positions
// are corrected for the change (docs/oe_mode.md).
// Memory is taken by the constructor; nothing else allocates, waits or throws. One thread.

#include <cstdint>
#include <vector>

#include "core/model/calibration.h"
#include "core/model/rolling_shutter.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/oe_mode/coarse_alignment.h"
#include "core/realtime/oe_mode/landmark_choice.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/octaves.h"
#include "core/realtime/oe_mode/orientation_solve.h"
#include "core/realtime/oe_mode/visible_landmarks.h"

namespace alidade {

struct SeenDirection;
class ViewProjection;

struct LandmarkSearchOptions {
  LandmarkChoiceOptions choice;
  int coarse_patches = 40;  // of each coarse octave, 1 to kMaxCoarsePatches
  // As the reference was seen; a patch is prepared again when an element of its warp changed by this, > 0.
  float fine_warp_tolerance = 0.02F;
  float coarse_warp_tolerance = 0.04F;
  // While the lens zooms every view is another one; what is coarse leads to a few tenths of a pixel only.
  float zooming_warp_tolerance = 0.05F;
  float zooming_coarse_warp_tolerance = 0.1F;
  double cone_margin = 1.3;  // see VisibleLandmarks::reset(), >= 1
  double search_sigmas = 3;  // of the prediction, that the first search among coarse octaves covers
  double coarse_reach_px = 0.75;  // px of the coarsest octave that alignment finds without a search
  double wide_search_px = 96;     // px of the image, searched where the first search finds nothing

  // False and one line in *error (if not null) when a value is not valid.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// One landmark in one frame.
struct OeObservation {
  int slot = 0;                                          // of the map
  std::uint32_t id = 0;                                  // of the landmark
  int octave = 0;                                        // in which it was found
  Vector2<double> u = Vector2<double>::Zero();           // px of the image, where it was found
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2, of u
  Vector2<double> residual = Vector2<double>::Zero();  // px, found minus predicted by the solution
  bool inlier = false;
};

// What is searched, and in what: borrowed for one call.
struct SearchedFrame {
  const Calibration& calibration;
  const LandmarkMap& map;
  const Pyramid& pyramid;
  const Octaves& octaves;
  // Where the frame's lens is another than the map's, its columns of sensitivities; null: the same.
  const LensColumns* lens = nullptr;
  bool zooms = false;    // the lens moves
  double zoom_rate = 0;  // 1/s, of log f, as expected
};

class LandmarkSearch {
 public:
  // options: valid. capacity: of the map.
  LandmarkSearch(const LandmarkSearchOptions& options, int capacity);
  LandmarkSearch(const LandmarkSearch&) = delete;
  LandmarkSearch& operator=(const LandmarkSearch&) = delete;

  void reset(const Calibration& calibration);
  void change_lens(const Calibration& calibration) {
    visible_.change_lens(calibration, options_.cone_margin);
    knows_view_ = false;
  }
  // Nothing is found; to begin a frame with, and when the map is cleared.
  void clear();

  struct Coarse {
    bool aligned = false;        // false: the coarse octaves fit nowhere near
    FrameMotion<double> motion;  // where they fit, or as predicted
    double shift_px = 0;         // by which they moved the prediction, px at the image's centre
  };
  // sigma_px: of the prediction at the image's centre, px.
  [[nodiscard]] Coarse align_coarse(const SearchedFrame& frame,
                                    const FrameMotion<double>& predicted, double sigma_px);

  struct Fine {
    int fine_visible = 0;
    int chosen = 0;  // of these
    int found = 0;   // of these
  };
  // Finds fine landmarks about where `motion` sees them: found() and observations().
  Fine align_fine(const SearchedFrame& frame, const FrameMotion<double>& motion);

  // Completes observations(): residuals after this correction of `motion` (rad, rad/s, rad/s^2), inliers as
  // the solution marked them in found(). zoom: correction of the lens (1, 1/s), where the frame has its own.
  void conclude(const Vector6& correction, const Vector2<double>& zoom = Vector2<double>::Zero());

  // The steps of the two stages, in their order, for those who look at each by itself.
  void find_visible(const SearchedFrame& frame, const ViewProjection& view);
  void prepare_coarse(const SearchedFrame& frame, const ViewProjection& view);
  [[nodiscard]] bool fit_coarse(const SearchedFrame& frame, double sigma_px,
                                Vector2<double>* angle) const;
  void choose_fine(const SearchedFrame& frame);
  void fit_fine(const SearchedFrame& frame, const ViewProjection& view);

  // Fine landmarks of the latest search. The solution writes into found().
  [[nodiscard]] std::vector<FoundLandmark>& found() { return found_; }
  [[nodiscard]] const std::vector<FoundLandmark>& found() const { return found_; }
  // Of found(), one each.
  [[nodiscard]] const std::vector<OeObservation>& observations() const { return observations_; }
  // Of found(), one each: d u / d landmark's tangent coordinates, px/rad.
  [[nodiscard]] const std::vector<Matrix2<double>>& J_tangent() const { return J_tangent_; }
  // found() are a part of them, in their order.
  [[nodiscard]] const std::vector<VisibleLandmark>& chosen() const { return choice_.chosen(); }
  // Coarse landmarks of the latest search, and their slots.
  [[nodiscard]] const std::vector<CoarsePatch>& coarse() const { return coarse_; }
  [[nodiscard]] const std::vector<int>& coarse_slots() const { return coarse_slots_; }

  [[nodiscard]] const LandmarkSearchOptions& options() const { return options_; }
  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Prepared {
    ReferencePatch patch;
    Matrix2<float> A;
    Matrix2<float> B;      // the view that was asked for last is A (I + B)
    std::uint32_t id = 0;  // of the landmark it belongs to
    PrepareStatus status = PrepareStatus::kTooFlat;
  };

  [[nodiscard]] float warp_tolerance(const SearchedFrame& frame, int octave) const;
  void ask_for(const SearchedFrame& frame, const VisibleLandmark& wanted) const;
  const ReferencePatch* reference(const SearchedFrame& frame, int slot, int octave,
                                  const SeenDirection& seen);

  LandmarkSearchOptions options_;
  VisibleLandmarks visible_;
  bool knows_view_ = false;  // visible_ has what the next look shall see
  LandmarkChoice choice_;
  std::vector<Prepared> prepared_;  // by slot
  std::vector<CoarsePatch> coarse_;
  std::vector<int> coarse_slots_;
  std::vector<FoundLandmark> found_;
  std::vector<OeObservation> observations_;
  std::vector<Matrix2<double>> J_tangent_;
};

}  // namespace alidade
