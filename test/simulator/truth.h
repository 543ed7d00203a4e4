#pragma once
// truth.yaml and truth.csv: what an estimator should have found. For evaluation only.
//
// truth.yaml holds the camera under the names of calibration.yaml, every sigma 0, so that it serves
// as a perfect calibration too. truth.csv has one line a frame:
//   frame        0, 1, 2, ... of the frames delivered
//   time_s       when row coordinate 0 was exposed: on the image clock in a recording, on the
//                host's CLOCK_MONOTONIC when live
//   pan_rad, tilt_rad   true angles at that time, wrapped to [-pi, pi)
//   sequence     counts the lost frames too
//   sender_time_s       the same moment on the sender's own, perhaps skewed clock
//   stamp_time_s        recording: the stamp in frames.csv; live: when the frame is handed out
//   focal_length_px, radial_distortion, centre_u_px, centre_v_px
//                with a zoom or where it breathes: the true lens at that time
//   q_x, q_y, q_z, q_w
//                where the mast sways: the camera's true orientation in the world
//                (R_world_from_camera) at that time; pan and tilt are then those of the
//                head in its base
//   zoom         with a zoom: the true reading, between steps too
// With a zoom truth.yaml tells the lens at time 0, its reading (zoom), and besides zoom_samples, a
// list over the whole range of what the lens is at a reading (zoom, focal_length,
// radial_distortion, centre_offset) if it comes back exactly. What a camera is beyond a
// calibration's names stands under `departures`, in SI, only where it is stated (README.md). Before
// a pattern truth.yaml holds the lens under the names of lens.yaml, and truth.csv the camera's pose
// in the pattern's frame (x_m, y_m, z_m, q_x, q_y, q_z, q_w) in place of angles.

#include <filesystem>
#include <fstream>

#include "test/simulator/camera_model.h"
#include "test/simulator/pattern_camera.h"
#include "test/simulator/timeline.h"

namespace alidade::simulator {

// Throws std::runtime_error naming the file if it cannot be written; so do the others here.
void write_truth_yaml(const std::filesystem::path& file, const Config& config,
                      const CameraModel& camera);

// config.pattern must be set.
void write_lens_yaml(const std::filesystem::path& file, const Config& config);

// An output file with its name, that notices when writing fails.
class OutputFile {
 public:
  explicit OutputFile(const std::filesystem::path& file);
  std::ofstream& stream() { return stream_; }
  // Also checks for errors.
  void flush();

 private:
  std::filesystem::path file_;
  std::ofstream stream_;
};

class TruthCsv {
 public:
  // The camera must outlive this.
  TruthCsv(const std::filesystem::path& file, const CameraModel& camera);
  // The times of the event are shifted by origin_s: 0 in a recording.
  void add(const FrameEvent& event, const Angles& angles, double origin_s);
  void flush() { file_.flush(); }

 private:
  OutputFile file_;
  const CameraModel* camera_;
  bool tells_lens_;
};

// The same before a pattern.
class PatternTruthCsv {
 public:
  explicit PatternTruthCsv(const std::filesystem::path& file);
  void add(const FrameEvent& event, const CameraPose& pose, double origin_s);
  void flush() { file_.flush(); }

 private:
  OutputFile file_;
};

}  // namespace alidade::simulator
