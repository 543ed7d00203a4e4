#pragma once
// OrientationStep: what is made of each telemetry sample and each frame, in the order in which they
// come. One way for the live pipeline and for a replay; pure: no thread, no clock of its own.
//
// A frame's time: sender clock, else sequence numbers, through the video's clock filter; without
// both the receive time as it is. Where it may have waited for nobody knows how long (frame_clock.h), live or when it was
// recorded, it has no time, and no orientation: "picture time unknown". A sample's time likewise; without both it is the middle of
// [earliest, latest], sigma = width / sqrt(12), each sample with an error of its own; what took far longer than usual, by a
// stall, is left out.
// The frame's middle row is looked up in the telemetry at time + d at once (telemetry_buffer.h): if it lies beyond
// the newest trusted angle it is extrapolated, with growing sigma, for max_extrapolation_s, and beyond that there is
// none: "telemetry too old" (record_status.h). Nothing waits for a later sample. When later samples enclose the frame,
// OE mode's map learns from them.
// In OE mode (oe_mode.h) landmarks of the frame's image join in; the same telemetry is the prior.
// The record is PT's, and its status says why, where they do not hold; it is OE's also where
// telemetry is missing but landmarks carry the orientation on (its status then names what is missing).
// An image that is sent again while the camera turns is of another time than its frame: "picture repeated", no orientation
// (repeated_images.h).
// A lens that zooms does not come back exactly: with a zoom curve OE mode learns the focal length, too, and the record has it.
// Where the zoom is another than the calibration's, or moves, its zoom curve gives OE mode, or PT mode, a lens (zoom_lookup.h): OE
// mode's map stays, also when the calibration of another zoom of the same curve is adopted; without one it begins there, once the lens
// stands.
// A scene map that knows where a frame looked may say so later: from then on records, PT's too, are in its base.
// Without telemetry (has_telemetry false) a localized frame tells where the camera looks, followed from there to the next
// (scene_start.h), until OE mode's landmarks hold, which go on by the frame before. Where they are lost that begins anew: "not localized".
// With a zoom curve that frame tells the focal length, too, and a second one that the lens stands; from there images alone tell it.
// While there is no calibration for the camera, or none for the zoom that the pan/tilt source reports, points
// are followed instead (start_up_tracker.h), for the calibration thread to make one of.
// After a reconnection the stream's clock begins anew; telemetry from before it is forgotten. The least
// delay of the new connection may be another, so that d holds less surely until the next adopt().
// Fixed memory, taken by the constructor; after it nothing is allocated, thrown or locked. One thread.

#include <memory>
#include <optional>

#include "core/model/calibration.h"
#include "core/model/clock_filter.h"
#include "core/model/steady_zoom.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "core/realtime/pt_mode.h"
#include "core/realtime/start_up/start_up_tracker.h"
#include "core/realtime/telemetry/telemetry_buffer.h"
#include "edge_app/clocks/capture_clock.h"
#include "edge_app/clocks/frame_clock.h"
#include "edge_app/record/orientation_record.h"
#include "edge_app/record/published_calibration.h"
#include "edge_app/step/calibration_feed.h"
#include "edge_app/step/frame_landmarks.h"
#include "edge_app/step/repeated_images.h"
#include "edge_app/step/scene_start.h"
#include "edge_app/step/told_base.h"
#include "edge_app/step/zoom_lookup.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct OrientationStepOptions {
  Calibration calibration;
  bool calibrated = false;  // passed on to the records
  // Receive times are arrivals: frames and telemetry may have waited before them.
  bool wait_for_pace = false;
  // The calibration, if it is one, was made over another connection, whose least delay was another.
  bool other_connection = false;
  ClockFilterOptions video_clock;
  ClockFilterOptions telemetry_clock;
  // One standard deviation of a receive time that has to do for the time itself, s.
  double video_stamp_sigma_s = 5e-3;
  double telemetry_stamp_sigma_s = 5e-3;
  // period_sigma_s holds for filtered times only.
  TelemetryNoise telemetry_noise;
  TelemetryLimits telemetry_limits;
  // OE mode, for images of the calibration's size, which replaces max_width and max_height; none: PT.
  std::optional<OeOptions> oe;
  // The map OE mode begins with.
  MapState map;
  // With OE mode: follow points as long as there is no calibration.
  bool follow_points = false;
  // False: a scene map alone tells where the camera looks. That takes oe and calibrated.
  bool has_telemetry = true;
  // Device units within which two zoom readings are one; none: as their jitter shows.
  std::optional<double> zoom_tolerance;
  ZoomCurve zoom_curve;  // for other zooms; may be empty
  double minimum_delay_sigma_s =
      5e-3;  // by how much a new connection's least delay differs, one standard deviation
};

