#pragma once
// OeMode: a frame's orientation from telemetry and landmarks, to a few hundredths of a pixel (PTCEE
// sections V-A, V-C). One estimator for OE and PT: without landmarks the solution is telemetry's,
// with its covariance. If landmarks contradict telemetry beyond both covariances, the answer is
// telemetry's with a covariance that covers both, and the mode is PT. What drifts against telemetry
// is not ground (scene_drift.h): no landmarks are kept there. Map, offset and answer carry their
// dependence on the calibration (Sensitivity); the answer's covariance includes the calibration's.
// Memory is fixed, taken by the constructor. Nothing waits or throws, and only map_state()
// allocates. One thread. Derivation: docs/oe_mode.md.

#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/model/calibration.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/lens/frame_lens.h"
#include "core/realtime/oe_mode/base_tie.h"
#include "core/realtime/oe_mode/calibration_in_use.h"
#include "core/realtime/oe_mode/error_sharing.h"
#include "core/realtime/oe_mode/image_octaves.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/landmark_search.h"
#include "core/realtime/oe_mode/maintained_map.h"
#include "core/realtime/oe_mode/map_follower.h"
#include "core/realtime/oe_mode/map_offset_filter.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/oe_mode/motion_prediction.h"
#include "core/realtime/oe_mode/moving_directions.h"
#include "core/realtime/oe_mode/oe_options.h"
#include "core/realtime/oe_mode/processed_frame.h"
#include "core/realtime/oe_mode/scene_drift.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

enum class OeStatus {
  kOk,             // orientation from landmarks and telemetry
  kTooFew,         // too few landmarks held: telemetry alone
  kContradiction,  // landmarks and telemetry exclude each other: telemetry, covering both
  kSceneMoves,     // what is in view moves, or it is not known what stands still: telemetry alone
  // No telemetry, and no recent frame, image or landmarks instead; or a calibration that reset()
  // cannot use: nothing is written.
  kNoPrediction,
  kBadImage,   // no image, or not of the calibration's size: telemetry alone
  kLensMoves,  // no map begins with a moving lens, or the lens is unknown: telemetry alone
  kNotFinite   // a time or a result is not finite: *out must not be used
};

struct OeStatistics {
  OeStatus status = OeStatus::kNoPrediction;
  // Landmarks by stage (landmark_search.h); each number is a part of the one before.
  int fine_visible = 0;        // of the fine octaves (octaves.h), in the image
  int chosen = 0;              // looked for
  int found = 0;               // by patch alignment
  int inliers = 0;             // in agreement with the solution
  double coarse_shift_px = 0;  // px at the image's centre, correction by coarse alignment
  // Set with kOk, at the middle row: what landmarks and telemetry show in the map's frame. Frames
  // with the same `map` share that frame.
  PanTilt<double> angle;                                            // rad, true, not wrapped
  PanTilt<double> rate;                                             // rad/s, true
  std::uint32_t map = 0;                                            // count of the maps so far
  PanTilt<double> map_offset;                                       // rad, base minus map
  Matrix2<double> map_offset_covariance = Matrix2<double>::Zero();  // rad^2
  // own_lens: the frame's lens was solved for, as it had moved since the map began. reading_sigmas:
  // |log f minus the zoom reading's| in standard deviations of both.
  bool own_lens = false;
  double reading_sigmas = 0;
};

// A telemetry query to repeat.
struct TelemetryLookUp {
  double time_s = 0;        // s, telemetry clock
  double time_sigma_s = 0;  // s
};

// process(), then maintain(), for each frame:
//   1 predict pan and tilt from telemetry or the previous frame   motion_prediction.h
//   2 coarse alignment in pan and tilt (PTCEE 30, 31)             landmark_search.h
//   3 choose landmarks, align them, rolling shutter (32, 33)      landmark_search.h
//   4 solve motion and offset robustly, telemetry as prior (35)   orientation_solve.h
//     If few hold, repeat 3 and 4 from where the previous frame leads.
//   5 answer, and learn the map's offset                          map_offset_filter.h
//   maintain():
//     leave out what moves                                        scene_drift.h
//   6 refine and retire landmarks (PTCEE 36)                      map_upkeep.h
//   7 straighten the map by neighbouring frames                   map_shear.h
//   8 make landmarks where cells are empty                        landmark_maker.h
class OeMode {
 public:
  // options: valid.
  explicit OeMode(const OeOptions& options);
  OeMode(const OeMode&) = delete;
  OeMode& operator=(const OeMode&) = delete;

