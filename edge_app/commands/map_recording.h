#pragma once
// The pictures of a recording, each with what the recording's tables and a calibration say of it.
// Scene maps are built from such pictures, and such pictures are localized in scene maps.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/map_building.h"
#include "core/model/lens/zoom_curve.h"
#include "core/realtime/image/image_view.h"
#include "platform/storage/recording.h"

namespace alidade {

// The prior of log f for a zoom reading.
class FocalLengthKnowledge {
 public:
  // Nothing is known: one lens that does not zoom.
  FocalLengthKnowledge() = default;
  // From a calibration. With a curve, f follows the reading within the curve's range; outside of it
  // nothing is known. With an empty curve, the calibration's f holds for every reading.
  FocalLengthKnowledge(const Calibration& calibration, const ZoomCurve& curve);
  // From a data sheet: one focal length; or log f linear in the reading, beyond the two ends as
  // between them. The end readings (device units) must differ.
  explicit FocalLengthKnowledge(double px);
  FocalLengthKnowledge(double wide_px, double tele_px, double wide_reading, double tele_reading);

  // zoom: the reading, device units. Empty: not known, or a reading is needed and missing.
  [[nodiscard]] std::optional<FocalLengthPrior> at(const std::optional<double>& zoom) const;
  [[nodiscard]] bool needs_reading() const { return needs_reading_; }

 private:
  std::function<std::optional<FocalLengthPrior>(const std::optional<double>&)> at_;
  bool needs_reading_ = false;
};

// From the command line: --focal-length PX or WIDE:TELE takes precedence over the calibration.
// focal_length: the option's value; empty: not given. calibration: may be null. readings: those of
// all recordings; the least one belongs to WIDE, the greatest one to TELE. Throws CommandError.
[[nodiscard]] FocalLengthKnowledge focal_length_knowledge(const std::string& focal_length,
                                                          const Calibration* calibration,
                                                          const ZoomCurve& curve,
                                                          const std::vector<double>& readings);

// The tables of one recording.
struct MapRecording {
  std::string directory;
  RecordingInfo info;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> telemetry;  // by latest_time_s; empty: none, or not wanted

  // Those of the samples that have one, device units, in order of time.
  [[nodiscard]] std::vector<double> zoom_readings() const;
};

// Throws CommandError.
[[nodiscard]] MapRecording load_map_recording(const std::string& directory, bool with_telemetry);

// What is known of one frame. If `calibration` is null, the mechanics are nominal and the clock
// offset is 0. If the frame lies outside the telemetry's time span, the view has no telemetry, no
// zoom and no rates.
[[nodiscard]] MapView map_view(const MapRecording& recording, const FrameStamp& frame,
                               const Calibration* calibration, const FocalLengthKnowledge& known);

// Bounds the error of the motion that telemetry gives for one frame's read-out: the read-out time
// times the largest difference between the view's rates and the rates of telemetry's intervals
// around the frame. Around means 0.05 s with a calibration, 1 s without, as the clock offset is not
// known then. view: of this frame. line_delay: s/row; 0: not known; the result then bounds the
// motion itself, over 30 ms. kUnknownMotion: the frame has too little telemetry around it.
[[nodiscard]] MotionDoubt motion_doubt(const MapRecording& recording, const FrameStamp& frame,
                                       const Calibration* calibration,
                                       const FocalLengthKnowledge& known, const MapView& view,
                                       double line_delay);

// Calls use(index, image) for the pictures of these frames. frames: increasing indices into
// recording.frames; use gets one of them. A frame without a picture is skipped. The image is lent
// for the call. Throws CommandError.
void for_each_picture(const MapRecording& recording, const std::vector<std::size_t>& frames,
                      const std::function<void(std::size_t, const ImageView&)>& use);

// The features of a whole image.
[[nodiscard]] inline FeatureSet features_of(const FeatureDetector& detector,
                                            const ImageView& image) {
  return detector.find(image.luma, image.width, image.height, image.stride);
}

}  // namespace alidade
