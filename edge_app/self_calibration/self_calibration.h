#pragma once
// SelfCalibration: the work of the calibration thread. Pure: no thread, no clock of its own, no
// files except through the CalibrationArchive; a simulation runs it step by step. It collects
// tracks, telemetry and keyframes of the latest motion; calibrates as soon as new data promises
// more than the last try, and publishes the result, with its map, if it passes the checks; tests it
// against later motion, refines it or withdraws it. Each zoom has its own calibration; those of
// several zooms become nodes of a zoom curve. While the video's delay wanders, nothing is
// calibrated or withdrawn.
// Step by step: docs/derivations.md. Allocates; work() takes seconds. One thread.

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
#include "edge_app/self_calibration/checked_calibration.h"
#include "edge_app/self_calibration/zoom_nodes.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

// Times in s. Where it says "of data", they count data; else they lie between two tries.
struct CalibrationSchedule {
  double first_try_s = 6;        // of data
  double next_try_s = 1.5;       // of new data
  int many_tries = 20;           // unsuccessful tries ...
  double slow_try_s = 5;         // ... after which the pause is this, of new data
  double watch_window_s = 12;    // of data for a calibration that tests another
  double first_watch_s = 12;     // doubles up to ...
  double longest_watch_s = 600;  // ... this
  double store_retry_s = 60;     // after the disk refused a calibration
  double zoom_arrives_s = 0.1;   // without a change: the zoom does not just pass by
  double zoom_settles_s = 0.5;   // before anything is adjusted
  double zoom_glitch_s = 0.2;  // a reading that differs for less is ignored; no movement is shorter
  double zoom_silence_s = 5;   // without a reading, if there were some
  double silence_s = 2;        // without a frame or sample while the other stream goes on
  double worth_publishing = 0.75;  // a refinement must bring some parameter's sigma to this share
  double most_wander_s = 0.01;     // s, of the video's delay
};

struct SelfCalibrationOptions {
  Calibration data_sheet;         // with the image size; used while there is no calibration
  CalibrationOptions adjustment;  // priors of a first calibration
  KnownCamera camera;             // what else is known of the camera
  CalibrationNoise noise;
  // Device units: readings no further apart are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool zooms = false;  // known beforehand to zoom; else the second reading shows it
  SessionLimits session;
  CalibrationSchedule schedule;
  CalibrationChecks checks;
  ContradictionOptions contradiction;
  DisagreementOptions disagreement;
  bool automatic = true;  // false: stored calibrations only
};