// OE mode for a camera's images: small ones have as many landmarks as large ones, closer together. Valid for
// every size.
[[nodiscard]] OeOptions oe_options(const Camera<double>& camera);
// Throws std::invalid_argument, whose one line names the option, if one is not valid.
[[nodiscard]] std::unique_ptr<OeMode> make_oe_mode(const OeOptions& options);

// What a frame brought to light, for the log.
struct StepEvents {
  bool video_clock_restarted = false;
  bool video_delay_stepped = false;  // the least delay stepped: flagged, not followed
  bool zoom_contradicted =
      false;  // images exclude the focal length of the zoom reading, from this frame on
  double video_delay_wander_s = 0;  // by how much it was seen to wander; 0: it does not
  // The sender's time stamps run at another rate than the pictures come, and are left out from this frame on: their
  // rate less one.
  std::optional<double> stamps_left_out;
  bool stamps_count = false;  // these count pictures
};

class OrientationStep {
 public:
  // Throws as make_oe_mode() does.
  explicit OrientationStep(const OrientationStepOptions& options);

  // What follows the next frame shows that the connection that begins with it has no backlog (fresh_beginning.h).
  void expect_fresh_frames() { video_clock_.expect_fresh(); }
  void add_telemetry(const PanTiltSample& sample);
  // The connection to the pan/tilt source was lost; the next sample ends that.
  void telemetry_lost();

  // image: one that is not valid() stands for none; PT mode looks at none. It must outlive the
  // maintain() that follows.
  OrientationRecord add_frame(const FrameStamp& stamp, const ImageView& image, StepEvents* events);
  // For when the record is out: upkeep of the landmark map with the frame last added, or the following of
  // points through it.
  void maintain();
  // In OE mode, with the calibration and the zoom of this moment.
  [[nodiscard]] bool finds_landmarks() const {
    return oe_ && options_.calibrated && (zoom_fits() || follows_lens());
  }
  // In OE mode, or following points.
  [[nodiscard]] bool looks_at_images() const { return finds_landmarks() || start_up_; }
  // What the frame last added, and maintained, has for the calibration thread.
  void get_tracks(FrameTracks* tracks) const;
  // The same for people to look at.
  void get_landmarks(FrameLandmarks* landmarks) const;
  // Somebody looks by the scene map where the frame last added looked. False: it has no answer that could be held against that.
  bool ask_about_base();
  // The same where it has none, without telemetry; *angular_velocity: rad/s, camera frame. False: it could not be followed from there.
  bool ask_where_it_looks(Vector3<double>* angular_velocity);
  // What came of either: from the next frame on records are in the map's base (base_tie.h), whatever is adopted.
  void settle_base(const ToldBase& told);
  // Takes over another calibration with its map, between two frames.
  void adopt(const PublishedCalibration& published);
  // The record in place of frames while there is no connection to the video source.
  [[nodiscard]] OrientationRecord video_lost(double now_s) const;

 private:
  static constexpr std::size_t kSamplesKept = 1024;
  using Telemetry = TelemetryBuffer<kSamplesKept>;

  [[nodiscard]] Telemetry empty_telemetry(bool filtered) const;
  [[nodiscard]] OrientationRecord empty_record() const;
  // Learnt with a zoom curve only.
  [[nodiscard]] FocalLength focal_length() const;
  // False: there is a calibration, but not for the zoom that the pan/tilt source reports.
  [[nodiscard]] bool zoom_fits() const;
  // With a zoom curve: the reading fits, but did not when a frame of this telemetry time was taken, or is not known.
  [[nodiscard]] bool zoom_moved(double telemetry_time_s) const;
  // OE mode has a map that it has followed to this zoom, or can follow there, or can begin one by the zoom curve.
  [[nodiscard]] bool follows_lens() const {
    return oe_ && options_.calibrated && zoom_on_curve_ && (begins_here_ || oe_->map().size() > 0);
  }
  // What the zoom curve has at the zoom as last reported.
  void note_curve_here();
  // The map is of use with what is published, and worth more than what comes with it.
  [[nodiscard]] bool keeps_map(const PublishedCalibration& published) const;
  // The base of the record, where the scene map has told it.
  void note_tie(OrientationRecord* record) const;
  [[nodiscard]] bool is_stalled_poll(const PanTiltSample& sample);
  // Frames that extrapolated telemetry answered, and that telemetry encloses by this sample.
  void settle_pending_frames();
  // Completes a record that has its time and telemetry's status; measured: null if there is none.
  // lens: of the frame, where that may be another than the calibration's; else null.
  void orient(const InterpolatedPanTilt* measured, const ImageView& image, const FrameLens* lens,
              OrientationRecord* record);

