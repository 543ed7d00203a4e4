#pragma once
// OE mode: a frame's orientation from telemetry and from landmarks seen in the frame, to a few hundredths
// of a pixel (PTCEE sections V-A, V-C).
//
//   process()   1 predict pan and tilt from telemetry, or, without it, from the    motion_prediction.h
//                 frame before
//               2 coarse alignment over pan and tilt, coarse to fine (PTCEE 30, 31)  landmark_search.h
//               3 choose landmarks of the map, project them with rolling shutter,    landmark_search.h
//                 align each patch (PTCEE 32, 33)
//               4 solve angle, rate and acceleration of pan and tilt, and the        orientation_solve.h
//                 offset of map against telemetry, robustly, with telemetry as
//                 prior (PTCEE 35); where few hold, 3 and 4 once more, from
//                 where the frame before leads to
//               5 answer, and learn the map's offset                                 map_offset_filter.h
//   maintain()  after the answer is out, from the frame's result (processed_frame.h):
//               6 refine and retire landmarks (PTCEE 36)                             map_upkeep.h
//               7 straighten the map by what neighbouring frames tell                map_shear.h
//               8 make landmarks where cells are empty                               landmark_maker.h
//
// One estimator for OE and PT: without landmarks the solution is telemetry's, with its covariance. Where
// landmarks contradict telemetry beyond what both claim, the answer is telemetry's with a covariance
// that covers both, and the mode is PT.
// How map, offset and answer follow the calibration they were found with is carried along (Sensitivity),
// and what its covariance makes of that is in the answer's.
// The map begins empty, in the frame that the first telemetry gave it, or as another OeMode left it.
// What was handed over is believed as far as images bear it out: a map that telemetry contradicts is
// forgotten after 50 frames, as is, after 50 frames that show other things, what should be in view of it.
// Where the calibration's focal length is that of a zoom curve it is learnt too, from the first frame on, and the answer's
// calibration has it (lens_scale.h); landmarks follow.
// Such a lens may move, too: with what is known of it from frame to frame (FrameLens), frames solve log f and its rate besides
// (lens_follower.h), and landmarks are looked for in the octaves in which they have about their size. The map stays; it begins with a lens at rest.
// Who knows from outside where a frame looked (a scene map) may say so later: from then on answers, PT's too, are in that base
// (base_tie.h), whatever becomes of map and calibration.
// Fixed memory, taken by the constructor; nothing else allocates, waits or throws. One thread.

#include <cstddef>
#include <cstdint>

#include "core/model/calibration.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/oe_mode/base_tie.h"
#include "core/realtime/oe_mode/frame_lens.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/lens_follower.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/oe_mode/oe_options.h"
#include "core/realtime/oe_mode/processed_frame.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

enum class OeStatus {
  kOk,             // orientation from landmarks and telemetry
  kTooFew,         // too few landmarks held: telemetry alone
  kContradiction,  // landmarks and telemetry exclude each other: telemetry, with room for both
  kNoPrediction,   // neither telemetry nor a frame before: nothing is written
  kBadImage,       // none, or not of the calibration's size: telemetry alone
  kLensMoves,  // no map begins with a lens that moves, and none is held against an unknown one: telemetry alone
  kNotFinite  // nothing is written
};

enum class FocalLength {
  kCalibrated,  // with the covariance that the calibration has
  kLearnt       // besides, from the images: the lens has come back from a movement
};

struct OeStatistics {
  OeStatus status = OeStatus::kNoPrediction;
  // Landmarks by stage, see landmark_search.h; each a part of those before.
  int fine_visible = 0;        // of the fine octaves (octaves.h), in the image
  int chosen = 0;              // and looked for
  int found = 0;               // by patch alignment
  int inliers = 0;             // in agreement with the solution
  double coarse_shift_px = 0;  // by which coarse alignment moved the prediction, image centre
  PanTilt<double> map_offset;  // rad, base minus map
  Matrix2<double> map_offset_covariance = Matrix2<double>::Zero();  // rad^2
  // The frame's lens was solved for by itself, as it had moved since the map was begun; and by how many of both's standard
  // deviations its log f is not what the zoom reading says.
  bool own_lens = false;
  double reading_sigmas = 0;
};

// What telemetry is to be asked for again.
struct TelemetryLookUp {
  double time_s = 0;        // telemetry clock
  double time_sigma_s = 0;  // one standard deviation
};

