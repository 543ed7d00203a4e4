#pragma once
// Recordings of the virtual camera (test/simulator) that zooms from dwell to dwell while it pans and tilts, as keypoint tracks in
// memory, with their truth. Pan and tilt go over as many fields of view at every zoom, as with a joystick whose speed follows
// the zoom. A lens of its own for each seed: axes, optical centre, its wander, repeatability.

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "core/calibration/calibrate.h"
#include "core/calibration/zoom_stretches.h"
#include "test/simulator/camera_model.h"
#include "test/simulator/config.h"

namespace alidade::test {

struct ZoomScenario {
  std::vector<double> focal_lengths = {1200, 2536, 5367, 11350, 24000};  // px, of the dwells
  double rest_s = 12;
  double sigma_rep = 0.002;
  double backlash = 0;    // of log f
  double late_s = 0;      // what is told of the zoom is older than the angles
  double centre_px = 20;  // how far the optical centre is off at the wide end
  double wander_px = 12;  // how far from there it goes
  double pixel_sigma = 0.1;
  double amplitude = 0.5;  // of the paper's path
  int cycles = 1;          // through the dwells; 2: back again, too
};

class ZoomRecording {
 public:
  ZoomRecording(const ZoomScenario& scenario, std::uint64_t seed);
  // Its path is referred to.
  ZoomRecording(const ZoomRecording&) = delete;
  ZoomRecording& operator=(const ZoomRecording&) = delete;
  ~ZoomRecording();

  [[nodiscard]] const CalibrationInput& input() const { return input_; }  // all of it
  [[nodiscard]] const std::vector<ZoomReading>& readings() const { return readings_; }

  // The truth.
  [[nodiscard]] const simulator::Config& config() const { return config_; }
  [[nodiscard]] const simulator::Zoom& zoom() const { return *camera_->zoom(); }
  [[nodiscard]] const simulator::CameraModel& camera() const { return *camera_; }

 private:
  simulator::Config config_;
  std::unique_ptr<simulator::Path> path_;
  std::unique_ptr<simulator::CameraModel> camera_;
  CalibrationInput input_;
  std::vector<ZoomReading> readings_;
};

}  // namespace alidade::test