  // Begins anew with an empty map, which starts in the frame of the first telemetry. If the
  // calibration's image size or focal length is not positive, or the size exceeds the options',
  // every frame is kNoPrediction. Real-time safe.
  void reset(const Calibration& calibration, FocalLength focal_length = FocalLength::kCalibrated);
  // The same with this map: made with this calibration, by this mount, with no restart since that
  // moved its zero. OE mode starts with its first frame. Invalid landmarks, and those without room,
  // are left out; an invalid map is ignored. Real-time safe: 0.3 us per landmark.
  // A handed-over map is believed as far as images confirm it. MapUpkeepOptions say after how many
  // frames it is forgotten because telemetry contradicts it, and after how many its unproven
  // landmarks are, because images show other things.
  void reset(const Calibration& calibration, const MapState& map,
             FocalLength focal_length = FocalLength::kCalibrated);

  // frame_time_s: t0, row 0 on the image clock. at_middle_row: telemetry at t0 + clock_offset +
  // line_delay * height / 2; null if there is none. The image must stay, unchanged, until the next
  // maintain() returns.
  // *out is valid with every status but kNoPrediction and kNotFinite.
  // Extrapolated telemetry is a prior for this frame only: the map's offset does not learn from it,
  // and the frame becomes pending.
  [[nodiscard]] OeStatus process(const ImageView& image, double frame_time_s,
                                 const InterpolatedPanTilt* at_middle_row, FrameOrientation* out) {
    return process(image, frame_time_s, at_middle_row, nullptr, out);
  }
  // The same for a lens with a zoom curve and FocalLength::kLearnt. Its focal length is learnt from
  // the first frame on (lens_scale.h), and it may move (lens_follower.h). Frames of a moving lens
  // solve log f and its rate too, and look for landmarks in the octaves that show them at about
  // their size. The map stays; it begins with a lens at rest.
  // lens: what is known of it; null: nothing new. If it is missing or wrong, the previous frames
  // and the image determine f as far as they can. Distortion and centre come from `lens`, along its
  // curve to the image's f. If the reading is not believed, the caller passes the curve's lens at
  // the f that was found: read_lens.h does so.
  [[nodiscard]] OeStatus process(const ImageView& image, double frame_time_s,
                                 const InterpolatedPanTilt* at_middle_row, const FrameLens* lens,
                                 FrameOrientation* out);

  // True if the map began with another lens than that of the last frame or of reset(), or if the
  // lens moved.
  [[nodiscard]] bool lens_has_moved() const {
    return calibration_.lens().follows() || calibration_.begun_elsewhere();
  }
  // True if the map began before that lens moved, and has been kept since.
  [[nodiscard]] bool has_followed_lens() const { return calibration_.lens().follows(); }

  // Upkeep of the map with the last frame (processed_frame.h), to be called after its answer is
  // out. A frame without a sure orientation neither refines nor makes landmarks. A map that does
  // not fit is forgotten after any frame: if it is useless (map_upkeep.h), if its lens is lost for
  // good (lens_follower.h), or if it followed what moves.
  void maintain();

  // Late telemetry. True, with *look_up, if telemetry up to newest_sample_s (telemetry clock)
  // encloses the time of a pending frame: the oldest of up to MapOffsetFilter::kMaxPending.
  [[nodiscard]] bool pending(double newest_sample_s, TelemetryLookUp* look_up) const;
  // Telemetry's answer for that frame; null if it has none. The map's offset learns from it unless
  // it is extrapolated, and the frame is no longer pending. If it contradicts landmarks, so do the
  // frames that follow it.
  void settle_pending(const InterpolatedPanTilt* late);
  // Telemetry's clock began anew: earlier times cannot be asked for any more.
  void forget_pending();

  // Announces a measurement of the last frame's orientation in an outer base, such as a scene
  // map's. Replaces an earlier one. False if the frame has no answer. Once it is measured, all
  // answers are in that base, PT's too, even if map or calibration change (base_tie.h).
  bool ask_about_base() { return tie_.ask(); }
  // The measurement. False if what is known is better, or if none was announced or it is invalid.
  bool settle_base(const BaseMeasurement& measurement) {
    return tie_.settle(measurement, offset_.offset());
  }
  [[nodiscard]] const BaseTie& tie() const { return tie_; }
  // Telemetry's zero in the base; 0 as long as nothing is known from outside.
  [[nodiscard]] TiedOffset telemetry_zero() const { return tie_.of_telemetry(offset_.offset()); }
  // Converts *out, telemetry's answer for any frame, to the base. False if the result is not
  // finite; *out is then unchanged.
  [[nodiscard]] bool put_into_base(FrameOrientation* out) const;

