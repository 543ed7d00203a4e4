#pragma once
// OrientationStep: makes a record of each frame, from telemetry samples and frames in the order in
// which they come. The live pipeline and a replay both use it.
// A frame's middle row is looked up in the telemetry at once; nothing waits for a later sample. In
// OE mode landmarks of the image join in, with telemetry as prior (oe_mode.h). A status says why a
// record is not better (record_status.h). Step by step: docs/derivations.md.
// Fixed memory, taken by the constructor; afterwards nothing is allocated, thrown or locked. One
// thread; no thread or clock of its own.

#include <memory>
#include <optional>

#include "core/model/calibration.h"
#include "core/model/clock_filter.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/lens/read_lens.h"
#include "core/realtime/lens/zoom_readings.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/pt_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "core/realtime/telemetry/link_delay.h"
#include "edge_app/clocks/frame_clock.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/record/published_calibration.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/frame_landmarks.h"
#include "edge_app/step/repeated_images.h"
#include "edge_app/step/scene_start.h"
#include "edge_app/step/telemetry_intake.h"
#include "edge_app/step/told_base.h"
#include "edge_app/step/turn_chain.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

// How late telemetry comes against the images, compared with the calibration that is in use.
struct LinkDelayReport {
  LinkDelayState state = LinkDelayState::kCalibrated;
  double delay_s = 0;  // s, added to the calibration's clock offset
  double sigma_s = 0;
};

struct OrientationStepOptions {
  Calibration calibration;
  bool calibrated = false;  // false: data-sheet values; landmarks are then not looked for
  TelemetryError telemetry_error;
  // Receive times are arrivals: frames and telemetry may have waited before.
  bool wait_for_pace = false;
  // The calibration, if calibrated, was made over another connection, whose least delay may differ.
  bool other_connection = false;
  // Of that other connection, if it is known already.
  std::optional<LinkDelayReport> link_delay;
  ClockFilterOptions video_clock;
  ClockFilterOptions telemetry_clock;
  // s, one standard deviation of a receive time that is used as the capture time.
  double video_stamp_sigma_s = 5e-3;
  double telemetry_stamp_sigma_s = 5e-3;
  // Its period_sigma_s applies to filtered times only.
  TelemetryNoise telemetry_noise;
  TelemetryLimits telemetry_limits;
  // OE mode, for images of the calibration's size, which replaces max_width and max_height. Empty:
  // PT mode.
  std::optional<OeOptions> oe;
  // The map OE mode begins with.
  MapState map;
  // In OE mode: follow points while there is no calibration.
  bool follow_points = false;
  // False: the scene map alone tells where the camera looks. Needs oe and calibrated.
  bool has_telemetry = true;
  // Device units: readings no further apart are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  ZoomCurve zoom_curve;  // for other zooms; may be empty
  // Where neither calibration nor curve knows the zoom: PT mode with this lens and its covariance,
  // and the calibration's axes and clock offset. Empty: no orientation there.
  std::optional<Calibration> any_zoom;
  // s, one standard deviation: how much the delays of two connections usually differ.
  double minimum_delay_sigma_s = 5e-3;
  // s, the same for a connection whose delay has not been seen yet (link_delay.h).
  double unseen_delay_sigma_s = LinkDelay::kOpenSigma_s;
  // In PT mode: there are images, and points are followed in them to find that delay.
  bool follow_turns = false;
};

// Options of OE mode for a camera's images: small images get as many landmarks as large ones,
// closer together. Valid for every size.
[[nodiscard]] OeOptions oe_options(const Camera<double>& camera);
// Throws std::invalid_argument if an option is not valid; its one line names the option.
[[nodiscard]] std::unique_ptr<OeMode> make_oe_mode(const OeOptions& options);

// What a frame brought to light, for the log.
struct StepEvents {
  bool video_clock_restarted = false;
  const char* video_clock_restarted_by = "";  // why, for people; of static storage
  bool video_delay_stepped = false;           // or the sender's clock did; flagged, not followed
  double video_moved_s = 0;                   // by how much, at such a step or a restart
  // From this frame on images exclude the focal length of the zoom reading.
  bool zoom_contradicted = false;
  double video_delay_wander_s = 0;  // s, by how much the delay wanders; 0: it does not
  // Set in the frame from which the sender's time stamps are left out, as they run at another rate
  // than the pictures come: their rate less one.
  std::optional<double> stamps_left_out;
  bool stamps_count = false;                  // those stamps count pictures
  std::optional<LinkDelayReport> link_delay;  // empty: without a calibration
  bool link_delay_told = false;               // from this frame on, by motion
};

