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
  // at() is always empty: the focal length is not known. For a lens that does not zoom.
  FocalLengthKnowledge() = default;
  // From a calibration. With a curve, f follows the reading within the curve's range; outside of it
  // nothing is known. With an empty curve, the calibration's f holds for every reading.
  FocalLengthKnowledge(const Calibration& calibration, const ZoomCurve& curve);
  // From a data sheet, px, > 0: one focal length (sigma of log f 0.02), or log f as a linear
  // function of the reading (sigma 0.1), which also holds beyond its two ends. The end readings
  // (device units) must differ.
  explicit FocalLengthKnowledge(double px);
  FocalLengthKnowledge(double wide_px, double tele_px, double wide_reading, double tele_reading);

  // zoom: the reading, device units. Empty: not known, or a reading is needed and missing or
  // outside the curve.
  [[nodiscard]] std::optional<FocalLengthPrior> at(const std::optional<double>& zoom) const;
  [[nodiscard]] bool needs_reading() const { return needs_reading_; }

 private:
  std::function<std::optional<FocalLengthPrior>(const std::optional<double>&)> at_;
  bool needs_reading_ = false;
};

// From the command line: --focal-length PX or WIDE:TELE takes precedence over the calibration.
// focal_length: the option's value; empty: not given. calibration: may be null. readings: those of
// all recordings; the least one belongs to WIDE, the greatest one to TELE. Throws
// CommandError if the value cannot be read or does not suit the readings, or if the readings differ
// and nothing gives f for them.
[[nodiscard]] FocalLengthKnowledge focal_length_knowledge(const std::string& focal_length,
                                                          const Calibration* calibration,
                                                          const ZoomCurve& curve,
                                                          const std::vector<double>& readings);

// The tables of one recording.
struct MapRecording {
  std::string directory;
  RecordingInfo info;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> telemetry;  // by latest_time_s; may be empty
  bool has_angles = true;                // false: of the telemetry only the zoom readings count
  double angle_noise = 0;                // rad, of one angle, by the telemetry itself

  // Device units, in order of time. Samples without a reading are left out.
  [[nodiscard]] std::vector<double> zoom_readings() const;
};

// Reads the tables, sorts telemetry and removes the jitter of its zoom readings (steady_zoom()).
// Throws CommandError if a table is malformed, or if there are no pictures or no frames.
[[nodiscard]] MapRecording load_map_recording(const std::string& directory, bool with_angles);

// What is known of one frame. If `calibration` is null, the mechanics are nominal and the clock
// offset is 0. If the frame lies outside the telemetry's time span, the view has no telemetry, no
// zoom and no rates. Rates without telemetry have sigmas of half a field of view a second.
[[nodiscard]] MapView map_view(const MapRecording& recording, const FrameStamp& frame,
                               const Calibration* calibration, const FocalLengthKnowledge& known);

// How far the motion in `view` may be wrong over the frame's read-out. view: the result of
// map_view() for this frame. turn = read-out time x (largest difference between view's rates and
// those of the telemetry around the frame + 2 % of the largest of these rates); log f likewise.
// "Around" is within 0.05 s with a calibration, within 1 s without, as the clock offset is then not
// known. line_delay: s/row; 0: not known; the result is then the largest rate x 30 ms.
// kUnknownMotion: too little telemetry there. log_f stays infinite if a sample there has no zoom
// reading or the reading no f.
[[nodiscard]] MotionDoubt motion_doubt(const MapRecording& recording, const FrameStamp& frame,
                                       const Calibration* calibration,
                                       const FocalLengthKnowledge& known, const MapView& view,
                                       double line_delay);

// Calls use(index, image) for the pictures of these frames. frames: increasing indices into
// recording.frames; use gets one of them. A frame without a picture is skipped. The image is lent
// for the call. Throws CommandError if the pictures cannot be read on.
void for_each_picture(const MapRecording& recording, const std::vector<std::size_t>& frames,
                      const std::function<void(std::size_t, const ImageView&)>& use);

// The features of a whole image.
[[nodiscard]] inline FeatureSet features_of(const FeatureDetector& detector,
                                            const ImageView& image) {
  return detector.find(image.luma, image.width, image.height, image.stride);
}

}  // namespace alidade
