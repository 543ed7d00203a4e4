#pragma once
// SelfCalibration: what the calibration thread does with what the real-time thread tells it. Pure: no thread, no
// clock of its own, no files but through the CalibrationArchive it is given; a simulation runs it step by step.
//
//   collects   tracks, telemetry and some images (keyframes) of the latest motion, in bounded memory;
//              anew after a reconnection, a change of zoom, or a restart of the tracker
//   adjusts    calibrate() as soon as more data promises more than the last try: frames held out are
//              predicted, and residuals, sufficiency and hold-out decide whether it is published
//   maps       the keyframes once more, with the new calibration and trajectory: the map in the base frame
//   watches    later motion is calibrated on its own and held against what is published: it refines it, or
//              contradicts it; where landmarks and telemetry disagree for long, the calibration is withdrawn
//   zoom       one calibration for each; the stored one is used when the camera returns, unless it was withdrawn
//   zooms      where telemetry tells of several readings, calibrations have a free optical centre and become nodes of a zoom curve,
//              which holds at every reading at once (zoom_nodes.h). What contradicts it twice in a row begins a new one
//   delay      while the video's delay wanders, landmarks that disagree with telemetry tell nothing of the camera: nothing is
//              withdrawn, and nothing calibrated
//
// Allocates; work() takes seconds. One thread.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/model/steady_zoom.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/calibration_archive.h"
#include "edge_app/self_calibration/calibration_session.h"
#include "edge_app/self_calibration/calibration_watch.h"
#include "edge_app/self_calibration/session_calibration.h"
#include "edge_app/self_calibration/zoom_nodes.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// When something is tried: seconds, of data where it says so, else between two tries.
struct CalibrationSchedule {
  double first_try_s = 6;        // of data
  double next_try_s = 1.5;       // of new data
  int many_tries = 20;           // in vain, after which ...
  double slow_try_s = 5;         // ... so much new data is awaited
  double watch_window_s = 12;    // of data for a calibration that is held against another
  double first_watch_s = 12;     // doubling up to ...
  double longest_watch_s = 600;  // ... this
  double store_retry_s = 60;     // what a full disk did not take
  double zoom_arrives_s = 0.1;   // without a change: it does not just pass by
  double zoom_settles_s = 0.5;   // before anything is adjusted
  double zoom_glitch_s = 0.2;    // a reading that differs for less is none; no movement is shorter
  double zoom_silence_s = 5;     // without a reading, where there were some
  double silence_s = 2;          // without a frame or sample, while the other stream goes on
  double worth_publishing = 0.75;  // of a parameter's sigma, to which a refinement must bring one
  double most_wander_s = 0.01;     // of the video's delay
};

struct SelfCalibrationOptions {
  Calibration data_sheet;         // with the image size; what holds without a calibration
  CalibrationOptions adjustment;  // priors of a first calibration
  KnownCamera camera;             // what is known of it beside them
  CalibrationNoise noise;
  // Device units within which two zoom readings are one; none: as their jitter shows.
  std::optional<double> zoom_tolerance;
  bool zooms = false;  // known beforehand; else the second reading tells
  SessionLimits session;
  CalibrationSchedule schedule;
  CalibrationChecks checks;
  ContradictionOptions contradiction;
  DisagreementOptions disagreement;
  bool automatic = true;  // false: stored calibrations only
};