class OrientationStep {
 public:
  // Throws as make_oe_mode() does.
  explicit OrientationStep(const OrientationStepOptions& options);

  // The connection that begins with the next frame has no backlog, as later frames show
  // (fresh_beginning.h).
  void expect_fresh_frames() { video_clock_.expect_fresh(); }
  void add_telemetry(const PanTiltSample& sample);
  // The connection to the pan/tilt source was lost. The next sample ends that state.
  void telemetry_lost();

  // image: if there is none, not valid(). In PT mode the record does not depend on it: maintain()
  // follows points through it, if follow_turns says so; else `run` and `replay` give none. It must
  // outlive the maintain() that follows.
  OrientationRecord add_frame(const FrameStamp& stamp, const ImageView& image, StepEvents* events);
  // Call once the record is out: updates the landmark map with the frame added last, or follows
  // points through it.
  void maintain();
  // In OE mode, with the present calibration and zoom.
  [[nodiscard]] bool finds_landmarks() const {
    return oe_ && now_.calibrated && (zoom_fits() || follows_lens());
  }
  // In OE mode, or while points are followed.
  [[nodiscard]] bool looks_at_images() const { return finds_landmarks() || start_up_; }
  // What the frame added last, after maintain(), gives the calibration thread.
  void get_tracks(FrameTracks* tracks) const;
  // The same for display.
  void get_landmarks(FrameLandmarks* landmarks) const;
  // The frame added last is being localized by the scene map. False: its orientation cannot be
  // compared with the result.
  bool ask_about_base();
  // The same for a frame without orientation, if there is no telemetry. *angular_velocity: rad/s,
  // camera frame. False: it is not needed, or the camera cannot be followed from this frame on.
  bool ask_where_it_looks(Vector3<double>* angular_velocity);
  // The result of one of these two requests. From the next frame on records are in the map's base
  // (base_tie.h), whatever is adopted.
  void settle_base(const ToldBase& told);
  // Takes over another calibration with its map. Call between two frames.
  void adopt(const PublishedCalibration& published);
  // The record that replaces frames while there is no connection to the video source.
  [[nodiscard]] OrientationRecord video_lost(double now_s) const;

 private:
  // What is in use, until adopt().
  struct InUse {
    Calibration calibration;
    bool calibrated = false;
    ZoomCurve zoom_curve;
  };

  [[nodiscard]] OrientationRecord empty_record() const;
  // Learnt if there is a zoom curve, else calibrated.
  [[nodiscard]] FocalLength focal_length() const;
  // False: there is a calibration, but not for the zoom that the pan/tilt source reports.
  [[nodiscard]] bool zoom_fits() const;
  // With a zoom curve: the readings around this telemetry time are not at the calibration's zoom,
  // or there are none.
  [[nodiscard]] bool zoom_moved(double telemetry_time_s) const;
  // OE mode has a map that it has followed to this zoom or can follow there, or it can begin one
  // from the zoom curve.
  [[nodiscard]] bool follows_lens() const {
    return oe_ && now_.calibrated && zoom_on_curve_ && (begins_here_ || oe_->map().size() > 0);
  }
  // Sets zoom_on_curve_ and begins_here_ for the present zoom.
  void note_curve_here();
  // OE mode's map can be used with `published`, and is worth more than the map that comes with it.
  [[nodiscard]] bool keeps_map(const PublishedCalibration& published) const;
  // Completes a record of mode OE, with telemetry or without, by what the landmarks showed, but for
  // its orientation and status.
  void note_landmarks(const FrameOrientation& frame, OrientationRecord* record);
  // Fills record->localized if the scene map has tied the base.
  void note_tie(OrientationRecord* record) const;
  // Passes telemetry to OE mode for frames that were answered by extrapolation, once samples
  // enclose them.
  void settle_pending_frames();
  // Telemetry's answer, with a covariance that includes the uncertain delay of the link.
  [[nodiscard]] QueryStatus ask_telemetry(double time_s, double time_sigma_s,
                                          InterpolatedPanTilt* out) const;
  // Gives the delay of the link what the frame added last shows of the head's motion.
  void show_motion();
  void show(const ImageAngles& image);
  // In PT mode: how the head has turned since the image before, by points that are followed.
  void follow_turn();
  // Reports a delay of the link that motion has shown.
  void tell_delay(StepEvents* events);
  // Completes a record that has its time and telemetry's status. measured: null if there is none.
  // lens: the frame's, if it may differ from the calibration's; else null.
  void orient(const InterpolatedPanTilt* measured, const ImageView& image, const FrameLens* lens,
              OrientationRecord* record);

