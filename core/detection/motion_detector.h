#pragma once
// MotionDetector: what moves in the scene while the camera turns; for far, small targets. Each
// pixel is compared with the same direction in two or three earlier images (earlier_frames.h,
// frame_warp.h), after a common small shift and the light are estimated (frame_match.h):
//   z(u) = (now - light then(warp(u) + shift) - offset) / sigma          sigma: DifferenceModel
// The smallest of a pixel's |z| counts, with its sign, or 0 if the signs differ. 5x5 pixels
// together decide (change_regions.h). Method, reasons and limits: docs/motion_detection.md,
// docs/derivations.md. The constructor takes all memory, some 12 bytes a pixel; find() allocates
// nothing. Equal calls give equal results. For one thread.

#include <array>
#include <vector>

#include "core/detection/change_regions.h"
#include "core/detection/earlier_frames.h"
#include "core/detection/frame_match.h"
#include "core/detection/frame_warp.h"
#include "core/realtime/image/image_noise.h"

namespace alidade {

struct MotionOptions {
  int width = 1280;        // px, of all pictures
  int height = 720;        // px
  double spacing_s = 0.3;  // between the five older ones of the earlier images
  // Remaining error of orientation, lens and air, one sigma.
  double sigma_alignment_px = 0.1;
  // Error due to different blur, one sigma: half of the difference of the blurs' variances.
  double sigma_blur_px2 = 0.03;
  double exposure_s = 0.005;   // about the longest exposure
  double most_blur_px = 8;     // by the camera's motion during the exposure
  double most_zoom = 0.1;      // |log| of the ratio of focal lengths of pictures that are compared
  double most_shift_px = 3;    // largest error of orientations
  double most_spread = 4;      // spread of all differences over the expected one
  double least_covered = 0.3;  // of the picture, seen before
  double most_changed = 0.1;   // of the picture
  ChangeOptions change;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class MotionStatus {
  kOk,
  kWrongImage,     // no picture, or its size is not that of options and calibration
  kNoOrientation,  // mode none, numbers not finite or of no camera, or pixels without a direction
  kNotNewer,       // not newer than the picture before
  kBlurred,        // the camera turns too fast for the exposure
  // Too little of the image was seen before: at the beginning, after a jump or a change of zoom.
  kTooLittleOverlap,
  // The image differs everywhere: light, weather, wrong orientation.
  kNotExplained
};

[[nodiscard]] const char* to_string(MotionStatus status);

struct MotionAnswer {
  MotionStatus status = MotionStatus::kOk;
  double covered = 0;   // share of the picture in which motion can be found
  double shift_px = 0;  // largest error of the compared pictures' orientations
  double spread = 0;    // largest spread of differences over the expected one; 1: as expected
  double changed = 0;   // share of the picture beyond the threshold (ChangeRegions::changed())
};

class MotionDetector {
 public:
  // options must be valid.
  explicit MotionDetector(const MotionOptions& options);

  // A picture refused with kWrongImage, kNoOrientation, kNotNewer or kBlurred is not kept for later
  // comparisons.
  [[nodiscard]] MotionAnswer find(const ImageView& image, const FrameOrientation& orientation);
  // The boxes of the latest picture, the surest first; empty unless its status was kOk. Score:
  // sigmas.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // Forgets all earlier pictures.
  void forget();

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr int kCompared = 3;  // earlier pictures for each pixel

  // An earlier frame to compare with, in order of preference.
  struct Compared {
    TileCorners corners;
    FrameMatch match;
    DifferenceModel model;
    float scale = 0;       // factor of z
    bool usable = false;   // its warp is known, and its match is plausible
    bool matched = false;  // with this picture
    bool chosen = false;   // by a tile
  };
  struct TileChoice {
    std::array<std::uint8_t, kCompared> which;  // indices of compared_
    std::uint8_t count;
  };
  using TileRow = std::array<float, kTile>;

  [[nodiscard]] MotionStatus check(const ImageView& image,
                                   const FrameOrientation& orientation) const;
  [[nodiscard]] double blur_px(const FrameOrientation& orientation) const;
  void warp_earlier(const FrameOrientation& orientation);
  [[nodiscard]] double choose_tiles();
  [[nodiscard]] bool match_chosen(const FrameOrientation& orientation, MotionAnswer* answer);
  void compare_tile(int column, int row);
  [[nodiscard]] bool differs_from_recent(const DetectionBox& box);
  void compare_row(int which, int column, int row, int v, TileRow* z) const;

  MotionOptions options_;
  CornerDistance distance_;
  EarlierFrames earlier_;
  FrameWarp warp_;
  RunningNoise noise_;
  ChangeRegions regions_;
  std::vector<DetectionBox> boxes_;
  bool first_ = true;
  // Data of the current picture.
  std::size_t smooth_pixels_;
  std::vector<std::uint16_t> smooth_;
  std::array<Compared, EarlierFrames::kMost> compared_;  // in the order of earlier_
  std::vector<TileChoice> tiles_;
  std::vector<float> scratch_;
  std::vector<std::int16_t> piece_;  // z around a box
};

}  // namespace alidade
