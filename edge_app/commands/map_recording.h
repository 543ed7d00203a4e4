#pragma once
// What a scene map is made of and asked about: the pictures of a recording, with what its tables and a calibration say of each.

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/mapping/features.h"
#include "core/mapping/map_building.h"
#include "core/model/zoom_curve.h"
#include "core/realtime/image/image_view.h"
#include "platform/storage/recording.h"

namespace alidade {

// How a zoom reading, where there is one, tells log f.
class FocalLengthKnowledge {
 public:
  // Nothing is known: one lens that does not zoom.
  FocalLengthKnowledge() = default;
  // A calibration's, at all readings if it has a curve.
  FocalLengthKnowledge(const Calibration& calibration, const ZoomCurve& curve);
  // A data sheet's: one for all, or from the widest reading to the longest.
  explicit FocalLengthKnowledge(double px);
  FocalLengthKnowledge(double wide_px, double tele_px, double wide_reading, double tele_reading);

  // None: not known, or no reading where one is needed.
  [[nodiscard]] std::optional<FocalLengthPrior> at(const std::optional<double>& zoom) const;
  [[nodiscard]] bool needs_reading() const { return needs_reading_; }

 private:
  std::function<std::optional<FocalLengthPrior>(const std::optional<double>&)> at_;
  bool needs_reading_ = false;
};

// From what the command line says (a calibration, and --focal-length PX or WIDE:TELE before it); readings: all that there are. Throws
// CommandError.
[[nodiscard]] FocalLengthKnowledge focal_length_knowledge(const std::string& focal_length,
                                                          const Calibration* calibration,
                                                          const ZoomCurve& curve,
                                                          const std::vector<double>& readings);

// The tables of one recording.
struct MapRecording {
  std::string directory;
  RecordingInfo info;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> telemetry;  // empty: none, or not wanted

  [[nodiscard]] std::vector<double> zoom_readings() const;
};

// Throws CommandError.
[[nodiscard]] MapRecording load_map_recording(const std::string& directory, bool with_telemetry);

// What is known of one frame. calibration may be null: nominal mechanics, clocks as they are.
[[nodiscard]] MapView map_view(const MapRecording& recording, const FrameStamp& frame,
                               const Calibration* calibration, const FocalLengthKnowledge& known);

// What telemetry does not know of the camera's motion while one frame is read out: what its rates
// differ by about that time, the wider where no calibration tells its clock. view: of this frame.
// line_delay: s/row; 0: not known, and view's rates tell nothing but a bound.
[[nodiscard]] MotionDoubt motion_doubt(const MapRecording& recording, const FrameStamp& frame,
                                       const Calibration* calibration,
                                       const FocalLengthKnowledge& known, const MapView& view,
                                       double line_delay);

// use(frame, luma) for the pictures of these frames, increasing places in recording.frames. Throws CommandError.
void for_each_picture(const MapRecording& recording, const std::vector<std::size_t>& frames,
                      const std::function<void(std::size_t, const ImageView&)>& use);

[[nodiscard]] inline FeatureSet features_of(const FeatureDetector& detector,
                                            const ImageView& image) {
  return detector.find(image.luma, image.width, image.height, image.stride);
}

}  // namespace alidade