  // OrientationRecord::telemetry_error of a record of mode OE that is complete but for this member.
  [[nodiscard]] static PanTilt<double> telemetry_error(const InterpolatedPanTilt& measured,
                                                       const FrameOrientation& frame,
                                                       const OrientationRecord& record);
  // Without telemetry: completes a record that has its time.
  void orient_by_scene(const ImageView& image, OrientationRecord* record);
  // True: from here on landmarks hold, in the base of the localized frame.
  [[nodiscard]] bool begin_by_scene(const ImageView& image, double time_s);
  // Takes the lens that a localized frame shows. False: it differs from the lens used so far, or is
  // not on the zoom curve.
  [[nodiscard]] bool take_scene_lens(const ToldBase& told);

  [[nodiscard]] Calibration at_any_zoom() const;
  // PT mode's record at another zoom, by the curve, else by at_any_zoom(). measured null: the
  // status already says why there is no angle.
  void orient_between(const InterpolatedPanTilt* measured, double telemetry_time_s,
                      OrientationRecord* record);
  // s, from a frame's first row to its last.
  [[nodiscard]] double readout_s() const;
  // For a lens taken to stand still: adds to its focal length's variance what a beginning movement
  // may have changed.
  void allow_for_begun_movement(Calibration* calibration) const;

  // As given.
  std::optional<Calibration> any_zoom_;
  bool has_telemetry_;
  bool follow_points_;
  double connections_sigma_s_;  // s: how much the least delays of two connections differ
  FrameClock video_clock_;
  InUse now_;
  TelemetryIntake telemetry_;
  std::unique_ptr<OeMode> oe_;                // null: PT mode
  std::unique_ptr<StartUpTracker> start_up_;  // null: its points are not needed
  ZoomReadings zoom_;
  ReadLens lens_;
  bool zoom_on_curve_ = false;  // the present zoom lies on the zoom curve
  bool begins_here_ = false;    // and the curve is sharp enough there for a map to begin
  double unseen_delay_sigma_s_;
  LinkDelay link_delay_;
  int delays_told_ = 0;          // of link_delay_, in events
  bool delay_was_open_ = false;  // at the frame before
  double by_calibration_s_ = 0;  // s, telemetry time without link_delay_, of the frame added last
  std::uint32_t shown_map_ = 0;  // OE mode's map by which images show angles
  ImageAngles shown_;            // by the last image that showed them
  bool has_shown_ = false;
  std::unique_ptr<TurnChain> turns_;  // null: images show angles by OE mode, or not at all
  PanTilt<double> turned_;            // rad, true, by turns_, from any zero
  PanTilt<double> measured_angle_;    // rad, telemetry's, of the frame added last
  Vector2<double> turn_rate_ = Vector2<double>::Zero();  // rad/s, true, of the last turn
  Vector2<double> mean_rate_ = Vector2<double>::Zero();  // rad/s, of shown_, over a while
  // s, the part of a frame's time error that neighbouring frames share, without link_delay_'s.
  double lasting_sigma_s_ = 0;
  RepeatedImages repeated_images_;
  SceneStart scene_start_;        // without telemetry
  Calibration scene_lens_;        // likewise: the lens through which points are followed
  bool is_beginning_ = false;     // OE mode's map is begun by it
  double beginning_since_s_ = 0;  // s, frame time
  bool answered_by_oe_ = false;   // the frame added last, in whatever mode
  double tied_time_s_ = 0;        // s, of the frame that tied the base
  ImageView image_;               // of the frame added last, until maintain()
  FrameTracks tracks_;            // of the frame added last, without its points
};

}  // namespace alidade