class OeMode {
 public:
  // options: valid.
  explicit OeMode(const OeOptions& options);
  OeMode(const OeMode&) = delete;
  OeMode& operator=(const OeMode&) = delete;

  // Begins anew: empty map, nothing remembered. Real-time safe.
  void reset(const Calibration& calibration, FocalLength focal_length = FocalLength::kCalibrated);
  // The same, but with this map, made with this calibration, by this mount without a restart that
  // moved its zero; it is in OE mode in its first frame. Landmarks that are not valid, or that there is
  // no room for, are left out; a map that is not valid is none. Real-time safe: 0.3 us a landmark.
  void reset(const Calibration& calibration, const MapState& map,
             FocalLength focal_length = FocalLength::kCalibrated);

  // frame_time_s: t0, row 0 on the image clock. at_middle_row: telemetry at t0 + clock_offset +
  // line_delay * height / 2, null if there is none. The image must outlive the maintain() that
  // follows. *out is written with every status but kNoPrediction and kNotFinite.
  // Extrapolated telemetry is a prior for this frame only: the map's offset learns nothing from it, and the
  // frame is pending.
  [[nodiscard]] OeStatus process(const ImageView& image, double frame_time_s,
                                 const InterpolatedPanTilt* at_middle_row, FrameOrientation* out) {
    return process(image, frame_time_s, at_middle_row, nullptr, out);
  }
  // The same behind a lens that zooms, with FocalLength::kLearnt; lens: what is known of it, null: nothing new. Where that is
  // missing or wrong the frames before and the image tell f, as far as they can. Distortion and centre are taken from `lens`, along its
  // curve to the f that the image tells: where its focal length is excluded (reading_sigmas), the caller hands in the curve's at the
  // focal length that was found.
  [[nodiscard]] OeStatus process(const ImageView& image, double frame_time_s,
                                 const InterpolatedPanTilt* at_middle_row, const FrameLens* lens,
                                 FrameOrientation* out);

  // Whether the map was begun with another lens than the frame last processed had, or than reset() told, or that lens moved.
  [[nodiscard]] bool lens_has_moved() const { return lens_.follows() || begun_elsewhere_; }
  // The map was begun before that lens moved, and has been followed since.
  [[nodiscard]] bool has_followed_lens() const { return lens_.follows(); }

  // Map upkeep with the frame last processed; does nothing where that had no sure orientation.
  void maintain();

  // Late telemetry. True, and what telemetry is to be asked for, if a frame is pending and telemetry up to
  // newest_sample_s (telemetry clock) encloses its time: the oldest of up to MapOffsetFilter::kMaxPending.
  [[nodiscard]] bool pending(double newest_sample_s, TelemetryLookUp* look_up) const;
  // Telemetry's answer for that frame; null: it has none. The map's offset learns from it, unless it is
  // extrapolated, and the frame is pending no more. Where such telemetry contradicts landmarks, so do the frames
  // that follow it.
  void settle_pending(const InterpolatedPanTilt* late);
  // Telemetry's clock began anew: nobody can be asked for what was.
  void forget_pending();

  // Somebody measures where the frame last processed looked; who asked before is forgotten. False: it has no answer.
  bool ask_about_base() { return tie_.ask(); }
  // What came of it. False: nothing that is better than what is known.
  bool settle_base(const BaseMeasurement& measurement) {
    return tie_.settle(measurement, offset_.offset());
  }
  [[nodiscard]] const BaseTie& tie() const { return tie_; }
  // How telemetry's zero lies in the base; 0 as long as nothing is known from outside.
  [[nodiscard]] TiedOffset telemetry_zero() const { return tie_.of_telemetry(offset_.offset()); }
  // Puts telemetry's answer about any frame into the base. False: what comes out is not finite, and *out is as it was.
  [[nodiscard]] bool put_into_base(FrameOrientation* out) const;

  // Of the frame last processed.
  [[nodiscard]] const OeStatistics& statistics() const { return statistics_; }
  // statistics().found of them, residuals and inliers by the solution; without one, by the prediction.
  [[nodiscard]] const OeObservation* observations() const { return search_.observations().data(); }
  [[nodiscard]] const LandmarkMap& map() const { return map_; }

  // For another OeMode, or for the next start. Allocates: not for the real-time thread.
  [[nodiscard]] MapState map_state() const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Solution {
    SolveStatus status = SolveStatus::kTooFew;
    FrameMotion<double> motion;  // about which it was linearised, map's frame
    SolvedMotion solved;
    Camera<double> camera;  // likewise
  };