class SelfCalibration {
 public:
  // archive: borrowed; null: nothing is stored.
  SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive);

  // What the real-time thread begins with: the stored calibration, else the data sheet's.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> first() const { return published_; }

  void add(const FrameTracks& tracks);
  // True: the image of the frame added last is wanted as a keyframe; see add_keyframe().
  [[nodiscard]] bool wants_keyframe() const;
  void add_keyframe(const ImageView& image);  // copies the image
  void add(const PanTiltSample& sample);
  void video_lost();      // the next frame ends that state
  void telemetry_lost();  // the next sample ends that state

  // Whether work() would compute something.
  [[nodiscard]] bool due() const;
  // Does what is due. Null if nothing is to be published.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> work();

  [[nodiscard]] CalibrationReport report() const;
  // Thread-safe. Asks for a calibration of the motion from now on. It replaces the present one as
  // soon as it passes the checks of a first one. False: calibration is not automatic.
  [[nodiscard]] bool ask_for_fresh();

  // Thread-safe. Every work(), present or later, soon ends without a result.
  void cancel();
  // New lines for the log: what was found, why something was refused.
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
  // True: the delay wanders, and the frame cannot be used.
  bool judge_delay(const FrameTracks& tracks);
  void judge_agreement(const FrameTracks& tracks);
  [[nodiscard]] bool zoom_fits(const std::optional<double>& wanted) const;
  [[nodiscard]] bool is_calibrated_here() const;
  [[nodiscard]] bool storing_is_due() const;
  [[nodiscard]] bool adjusting_is_due() const;
  [[nodiscard]] bool makes_nodes() const { return zooms_ && zoom_.has_value(); }
  [[nodiscard]] bool first_node_is_wanted() const { return first_node_is_wanted_ && !zooms_; }
  [[nodiscard]] bool first_node_is_due() const { return zooms_ && first_node_.has_value(); }
  // Calibrates the session. known: the published calibration as prior; null: from the data alone.
  [[nodiscard]] CheckedCalibration adjust(const Calibration* known, bool free_centre) const;
  [[nodiscard]] CheckedCalibration adjust(const Calibration* known) const {
    return adjust(known, makes_nodes());
  }
  void make_first_node();
  void take_first_node();
  void try_first();
  void hold_against_published();
  void settle(CheckedCalibration checked);
  void refine_node(CheckedCalibration alone);
  void take_node(const ZoomAddition& addition, CheckedCalibration* checked);
  void contradict_nodes(const CheckedCalibration& alone, const std::string& why);
  void begin_nodes_anew(const CheckedCalibration& alone);
  void publish(const CheckedCalibration& checked);
  void store(const CalibrationResult& result, const MapState& map);
  void say_once(const std::string& line);

  SelfCalibrationOptions options_;
  CalibrationArchive* archive_;

  CalibrationSession session_;
  FrameTracks::Tracker tracker_ = FrameTracks::Tracker::kNone;  // of the session's points
  double began_s_ = 0;                                          // s, the session's first frame
  double last_try_s_ = 0;
  int tries_ = 0;

  // The first zoom's calibration once more, with a free optical centre. It becomes a node if
  // another zoom follows. It is made while its motion is at hand: keeping that would take more
  // memory than everything else here.
  struct FirstNode {
    std::string refusal;       // empty: it may become a node
    CalibrationResult result;  // only calibration, quality and exclusions are set
    MapState map;
    bool clock_holds = true;
  };

  SteadyZoom steady_zoom_;
  std::optional<double> zoom_;
  bool zooms_;  // the camera has more than one zoom
  ZoomNodes nodes_;
  bool first_node_is_wanted_ = false;    // from the present session
  std::optional<FirstNode> first_node_;  // until another zoom is seen
  double zoom_changed_s_ = -1e9;
  // s: since when readings differ, after they stood still: a glitch, or a movement.
  std::optional<double> odd_zoom_s_;
  double last_zoom_s_ = 0;
  double now_s_ = 0;  // s, the latest receive time of either stream
  double last_frame_s_ = 0;
  double last_sample_s_ = 0;
  bool video_is_lost_ = false;
  bool telemetry_is_lost_ = false;

  std::shared_ptr<const PublishedCalibration> published_;
  std::shared_ptr<const PublishedCalibration> next_;  // to be published
  bool clock_offset_known_ = true;  // the frames' clock has run on since the publication
  bool doubtful_ = false;
  std::vector<double> rejected_;  // zooms whose stored calibrations were withdrawn
  bool delay_wanders_ = false;
  // Half of the frames of 2 s, as docs/records.md says of `needs`.
  static constexpr DisagreementOptions kOldTelemetry = {/*span_s=*/2, /*share=*/0.5,
                                                        /*least_frames=*/5};
  DisagreementJudge old_telemetry_{kOldTelemetry};
  bool telemetry_is_old_ = false;
  ContradictionJudge contradiction_;
  DisagreementJudge disagreement_;
  double watch_interval_s_;

  CalibrationNeed need_ = CalibrationNeed::kNothing;
  double last_store_s_ = 0;
  std::atomic<bool> cancelled_{false};
  std::atomic<bool> fresh_asked_{false};
  bool fresh_wanted_ = false;  // a calibration that replaces the present one
  std::string said_;
  std::vector<std::string> messages_;
};

}  // namespace alidade
