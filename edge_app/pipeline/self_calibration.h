#pragma once
// SelfCalibration: what the calibration thread does with what the real-time thread tells it. Pure: no thread, no
// clock of its own, no files but through the CalibrationArchive it is given; a simulation runs it step by step.
//
//   collects   tracks, telemetry and some pictures (keyframes) of the latest motion, in bounded memory;
//              anew after a reconnection, a change of zoom, or a restart of the tracker
//   adjusts    calibrate() as soon as more data promises more than the last try: frames held out are
//              predicted, and residuals, sufficiency and hold-out decide whether it is published
//   maps       the keyframes once more, with the new calibration and trajectory: the map in the base frame
//   watches    later motion is calibrated on its own and held against what is published: it refines it, or
//              contradicts it; where landmarks and telemetry disagree for long, the calibration is withdrawn
//   zoom       one calibration for each; the stored one is used when the camera returns
//
// Allocates; work() takes seconds. One thread.

#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/realtime/image/image_view.h"
#include "edge_app/pipeline/calibration_archive.h"
#include "edge_app/pipeline/calibration_feed.h"
#include "edge_app/pipeline/published_calibration.h"
#include "platform/pan_tilt/pan_tilt_source.h"

namespace alidade {

struct SelfCalibrationOptions {
  Calibration data_sheet;         // with the image size; what holds without a calibration
  CalibrationOptions adjustment;  // priors of a first calibration
  CalibrationNoise noise;
  double zoom_tolerance = 0;  // device units within which a calibration holds
  double first_try_s = 6;     // of data
  double window_s = 40;       // the data kept, at most
  std::size_t max_frames = 1500;
  std::size_t max_keyframes = 16;
  bool automatic = true;  // false: stored calibrations only
};

class SelfCalibration {
 public:
  // archive: borrowed; null: nothing is kept.
  SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive);
  ~SelfCalibration();

  // What the real-time thread begins with: the stored calibration, or the data sheet's.
  [[nodiscard]] std::shared_ptr<const PublishedCalibration> first();

  void add(const FrameTracks& tracks);
  // True: the picture of the frame last added is wanted as a keyframe, see add_keyframe().
  [[nodiscard]] bool wants_keyframe() const;
  void add_keyframe(const ImageView& picture);  // copies it
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
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
