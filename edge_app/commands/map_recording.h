#pragma once
// The pictures of a recording, with what its tables and a calibration state for each. Scene maps
// are built from them, and they are localized in scene maps.

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
  // From a calibration; for all readings if it has a curve.
  FocalLengthKnowledge(const Calibration& calibration, const ZoomCurve& curve);
  // From a data sheet: one focal length, or log f linear in the reading between the two ends.
  explicit FocalLengthKnowledge(double px);
  FocalLengthKnowledge(double wide_px, double tele_px, double wide_reading, double tele_reading);

  // Empty: not known, or a reading is needed and missing.
  [[nodiscard]] std::optional<FocalLengthPrior> at(const std::optional<double>& zoom) const;
  [[nodiscard]] bool needs_reading() const { return needs_reading_; }

 private:
  std::function<std::optional<FocalLengthPrior>(const std::optional<double>&)> at_;
  bool needs_reading_ = false;
};

// From the command line: --focal-length PX or WIDE:TELE takes precedence over the calibration.
// readings: those of all recordings. Throws CommandError.
[[nodiscard]] FocalLengthKnowledge focal_length_knowledge(const std::string& focal_length,
                                                          const Calibration* calibration,
                                                          const ZoomCurve& curve,
                                                          const std::vector<double>& readings);

// The tables of one recording.
struct MapRecording {
  std::string directory;
  RecordingInfo info;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> telemetry;  // by time; empty: none, or not wanted

  [[nodiscard]] std::vector<double> zoom_readings() const;
};

// Throws CommandError.
[[nodiscard]] MapRecording load_map_recording(const std::string& directory, bool with_telemetry);

// What is known of one frame. If `calibration` is null, the mechanics are nominal and the clock
// offset is 0.
[[nodiscard]] MapView map_view(const MapRecording& recording, const FrameStamp& frame,
                               const Calibration* calibration, const FocalLengthKnowledge& known);

// Bounds the error of the camera's motion that telemetry gives for the read-out of one frame: by
// how much its rates differ about that time. The time window is wider without a calibration, as the
// clock offset is then not known. view: of this frame. line_delay: s/row; 0: not known, then the
// rates only give a bound of the motion.
[[nodiscard]] MotionDoubt motion_doubt(const MapRecording& recording, const FrameStamp& frame,
                                       const Calibration* calibration,
                                       const FocalLengthKnowledge& known, const MapView& view,
                                       double line_delay);

// Calls use(frame, image) for the pictures of these frames. frames: increasing indices into
// recording.frames. A frame without a picture is skipped. Throws CommandError.
void for_each_picture(const MapRecording& recording, const std::vector<std::size_t>& frames,
                      const std::function<void(std::size_t, const ImageView&)>& use);

[[nodiscard]] inline FeatureSet features_of(const FeatureDetector& detector,
                                            const ImageView& image) {
  return detector.find(image.luma, image.width, image.height, image.stride);
}

}  // namespace alidade
