#pragma once
// LandmarkSearch: finds the map's landmarks in a frame, from a predicted motion. Coarse ones first
// correct pan and tilt together (coarse_alignment.h, PTCEE 30, 31). Names of the stages of fine
// ones:
//   visible  the motion puts them into the image             visible_landmarks.h
//   chosen   visible ones to look for                        landmark_choice.h
//   found    chosen ones aligned one by one, with rolling shutter (PTCEE 32, 33)
//   inlier   found ones that agree with the solution         orientation_solve.h
// A landmark's patch is kept as this view shows it. It is prepared again when the view has changed
// enough; until then positions are corrected for the change (docs/oe_mode.md).
// The constructor takes all memory; nothing else allocates, waits or throws. One thread.

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
  // > 0; a patch is prepared again when an element of its warp has changed by this.
  float fine_warp_tolerance = 0.02F;
  float coarse_warp_tolerance = 0.04F;
  // While the lens zooms every view differs; coarse patches lead to a few tenths of a pixel only.
  float zooming_warp_tolerance = 0.05F;
  float zooming_coarse_warp_tolerance = 0.1F;
  double cone_margin = 1.3;  // >= 1, see VisibleLandmarks::reset()
  double search_sigmas = 3;  // sigmas of the prediction that the first coarse search covers
  double coarse_reach_px =
      0.75;                    // px of the coarsest octave; alignment reaches it without a search
  double wide_search_px = 96;  // px of the image; search range if the first search fails

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

// One landmark in one frame.
struct OeObservation {
  int slot = 0;                                          // of the map
  std::uint32_t id = 0;                                  // of the landmark
  int octave = 0;                                        // in which it was found
  Vector2<double> u = Vector2<double>::Zero();           // px of the image
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2, of u
  Vector2<double> residual = Vector2<double>::Zero();  // px, found minus predicted by the solution
  bool inlier = false;
};

// The searched frame; references are borrowed for one call.
struct SearchedFrame {
  const Calibration& calibration;
  const LandmarkMap& map;
  const Pyramid& pyramid;
  const Octaves& octaves;
  // Sensitivity columns of the frame's lens if that differs from the map's; null if not.
  const LensColumns* lens = nullptr;
  bool zooms = false;    // the lens moves
  double zoom_rate = 0;  // 1/s, expected rate of log f
};

class LandmarkSearch {
 public:
  // options: valid. capacity: of the map.
  LandmarkSearch(const LandmarkSearchOptions& options, int capacity);
  LandmarkSearch(const LandmarkSearch&) = delete;
  LandmarkSearch& operator=(const LandmarkSearch&) = delete;

  // For another calibration: forgets all results.
  void reset(const Calibration& calibration);
  // For another lens of the calibration.
  void change_lens(const Calibration& calibration) {
    visible_.change_lens(calibration, options_.cone_margin);
    knows_view_ = false;
  }
  // Forgets all results: at the beginning of a frame, and when the map is cleared.
  void clear();

  struct Coarse {
    bool aligned = false;        // false: no fit of the coarse octaves
    FrameMotion<double> motion;  // corrected, or as predicted
    double shift_px = 0;         // px at the image's centre, correction of the prediction
  };
  // sigma_px: px, of the prediction at the image's centre.
  [[nodiscard]] Coarse align_coarse(const SearchedFrame& frame,
                                    const FrameMotion<double>& predicted, double sigma_px);

  struct Fine {
    int fine_visible = 0;
    int chosen = 0;  // of these
    int found = 0;   // of these
  };
  // Finds fine landmarks near where `motion` predicts them: see found() and observations().
  Fine align_fine(const SearchedFrame& frame, const FrameMotion<double>& motion);

  // Completes observations(): residuals after this correction of `motion` (rad, rad/s, rad/s^2),
  // and the inliers that the solution marked in found(). zoom: correction of the lens (1, 1/s), if
  // the frame has its own.
  void conclude(const Vector6& correction, const Vector2<double>& zoom = Vector2<double>::Zero());

  // The steps of the two stages, in order, for callers that test each alone.
  void find_visible(const SearchedFrame& frame, const ViewProjection& view);
  void prepare_coarse(const SearchedFrame& frame, const ViewProjection& view);
  [[nodiscard]] bool fit_coarse(const SearchedFrame& frame, double sigma_px,
                                Vector2<double>* angle) const;
  void choose_fine(const SearchedFrame& frame);
  void fit_fine(const SearchedFrame& frame, const ViewProjection& view);

  // Fine landmarks of the latest search. The solution writes to found().
  [[nodiscard]] std::vector<FoundLandmark>& found() { return found_; }
  [[nodiscard]] const std::vector<FoundLandmark>& found() const { return found_; }
  // One for each of found().
  [[nodiscard]] const std::vector<OeObservation>& observations() const { return observations_; }
  // One for each of found(): d u / d landmark's tangent coordinates, px/rad.
  [[nodiscard]] const std::vector<Matrix2<double>>& J_tangent() const { return J_tangent_; }
  // found() is a subset, in the same order.
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
    Matrix2<float> B;      // the latest view asked for is A (I + B)
    std::uint32_t id = 0;  // of the landmark it belongs to
    PrepareStatus status = PrepareStatus::kTooFlat;
  };

  [[nodiscard]] float warp_tolerance(const SearchedFrame& frame, int octave) const;
  void ask_for(const SearchedFrame& frame, const VisibleLandmark& wanted) const;
  const ReferencePatch* reference(const SearchedFrame& frame, int slot, int octave,
                                  const SeenDirection& seen);

  LandmarkSearchOptions options_;
  VisibleLandmarks visible_;
  bool knows_view_ = false;  // visible_ is valid for the next search
  LandmarkChoice choice_;
  std::vector<Prepared> prepared_;  // by slot
  std::vector<CoarsePatch> coarse_;
  std::vector<int> coarse_slots_;
  std::vector<FoundLandmark> found_;
  std::vector<OeObservation> observations_;
  std::vector<Matrix2<double>> J_tangent_;
};

}  // namespace alidade
