#pragma once
// SelfCalibration: the work of the calibration thread. Pure: no thread, no clock of its own, no
// files except through the CalibrationArchive; a simulation runs it step by step. It collects
// tracks, telemetry and keyframes of the latest motion. As soon as new data promises more than the
// last try, it calibrates; a result that passes the checks is published with its map. It tests the
// published calibration against later motion, refines it or withdraws it. Each zoom has its own
// calibration; those of several zooms become nodes of a zoom curve. While the video's delay
// wanders, nothing is calibrated or withdrawn; a calibration that was just contradicted gets larger
// sigmas. Step by step: docs/derivations.md. Allocates; work() takes seconds. One thread.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/record/published_calibration.h"
#include "edge_app/self_calibration/calibration_archive.h"
#include "edge_app/self_calibration/calibration_progress.h"
#include "edge_app/self_calibration/calibration_schedule.h"
#include "edge_app/self_calibration/calibration_session.h"
#include "edge_app/self_calibration/calibration_watch.h"
#include "edge_app/self_calibration/checked_calibration.h"
#include "edge_app/self_calibration/message_list.h"
#include "edge_app/self_calibration/present_zoom.h"
#include "edge_app/self_calibration/publication.h"
#include "edge_app/self_calibration/stream_watch.h"
#include "edge_app/self_calibration/try_pace.h"
#include "edge_app/self_calibration/zoom_nodes.h"
#include "edge_app/step/calibration_feed.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct SelfCalibrationOptions {
  Calibration data_sheet;         // with the image size; used while there is no calibration
  CalibrationOptions adjustment;  // priors of a first calibration
  KnownCamera camera;             // what else is known of the camera
  CalibrationNoise noise;
  // Device units: readings no further apart are one zoom. Empty: found from their jitter.
  std::optional<double> zoom_tolerance;
  bool zooms = false;  // the camera is known to zoom; if not, a second reading will show it
  SessionLimits session;
  CalibrationSchedule schedule;
  CalibrationChecks checks;
  ContradictionOptions contradiction;
  DisagreementOptions disagreement;
  bool automatic = true;  // false: only stored calibrations are used
};

class SelfCalibration {
 public:
  // archive: borrowed; null: nothing is stored.
  SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive);

  // The calibration with which the real-time thread begins: the stored one, else the data sheet's.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> first() const {
    return publication_.object();
  }

  void add(const FrameTracks& tracks);
  // True: the image of the frame added last is wanted as a keyframe; see add_keyframe().
  [[nodiscard]] bool wants_keyframe() const;
  // Copies the image. frame: its number. Nothing is kept of a frame that the session did not take,
  // such as one of an unknown time.
  void add_keyframe(std::int64_t frame, const ImageView& image);
  void add(const PanTiltSample& sample);
  void video_lost() { streams_.lose_video(); }          // the next frame ends that state
  void telemetry_lost() { streams_.lose_telemetry(); }  // the next sample ends that state

  // Whether work() would compute something.
  [[nodiscard]] bool due() const;
  // Does what is due. Returns the calibration to publish; null: nothing is to be published.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> work();

  [[nodiscard]] CalibrationReport report() const;
  // How far the first calibration is, or the fresh one that was asked for; empty: none is wanted.
  // Costs a pass over the session.
  [[nodiscard]] std::optional<CalibrationProgress> progress() const;
  // Thread-safe. Asks for a new calibration, from the motion from now on. The new calibration
  // replaces the present one as soon as it passes the checks of a first calibration. False:
  // calibration is not automatic.
  [[nodiscard]] bool ask_for_fresh();

  // Thread-safe. Every work(), present or later, soon ends without a result.
  void cancel();
  // The lines for the log since the last call: what was found, why something was refused.
  [[nodiscard]] std::vector<CalibrationMessage> take_messages() { return messages_.take(); }

 private:
  void begin_anew();
  void begin_fresh();
  void judge_zoom(const PanTiltSample& sample);
  void take_jitter();
  void clock_began_anew();
  void look_for_stored();
  // True: the delay wanders, and the frame cannot be used.
  bool judge_delay(const FrameTracks& tracks);
  void widen_contradicted();
  void judge_agreement(const FrameTracks& tracks);
  // Takes the published calibration back and begins anew. reason, question: for the message.
  void withdraw(const std::string& reason, const std::string& question);
  [[nodiscard]] bool is_calibrated_here() const;
  // The curve tells the lens of the present reading, as while the zoom moves.
  [[nodiscard]] bool is_on_curve() const;
  [[nodiscard]] bool is_known_here() const { return is_calibrated_here() || is_on_curve(); }
  [[nodiscard]] bool wants_first() const {
    return !is_calibrated_here() || publication_.is_fresh_wanted();
  }
  [[nodiscard]] CalibrationNeed missing_motion() const;
  [[nodiscard]] bool storing_is_due() const;
  [[nodiscard]] bool adjusting_is_due() const;
  [[nodiscard]] bool makes_nodes() const { return zooms_ && zoom_.reading().has_value(); }
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

  // The first zoom's calibration once more, with a free optical centre. It becomes a node if
  // another zoom follows. It is made while its motion is at hand: keeping the motion would take
  // more memory than everything else here.
  struct FirstNode {
    std::string refusal;       // empty: it may become a node
    CalibrationResult result;  // only calibration, quality and exclusions are set
    MapState map;
    bool clock_holds = true;
  };

  SelfCalibrationOptions options_;
  CalibrationArchive* archive_;
  double last_store_s_ = 0;

  StreamWatch streams_;
  CalibrationSession session_;
  FrameTracks::Tracker tracker_ = FrameTracks::Tracker::kNone;  // of the session's points
  TryPace pace_;
  // What the last try for a first calibration gave. Without goals: it did not come so far.
  CalibrationNeed need_ = CalibrationNeed::kNothing;
  std::string refusal_;
  std::optional<ParameterGoals> goals_;

  PresentZoom zoom_;
  bool zooms_;  // the camera has more than one zoom
  ZoomNodes nodes_;
  bool first_node_is_wanted_ = false;    // from the present session
  std::optional<FirstNode> first_node_;  // until another zoom is seen

  Publication publication_;
  ContradictionJudge contradiction_;
  DisagreementJudge disagreement_;

  std::atomic<bool> cancelled_{false};
  std::atomic<bool> fresh_asked_{false};
  MessageList messages_;
};

}  // namespace alidade
