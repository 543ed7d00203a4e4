#pragma once
// OE mode: a frame's orientation from telemetry and from landmarks seen in the frame, to a few hundredths
// of a pixel (PTCEE sections V-A, V-C).
//
//   process()   1 predict pan and tilt from telemetry (and, without it, from the frames before)
//               2 coarse alignment over pan and tilt, coarse to fine (PTCEE 30, 31)
//               3 project the map's landmarks with rolling shutter, align each patch (PTCEE 32, 33)
//               4 solve angle, rate and acceleration of pan and tilt, and the offset of map against
//                 telemetry, robustly, with telemetry as prior (PTCEE 35)
//   maintain()  after the answer is out: refines and retires landmarks, and makes new ones where
//               cells are empty (PTCEE 36)
//
// One estimator for OE and PT: without landmarks the solution is telemetry's, with its covariance. Where
// landmarks contradict telemetry beyond what both claim, the answer is telemetry's with a covariance
// that covers both, and the mode is PT.
// How map, offset and answer follow the calibration they were found with is carried along (Sensitivity),
// and what its covariance makes of that is in the answer's.
// The map begins empty, in the frame that the first telemetry gave it, or as another OeMode left it. Its
// offset from the base frame (pan, tilt) is estimated from all telemetry since.
// What was handed over is believed as far as pictures bear it out: a map that telemetry contradicts is
// forgotten after 50 frames, as is, after 50 frames that show other things, what should be in view of it.
// Fixed memory, taken by the constructor; nothing else allocates, waits or throws. One thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "core/model/calibration.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/oe_mode/landmark_map.h"
#include "core/realtime/oe_mode/map_state.h"
#include "core/realtime/telemetry/telemetry_interpolation.h"

namespace alidade {

struct OeOptions {
  int max_width = 1920;      // px
  int max_height = 1080;     // px
  int max_landmarks = 4096;  // in the map
  int max_used = 200;        // aligned in a frame; at most kMaxUsed
  double cell_size_px = 80;  // of the map's cells, px of a landmark's octave at the image's centre
  int max_new = 100;         // landmarks that one maintain() may make; all, in an empty view
  std::uint8_t corner_threshold = 10;  // of FAST, grey levels
};

enum class OeStatus {
  kOk,             // orientation from landmarks and telemetry
  kTooFew,         // too few landmarks held: telemetry alone
  kContradiction,  // landmarks and telemetry exclude each other: telemetry, with room for both
  kNoPrediction,   // neither telemetry nor a frame before: nothing is written
  kBadImage,       // none, or not of the calibration's size: telemetry alone
  kNotFinite       // nothing is written
};

// One landmark in one frame.
struct OeObservation {
  int slot = 0;          // of the map
  std::uint32_t id = 0;  // of the landmark
  int octave = 0;
  Vector2<double> u = Vector2<double>::Zero();           // px of the image, where it was found
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2, of u
  Vector2<double> residual = Vector2<double>::Zero();  // px, found minus predicted by the solution
  bool inlier = false;
};

struct OeStatistics {
  OeStatus status = OeStatus::kNoPrediction;
  int visible = 0;             // landmarks of the map that the prediction puts into the image
  int looked_for = 0;          // of these, up to max_used
  int aligned = 0;             // found by patch alignment
  int inliers = 0;             // that agree with the solution
  double coarse_shift_px = 0;  // by which coarse alignment moved the prediction, image centre
  PanTilt<double> map_offset;  // rad, base minus map
  Matrix2<double> map_offset_covariance = Matrix2<double>::Zero();
};

class OeMode {
 public:
  static constexpr int kMaxUsed = 1024;
  static constexpr std::size_t kRemembered = 32;

  explicit OeMode(const OeOptions& options);
  ~OeMode();
  OeMode(const OeMode&) = delete;
  OeMode& operator=(const OeMode&) = delete;

  // Begins anew: empty map, nothing remembered. Real-time safe.
  void reset(const Calibration& calibration);
  // The same, but with this map, made with this calibration, by this mount without a restart that
  // moved its zero; it is in OE mode in its first frame. Landmarks that make no sense, or that there is
  // no room for, are left out; a map whose offset makes no sense is none. Real-time safe: 0.3 us a landmark.
  void reset(const Calibration& calibration, const MapState& map);

  // frame_time_s: t0, row 0 on the image clock. at_middle_row: telemetry at t0 + clock_offset +
  // line_delay * height / 2, null if there is none. The image must outlive the maintain() that
  // follows. *out is written with every status but kNoPrediction and kNotFinite.
  // Extrapolated telemetry is a prior for this frame only: the map's offset learns nothing from it.
  [[nodiscard]] OeStatus process(const ImageView& image, double frame_time_s,
                                 const InterpolatedPanTilt* at_middle_row, FrameOrientation* out);

  // Telemetry, now interpolated, for one of the latest kRemembered frames, which extrapolated telemetry
  // answered: the map's offset learns from it. A frame that is not remembered, or was told already, is
  // ignored. Where such telemetry contradicts landmarks, so do the frames that follow it.
  void add_late_telemetry(double frame_time_s, const InterpolatedPanTilt& at_middle_row);

  // Map upkeep with the frame last processed; does nothing where that had no sure orientation.
  void maintain();

  // Of the frame last processed.
  [[nodiscard]] const OeStatistics& statistics() const;
  [[nodiscard]] const OeObservation* observations() const;  // statistics().aligned of them
  [[nodiscard]] const LandmarkMap& map() const;

  // For another OeMode, or for the next start. Allocates: not for the real-time thread.
  [[nodiscard]] MapState map_state() const;

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace alidade