  // Without telemetry: completes a record that has its time.
  void orient_by_scene(const ImageView& image, OrientationRecord* record);
  // True: landmarks hold from here on, in the base of the localized frame.
  [[nodiscard]] bool begin_by_scene(const ImageView& image, double time_s);
  // The lens that a localized frame shows. False: it is another than was thought, or none of the zoom curve's.
  [[nodiscard]] bool take_scene_lens(const ToldBase& told);

  OrientationStepOptions options_;
  FrameClock video_clock_;
  CaptureClock telemetry_clock_;
  Telemetry telemetry_;
  std::unique_ptr<OeMode> oe_;                // null: PT mode
  std::unique_ptr<StartUpTracker> start_up_;  // null: nobody wants its points
  // PT mode's record by the zoom curve. Null: the status says already why there is no angle.
  void orient_between(const InterpolatedPanTilt* measured, double telemetry_time_s,
                      OrientationRecord* record);

  // What the zoom's readings say of a frame's lens; where OE mode excluded that in the frame before, or no lens goes there so fast,
  // the curve's at the focal length that OE mode found.
  [[nodiscard]] bool look_up_lens(double telemetry_time_s, FrameLens* lens);
  // The zoom curve's at the focal length that OE mode found, age_s ago. False: it found none lately.
  [[nodiscard]] bool lens_as_found(double age_s, FrameLens* lens) const;
  // Faster than any lens from what OE mode found, age_s ago.
  [[nodiscard]] bool reading_jumps(double age_s) const;
  // Of a lens that is taken to stand.
  void allow_for_begun_movement(Calibration* calibration) const;
  // After OE mode's answer.
  void note_found_lens(const FrameOrientation& found);
  // Whether that answer, noted, excludes what the reading says.
  void judge_reading(const FrameOrientation& found);

  void take_zoom(double time_s, double reading);

  std::optional<double> told_zoom_;  // as last reported
  SteadyZoom steady_zoom_;
  std::optional<double> zoom_;  // the same without jitter
  Calibration read_lens_;       // by the readings, of the frame last added
  // Of OE mode's latest answer, at that frame's time; focal length 0: there is none, or none of use.
  bool reading_excluded_ = false;  // by it
  double found_focal_length_ = 0;  // px
  double found_rate_ = 0;          // 1/s
  double found_time_s_ = 0;        // telemetry time
  double lens_time_s_ = 0;         // likewise, of the frame last added
  bool zoom_on_curve_ = false;     // zoom_ is one of the zoom curve's
  bool begins_here_ = false;       // and sharp enough there for a map to begin
  ZoomLookup zoom_lookup_;
  std::optional<double> zoom_at_adoption_;  // that a calibration without zoom is for
  double minimum_delay_sigma_s_ = 0;
  double lasting_sigma_s_ = 0;  // of a frame's time, what it has in common with those about it
  RepeatedImages repeated_images_;
  SceneStart scene_start_;           // without telemetry
  Calibration scene_lens_;           // likewise: that points are followed through
  bool is_beginning_ = false;        // OE mode's map begins by it
  double beginning_since_s_ = 0;     // frame time
  bool answered_by_oe_ = false;      // the frame last added, in whatever mode
  double tied_time_s_ = 0;           // of the frame that tied the base
  ImageView image_;                  // of the frame last added, until it is maintained
  FrameTracks tracks_;               // of the frame last added, but for its points
  bool telemetry_filtered_ = false;  // times in telemetry_ come from telemetry_clock_
  bool telemetry_lost_ = false;
  double usual_poll_s_ = 0.01;  // from a question to its answer
};

}  // namespace alidade
