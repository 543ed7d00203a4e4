#pragma once
// StartUpTracker: keypoint tracks from the video of an uncalibrated camera, for the first
// calibration (PTCEE section V-A). Uses no focal length, distortion, read-out, mount or telemetry.
// An observation is the place of a landmark in a frame: px, as in CONVENTIONS.md. Its covariance is
// that of errors which differ between the observations of a landmark (docs/derivations.md). A point
// ends if it leaves the image, is warped too far, keeps moving against the others, or is not found
// in two successive frames; later it is a new landmark. Shifts of up to a third of the image
// between frames are followed; frames with nothing in common end all points. Only the constructor
// allocates; nothing waits or throws after it. One thread.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/model/linear_algebra.h"
#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/image_view.h"
#include "core/realtime/image/pyramid.h"
#include "core/realtime/image/reference_image.h"
#include "core/realtime/start_up/smooth_flow.h"

namespace alidade {

struct StartUpOptions {
  int width = 1920;                    // px, of every frame
  int height = 1080;                   // px
  int max_points = 250;                // followed at a time
  std::uint8_t corner_threshold = 10;  // grey levels, of FAST; raised by noise
};

struct TrackObservation {
  std::uint32_t landmark = 0;                            // never reused
  Vector2<double> u = Vector2<double>::Zero();           // px
  Matrix2<double> covariance = Matrix2<double>::Zero();  // px^2
  double sigma = 0;                                      // px, sqrt(trace / 2)
};

enum class StartUpStatus {
  kOk,
  kBegun,    // no points to follow, or all were lost twice in a row; all are new
  kLost,     // the points were not found; the next frame is compared with the same previous frame
  kBlank,    // nothing to follow and nothing new
  kBadImage  // no image, another size than the constructor's, or below 64 x 32 px
};

struct StartUpStatistics {
  StartUpStatus status = StartUpStatus::kBlank;
  int looked_for = 0;  // points expected inside the image
  int found = 0;       // found by alignment
  int believed = 0;    // agreed with the others
  int ended = 0;
  int begun = 0;
  Vector2<double> shift =
      Vector2<double>::Zero();  // px since the previous frame, at the image's centre
  double noise = 0;             // grey levels, of a pixel
};

class StartUpTracker {
 public:
  explicit StartUpTracker(const StartUpOptions& options);
  StartUpTracker(const StartUpTracker&) = delete;
  StartUpTracker& operator=(const StartUpTracker&) = delete;

  // Steps:
  //   1 shift of the whole image since the previous frame, to a pixel of a small octave
  //   2 motion of the points, coarse to fine, as one smooth function (smooth_flow.h)
  //   3 each point is aligned with its first image, warped by the gradients of the motion since
  //     then, so that nothing drifts (patch_alignment.h)
  //   4 points that contradict the others' motion are rejected
  //   5 new points, FAST corners, are made at places without any
  // The image is used during the call only.
  [[nodiscard]] StartUpStatus process(const ImageView& image);

  // Results of the last processed frame.
  [[nodiscard]] const TrackObservation* observations() const { return observations_.data(); }
  [[nodiscard]] int observation_count() const { return observation_count_; }
  [[nodiscard]] const StartUpStatistics& statistics() const { return statistics_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr int kReferenceOctaves = 2;  // points are corners of octave 0 or 1

  struct Point {
    std::uint32_t landmark;
    int octave;
    int misses;                   // in a row
    Vector2<double> u;            // px, in the previous frame
    Matrix2<double> J_now_first;  // d(px now) / d(px in the frame where it was found)
    Vector2<double> predicted;    // px, in this frame
    Vector2<double> found;        // px, in this frame, if is_found
    Vector2<double> deviation;    // px, from the smooth motion: a fading sum
    Matrix2<double> covariance;
    float noise;  // grey levels, of a pixel of this frame
    bool is_found;
    ReferencePixels pixels;
  };
  // A frame without its octave 0, which belongs to the caller.
  struct Frame {
    Frame(int width, int height, int octaves);
    Pyramid pyramid;
    std::vector<std::int16_t> detail;  // the last octave without its coarse brightness
  };

  void make_detail(Frame* frame) const;
  [[nodiscard]] bool find_shift(const Frame& before, const Frame& now,
                                Vector2<double>* shift) const;
  [[nodiscard]] bool follow(const Frame& before, const Frame& now);
  void align_with_first(const Frame& now);
  void estimate_noise(const Frame& now);
  void end_points();
  void begin_points(const Frame& now);
  void observe(const Point& point, const Matrix2<double>& covariance);

  StartUpOptions options_;
  int octaves_;
  std::array<Frame, 2> frames_;
  int current_ = 0;  // the other is the previous frame
  bool have_before_ = false;
  int lost_frames_ = 0;
  SmoothFlow flow_;
  std::vector<Point> points_;  // the first point_count_ are used
  int point_count_ = 0;
  std::vector<FlowSample> samples_;
  double spacing_;  // px, of new points
  std::array<FastGrid, kReferenceOctaves> corners_of_octave_;
  std::vector<FastCorner> corners_;
  std::vector<float> scratch_;  // for medians
  std::array<double, kReferenceOctaves> noise_{};
  std::uint32_t next_landmark_ = 0;
  std::vector<TrackObservation> observations_;
  int observation_count_ = 0;
  StartUpStatistics statistics_;
};

}  // namespace alidade
