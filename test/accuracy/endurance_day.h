#pragma once
// VirtualDay: what the links of a virtual pan-tilt-zoom camera bring, in the order in which a host hears of
// it, with the truth about every frame. Rendered with the scene and the lens of test/simulator; truth comes
// from here and there alone.
//
//   R_base_from_camera = Rot(a_pan, pan) Rot(a_tilt, tilt) R_frd_from_rdf,   world = W base
//
// The head's axes stand still in its own frame h; its optics look past them by a small rotation D that
// moves with the zoom. The base frame is, as everywhere, aligned with the camera at zero pan and tilt: the axes
// are D^-1 of the head's, and W = B D, where B says how the mount stands in the world. A bump of the
// base is a step of B: every direction in the base frame shifts, axes stay. A bump of the camera on its
// mount is a step of D: axes change as well. Zoom and bumps step between frames, never within.
//
// Times: true time counts from 0. Host time (all stamps) is true time plus kHostEpoch. A frame is
// received `latency` after its row 0 plus a one-sided jitter; its sender's clock is skewed and begins anew at a
// reconnection, which brings another latency. Telemetry is polled; the value was true somewhere between
// request and answer. No device clock.
// Everything follows from the plan and its seed. render() may be called by several threads.

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/model/calibration.h"
#include "edge_app/record/published_calibration.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"
#include "test/simulator/camera_model.h"
#include "test/simulator/scene.h"
#include "test/simulator/telemetry.h"

namespace alidade::test {

struct DayPlan {
  enum class Motion { kMixed, kConstantVelocity, kAtRest };
  struct ZoomChange {
    double time_s = 0;  // begins; lasts kZoomRamp
    double to = 0;      // 0: wide, 1: narrow
  };
  struct Bump {
    enum class Kind { kBase, kCamera };
    Kind kind = Kind::kBase;
    double time_s = 0;
    double size = 5e-3;  // rad, about an axis oblique to all others
  };
  struct Loss {
    enum class Link { kVideo, kTelemetry };
    Link link = Link::kVideo;
    double from_s = 0, to_s = 0;
    double latency_change_s = 0;  // of video, from then on
  };

  std::string name;
  std::uint64_t seed = 1;
  double duration_s = 60;
  int width = 480;   // px
  int height = 270;  // px
  double rate_hz = 15;
  double telemetry_rate_hz = 25;
  double sender_skew = 50e-6;
  Motion motion = Motion::kMixed;
  bool plain_scene = false;
  std::vector<ZoomChange> zooms;
  std::vector<Bump> bumps;
  std::vector<Loss> losses;
};

[[nodiscard]] DayPlan hour_plan(DayPlan::Bump::Kind bump);
// Fewer and smaller images.
void make_coarse(DayPlan* plan);
// Everything that the hour has, within two and a half minutes.
[[nodiscard]] DayPlan small_day_plan();

// A minute that no calibration can be made of, and what is missing.
struct UnsuitableDay {
  DayPlan plan;
  CalibrationNeed need;
};
[[nodiscard]] std::vector<UnsuitableDay> unsuitable_days();

struct DayEvent {
  enum class Kind { kFrame, kSample, kVideoLost, kTelemetryLost };
  Kind kind = Kind::kFrame;
  double host_time_s = 0;  // when the host hears of it
  std::size_t index = 0;   // of frames() or samples()
};

// A happening of the plan, for reports.
struct DayMark {
  std::string name;
  double time_s = 0;  // when it is over: from then on the camera could be oriented again
};

class VirtualDay {
 public:
  static constexpr double kHostEpoch = 1000;  // s
  static constexpr double kZoomRamp = 1;      // s
  static constexpr double kWideZoom = 1000;   // device units
  static constexpr double kNarrowZoom = 6000;

  // scenes: the folder with the photos of the scene.
  VirtualDay(const DayPlan& plan, const std::filesystem::path& scenes);

  [[nodiscard]] const DayPlan& plan() const { return plan_; }
  [[nodiscard]] const std::vector<DayEvent>& events() const { return events_; }
  [[nodiscard]] const std::vector<FrameStamp>& frames() const { return frames_; }
  [[nodiscard]] const std::vector<PanTiltSample>& samples() const { return samples_; }
  [[nodiscard]] std::vector<DayMark> marks() const;

  // width x height bytes, row after row.
  void render(std::size_t frame, std::uint8_t* image) const;

  // Truth about a frame. time_s is the capture of row coordinate 0, true time.
  [[nodiscard]] double time(std::size_t frame) const { return captures_[frame].time_s; }
  [[nodiscard]] Eigen::Matrix3d base_from_camera(std::size_t frame, double row) const;
  [[nodiscard]] simulator::Angles angles(double time_s) const { return path_->at(time_s); }
  // Of a pixel, in the base frame, at its own row's time.
  [[nodiscard]] Eigen::Vector3d direction(std::size_t frame, const Eigen::Vector2d& u) const;
  // As an estimator is told it: without any uncertainty.
  [[nodiscard]] Calibration calibration(std::size_t frame) const;
  [[nodiscard]] double zoom(std::size_t frame) const { return zoom_at(time(frame)); }
  [[nodiscard]] double telemetry_sigma() const { return telemetry_sigma_; }  // rad
  // Largest acceleration of an axis to expect, rad/s^2, one sigma.
  [[nodiscard]] double acceleration_sigma() const;

 private:
  struct Capture {
    double time_s;
    double latency_s;  // the least one
  };
  // The camera during one frame.
  struct Optics {
    double focal_length;
    double radial_distortion;
    Eigen::Matrix3d boresight;  // D
    Eigen::Matrix3d mount;      // B
  };

  [[nodiscard]] double zoom_part(double time_s) const;  // 0: wide, 1: narrow
  [[nodiscard]] double zoom_at(double time_s) const;    // device units
  [[nodiscard]] Optics optics_at(double time_s) const;
  [[nodiscard]] std::shared_ptr<const simulator::CameraModel> lens_at(double time_s) const;
  [[nodiscard]] Eigen::Matrix3d head_from_camera(const Optics& optics, double time_s) const;
  void make_events();
  void make_frames();
  void make_samples();

  DayPlan plan_;
  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  std::unique_ptr<simulator::Scene> scene_;
  std::shared_ptr<const simulator::CameraModel> wide_, narrow_;
  double telemetry_sigma_;
  std::vector<float> noise_;
  std::vector<FrameStamp> frames_;
  std::vector<Capture> captures_;
  std::vector<PanTiltSample> samples_;
  std::vector<DayEvent> events_;
};

}  // namespace alidade::test