  // Statistics of the last processed frame.
  [[nodiscard]] const OeStatistics& statistics() const { return statistics_; }
  // statistics().found observations. Residuals and inliers are the solution's or, without one, the
  // prediction's.
  [[nodiscard]] const OeObservation* observations() const { return search_.observations().data(); }
  [[nodiscard]] const LandmarkMap& map() const { return map_.landmarks(); }

  // For another OeMode, or for the next start. Allocates: not for the real-time thread.
  [[nodiscard]] MapState map_state() const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct Solution {
    SolveStatus status = SolveStatus::kTooFew;
    FrameMotion<double> motion;  // point of linearisation, map's frame
    SolvedMotion solved;
    Camera<double> camera;  // at the point of linearisation
  };

  [[nodiscard]] SearchedFrame searched() const {
    const LensFollower& lens = calibration_.lens();
    return {calibration_.of_frame(), map_.landmarks(), image_.pyramid(),        image_.octaves(),
            lens.columns(),          lens.moves(),     lens.expected().value[1]};
  }
  void begin_frame(const ImageView& image, double frame_time_s,
                   const InterpolatedPanTilt* telemetry);
  OeStatus finish(OeStatus status) { return statistics_.status = status; }
  [[nodiscard]] PredictedMotion by_telemetry(const InterpolatedPanTilt& telemetry);
  [[nodiscard]] OffsetInnovation innovation_of(const PredictedMotion& predicted,
                                               const SolvedMotion& solved) const;
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

  // The map's offset where the map may be going along with what moves.
  [[nodiscard]] std::optional<FollowedOffset> followed_offset() const;
  // Base of an answer with landmarks, including what is known from outside: what is added to the
  // map's angles, and the total covariance.
  [[nodiscard]] TiedOffset offset_of_answer(const SolvedMotion& solved,
                                            const std::optional<FollowedOffset>& followed) const;
  [[nodiscard]] Matrix6 covariance_of_answer(const SolvedMotion& solved, const TiedOffset& added,
                                             const std::optional<FollowedOffset>& followed) const;
  [[nodiscard]] SharedByView shared_by_view(const SolvedMotion& solved) const;
  void note_landmarks_answer(const SolvedMotion& solved, const TiedOffset& added);
  [[nodiscard]] bool tie_telemetry(FrameOrientation* out);

  [[nodiscard]] bool lens_is_learnt() const { return offset_.lens().learnt; }
  // Camera of the frame at phi = 0.
  [[nodiscard]] const Camera<double>& camera() const { return calibration_.of_frame().camera; }
  // The lens that a frame is solved with, if it is not the map's.
  [[nodiscard]] const LensColumns* own_lens() const { return calibration_.lens().columns(); }
  // Takes the lens of this frame. False if it can neither begin a map nor be used to find
  // landmarks.
  [[nodiscard]] bool take_lens(const FrameLens* reading);
  void set_camera(const Camera<double>& camera);
  [[nodiscard]] Solution look_with_own_lens(FrameMotion<double> motion,
                                            const PredictedMotion& predicted);
  [[nodiscard]] Solution look_for_moved_lens(const Solution& first,
                                             const LandmarkSearch::Coarse& coarse,
                                             const PredictedMotion& predicted);
  void learn_own_lens(const Solution& solution, double zoom_rate);
  void add_lens(const SolvedLens& lens, FrameMotion<double>* in_base,
                Sensitivity<6>* sensitivity) const;
  void follow_lens();

  void note_offsets();
  // True if the map has to begin anew, as it followed what moves.
  [[nodiscard]] bool judge_scene();
  void begin_map();
  void straighten(const ShearCorrection& correction);
  void forget_map();

  OeOptions options_;
  CalibrationInUse calibration_;
  bool ready_ = false;        // images of the calibration's size fit
  std::uint32_t frames_ = 0;  // count
  std::uint32_t maps_ = 0;    // count

  ImageOctaves image_;  // of the last frame used
  MaintainedMap map_;
  MotionPrediction prediction_;
  LandmarkSearch search_;
  MapOffsetFilter offset_;
  BaseTie tie_;
  SceneDrift drift_;
  MovingDirections moving_;
  ErrorSharing sharing_;

  OeStatistics statistics_;
  ProcessedFrame frame_;  // written by process(), used up by maintain()
  MapFollower follower_;
};

}  // namespace alidade