  [[nodiscard]] SearchedFrame searched() const {
    return {calibration_,
            map_,
            pyramid_,
            octaves_,
            lens_.columns(),
            lens_.moves(),
            lens_.expected().value[1]};
  }
  void begin_frame(const ImageView& image, double frame_time_s,
                   const InterpolatedPanTilt* telemetry);
  OeStatus finish(OeStatus status) { return statistics_.status = status; }
  [[nodiscard]] bool build_pyramid(const ImageView& image);
  [[nodiscard]] Solution solve_about(const FrameMotion<double>& motion,
                                     const PredictedMotion& predicted);
  [[nodiscard]] Solution find_and_solve(const PredictedMotion& predicted,
                                        const LandmarkSearch::Coarse& coarse, double sigma_px);
  void add_pending(const Vector2<double>& angle, const Matrix2<double>& covariance,
                   const Matrix2<double>& shared_covariance, const Matrix2<double>& by_calibration,
                   const Sensitivity<2>& sensitivity);
  OeStatus answer_without_landmarks(const PredictedMotion& predicted, const Solution& solution,
                                    FrameOrientation* out);
  OeStatus answer_with_landmarks(const PredictedMotion& predicted, const Solution& solution,
                                 FrameOrientation* out);

  // By what is known from outside too, for a frame that landmarks answer: what is added to the map's angles, and all the covariance.
  [[nodiscard]] TiedOffset offset_of_answer(const SolvedMotion& solved) const;
  [[nodiscard]] Matrix6 covariance_of_answer(const SolvedMotion& solved,
                                             const TiedOffset& added) const;
  [[nodiscard]] SharedByView shared_by_view(const SolvedMotion& solved) const;
  void note_landmarks_answer(const SolvedMotion& solved, const TiedOffset& added);
  [[nodiscard]] bool tie_telemetry(FrameOrientation* out);

  [[nodiscard]] bool lens_is_learnt() const { return offset_.lens().learnt; }
  // Of answers: with the focal length as learnt so far.
  [[nodiscard]] const Calibration& answers_calibration() const {
    return lens_is_learnt() ? answers_calibration_ : calibration_;
  }
  void begin_lens();
  // The lens of this frame. False: nothing to begin a map with, or to look for one.
  [[nodiscard]] bool take_lens(const FrameLens* reading);
  void set_camera(const Camera<double>& camera);
  [[nodiscard]] Solution look_with_own_lens(FrameMotion<double> motion,
                                            const PredictedMotion& predicted);
  [[nodiscard]] Solution look_for_moved_lens(const Solution& first,
                                             const LandmarkSearch::Coarse& coarse,
                                             const PredictedMotion& predicted);
  void learn_own_lens(const Solution& solution, double zoom_rate);
  [[nodiscard]] Calibration lens_of_answer(double phi, double variance,
                                           const Sensitivity<1>& sensitivity) const;
  void add_lens(const SolvedLens& lens, FrameMotion<double>* in_base,
                Sensitivity<6>* sensitivity) const;
  void follow_lens();

  void doubt_map();
  void begin_map();
  void straighten_map();
  void clear_landmarks();
  void forget_map();

  OeOptions options_;
  Calibration given_;  // by reset()
  FocalLength focal_length_ = FocalLength::kCalibrated;
  Calibration calibration_;          // that the map is made with; but for the focal length as given
  Calibration answers_calibration_;  // where the focal length is learnt
  bool begun_elsewhere_ = false;     // given_ is a reading's by now
  double moved_phi_ = 0;             // what of phi is in it already
  bool ready_ = false;               // there is room for the calibration's images
  std::uint32_t frames_ = 0;         // count

  Pyramid pyramid_;  // of the frame last looked at
  Octaves octaves_;
  RunningNoise noise_;
  LandmarkMap map_;
  MotionPrediction prediction_;
  LandmarkSearch search_;
  MapOffsetFilter offset_;
  BaseTie tie_;
  LensFollower lens_;
  MapShear shear_;
  MapUpkeep upkeep_;
  LandmarkMaker maker_;
  VisibleLandmarks in_view_;       // of maintain()
  double share_of_new_ = 0;        // of the landmarks in view, made by the maintain() before
  double cells_focal_length_ = 1;  // px, that the map's cells are for

  OeStatistics statistics_;
  ProcessedFrame frame_;  // process() writes it, maintain() uses it up
};

}  // namespace alidade