class SelfCalibration {
 public:
  // archive: borrowed; null: nothing is kept.
  SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive);

  // What the real-time thread begins with: the stored calibration, or the data sheet's.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> first() const { return published_; }

  void add(const FrameTracks& tracks);
  // True: the image of the frame last added is wanted as a keyframe, see add_keyframe().
  [[nodiscard]] bool wants_keyframe() const;
  void add_keyframe(const ImageView& image);  // copies it
  void add(const PanTiltSample& sample);
  void video_lost();      // the next frame ends that
  void telemetry_lost();  // the next sample ends that

  // Whether work() would compute.
  [[nodiscard]] bool due() const;
  // Does what is due; null if nothing is to be published.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> work();

  [[nodiscard]] CalibrationReport report() const;
  // Thread-safe: asks for a calibration of the motion from now on, which takes the place of the one there is
  // as soon as it passes the checks of a first one. False: nothing is calibrated here.
  [[nodiscard]] bool ask_for_fresh();

  // Thread-safe: work() that is under way, and all later, ends soon with nothing.
  void cancel();
  // Lines for the log since the last call: what was found, why something was refused.
  [[nodiscard]] std::vector<std::string> take_messages();

 private:
  void begin_anew();
  void begin_fresh();
  void judge_zoom(const PanTiltSample& sample);
  void take_zoom(double zoom, double changed_s);
  void take_jitter(double zoom);
  void clock_began_anew();
  void look_for_stored();
  [[nodiscard]] bool is_rejected(const Calibration& calibration) const;
  // True: the delay wanders, and the frame is of no use.
  bool judge_delay(const FrameTracks& tracks);
  void judge_agreement(const FrameTracks& tracks);
  [[nodiscard]] bool zoom_fits(const std::optional<double>& wanted) const;
  [[nodiscard]] bool is_calibrated_here() const;
  [[nodiscard]] bool storing_is_due() const;
  [[nodiscard]] bool adjusting_is_due() const;
  [[nodiscard]] bool makes_nodes() const { return zooms_ && zoom_.has_value(); }
  [[nodiscard]] bool first_node_is_wanted() const { return first_node_is_wanted_ && !zooms_; }
  [[nodiscard]] bool first_node_is_due() const { return zooms_ && first_node_.has_value(); }
  // Of the session. known: what is published, as prior; null: from the data alone.
  [[nodiscard]] SessionCalibration adjust(const Calibration* known, bool free_centre) const;
  [[nodiscard]] SessionCalibration adjust(const Calibration* known) const {
    return adjust(known, makes_nodes());
  }
  void make_first_node();
  void take_first_node();
  void try_first();
  void hold_against_published();
  void settle(SessionCalibration checked);
  void refine_node(SessionCalibration alone);
  void take_node(const ZoomAddition& addition, SessionCalibration* checked);
  void contradict_nodes(const SessionCalibration& alone, const std::string& why);
  void begin_nodes_anew(const SessionCalibration& alone);
  void publish(const SessionCalibration& checked);
  void store(const CalibrationResult& result, const MapState& map);
  void say_once(const std::string& line);

  SelfCalibrationOptions options_;
  CalibrationArchive* archive_;

  CalibrationSession session_;
  FrameTracks::Tracker tracker_ = FrameTracks::Tracker::kNone;  // of the session's points
  double began_s_ = 0;                                          // the session's first frame
  double last_try_s_ = 0;
  int tries_ = 0;

  // The first zoom's calibration once more, with a free optical centre: a node, if there comes another zoom. Made while its
  // motion is at hand, as keeping that for good would take more memory than all else here.
  struct FirstNode {
    std::string refusal;       // empty: it may be one
    CalibrationResult result;  // calibration, quality and exclusions alone
    MapState map;
    bool clock_holds = true;
  };

  SteadyZoom steady_zoom_;
  std::optional<double> zoom_;
  bool zooms_;  // the camera has more than one zoom
  ZoomNodes nodes_;
  bool first_node_is_wanted_ = false;    // of the session as it is
  std::optional<FirstNode> first_node_;  // until it is known that there is another zoom
  double zoom_changed_s_ = -1e9;
  std::optional<double>
      odd_zoom_s_;  // since when readings differ, after it stood still: a glitch, or a movement
  double last_zoom_s_ = 0;
  double now_s_ = 0;  // the latest receive time of either stream
  double last_frame_s_ = 0;
  double last_sample_s_ = 0;
  bool video_is_lost_ = false;
  bool telemetry_is_lost_ = false;

  std::shared_ptr<const PublishedCalibration> published_;
  std::shared_ptr<const PublishedCalibration> next_;  // to be published
  bool clock_offset_known_ = true;  // since the publication the frames' clock went on
  bool doubtful_ = false;
  std::vector<double> rejected_;  // zooms whose stored calibrations were withdrawn
  bool delay_wanders_ = false;
  DisagreementJudge old_telemetry_{{2, 0.5, 5}};
  bool telemetry_is_old_ = false;
  ContradictionJudge contradiction_;
  DisagreementJudge disagreement_;
  double watch_interval_s_;

  CalibrationNeed need_ = CalibrationNeed::kNothing;
  double last_store_s_ = 0;
  std::atomic<bool> cancelled_{false};
  std::atomic<bool> fresh_asked_{false};
  bool fresh_wanted_ = false;  // a calibration in place of the one there is
  std::string said_;
  std::vector<std::string> messages_;
};

}  // namespace alidade
