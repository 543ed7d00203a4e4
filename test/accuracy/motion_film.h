#pragma once
// A film of the virtual camera with small things that move in it, and the truth about them, for judging what finds such things.
//   camera   1280x720 at 25 Hz, 3.4 degrees wide, 7 % of distortion in the corners, read out by -14.2 us a row, exposure 2 ms; it pans at
//            a constant speed, or back and forth
//   scene    a photo with generated contrast at the scales that it lacks, rendered by test/simulator
//   targets  discs that move along straight lines on the sphere, 20 to 150 px/s, so dense that as many as asked for are in view; each is as much
//            brighter or darker than the scene behind it as asked for. Painted into the rendered picture: mean over each pixel's
//            area (8x8 points) and the exposure, every row at its own time
//   then     white noise, JPEG
// A target counts while all of it is in the picture and no other is near. No code of core/ but what estimators are told.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/realtime/frame_orientation.h"
#include "test/accuracy/rendered_recording.h"

namespace alidade::test {

struct MotionFilmPlan {
  std::string name;                // of its scene and path: of what is kept of it
  std::filesystem::path photo;     // empty: generated
  double fields_per_second = 0.5;  // horizontal
  bool back_and_forth = false;     // that at most, as a cosine; else always
  double duration_s = 3;
  double size_px = 8;     // diameter
  double contrast = 30;   // grey levels
  int targets = 6;        // in view, on average
  double noise = 2;       // grey levels
  int jpeg_quality = 90;  // 0: none
  double sigma_orientation_px =
      0.05;  // of each frame's pan and tilt, and of what their rates make of the last row
  std::uint64_t seed = 1;
};

struct TrueTarget {
  Eigen::Vector2d centre;  // px
  double size_px;
  bool counts;  // else it is neither to be found nor a false alarm
};

class MotionFilm {
 public:
  MotionFilm(const MotionFilmPlan& plan, const std::filesystem::path& kept);

  [[nodiscard]] int size() const { return recording_->size(); }
  [[nodiscard]] double time_s(int frame) const { return recording_->time(frame); }
  [[nodiscard]] cv::Mat image(int frame) const;
  [[nodiscard]] std::vector<TrueTarget> truth(int frame) const;
  // As an estimator would tell it, with the errors of the plan.
  [[nodiscard]] FrameOrientation orientation(int frame) const;

 private:
  struct Mover {
    double pan, tilt, pan_rate,
        tilt_rate;    // rad, rad/s: its direction as of a camera that looks at it
    double brighter;  // grey levels
  };

  // Where it is at that time while row `row` is exposed at it.
  [[nodiscard]] bool place_at(const Mover& mover, double time_s, Eigen::Vector2d* u) const;
  // In a frame, its row at its own time, shifted by part of the exposure.
  [[nodiscard]] bool place_in(const Mover& mover, int frame, double shift_s,
                              Eigen::Vector2d* u) const;
  void paint(const Mover& mover, int frame, cv::Mat* image) const;

  MotionFilmPlan plan_;
  std::unique_ptr<RenderedRecording> recording_;
  std::vector<Mover> movers_;
};

}  // namespace alidade::test
