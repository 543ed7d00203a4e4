#pragma once
// What moves in the scene while the camera turns: for far, small targets.
//
// Each pixel of a picture is compared with the same direction in up to three earlier pictures (earlier_frames.h), where both frames' orientations
// and lenses, row by row, say that it was (frame_warp.h); a common small shift and the light are estimated (frame_match.h).
//   z(u) = (now - light then(warp(u) + shift) - offset) / sigma,   sigma^2 = noise^2 + (shift |gradient|)^2 + (blur |second derivative|)^2
// The smallest z counts, and none where they differ in sign or there is but one: what one of the earlier pictures explains has not changed, so
// that the place where a target was earlier is no detection. A box in which nothing differs from the picture three before is of a slow target's place in all
// of the earlier ones, or of what stands still, and dropped, as is what a target has just uncovered (uncovered_places.h); pieces of a large target become one box (target_pieces.h). Noise is the picture's own (image_noise.h); if the scene as a whole differs by more than sigma,
// sigma is widened to that. 5x5 pixels together decide (change_regions.h). Why so, and what it cannot find: docs/motion_detection.md.
//
// What stands still is not found, and what came to stand within about a second no longer; where it goes it leaves a ghost as long.
// Pictures that are refused are not compared with later. All memory, some 12 bytes a pixel, is taken by the constructor; find()
// allocates nothing. Equal calls give equal results. For one thread.

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
  double spacing_s = 0.3;  // between the older of the earlier pictures: five
  double sigma_alignment_px =
      0.1;  // what is left of an orientation's error, a lens's and the air's, one standard deviation
  double sigma_blur_px2 =
      0.03;                   // likewise of different blur: half of the difference of its variances
  double exposure_s = 0.005;  // at most about
  double most_blur_px = 8;    // by the camera's motion during the exposure
  double most_zoom = 0.1;     // log of focal lengths over each other, of pictures that are compared
  double most_shift_px = 3;   // that orientations may be wrong by
  double most_spread = 4;     // of all differences over what is expected
  double least_covered = 0.3;  // of the picture: seen before
  double most_changed = 0.1;   // of the picture
  ChangeOptions change;

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class MotionStatus {
  kOk,
  kWrongImage,  // none, or of another size than the options', or than the orientation's calibration
  kNoOrientation,  // mode none, or a number that is not finite or no camera's
  kNotNewer,       // not later than the picture before
  kBlurred,        // the camera turns too fast for the exposure
  kTooLittleOverlap,  // too little of the picture was seen before: the first ones, after a jump or a change of zoom
  kNotExplained  // it differs everywhere: light, weather, wrong orientation
};

[[nodiscard]] const char* to_string(MotionStatus status);

struct MotionAnswer {
  MotionStatus status = MotionStatus::kOk;
  double covered = 0;   // of the picture, where something that moves can be found
  double shift_px = 0;  // that orientations of the compared pictures were off by, the largest
  double spread = 0;    // of differences over what was expected, the largest; 1: as expected
  double changed = 0;   // of the picture
};

class MotionDetector {
 public:
  // options are valid.
  explicit MotionDetector(const MotionOptions& options);

  [[nodiscard]] MotionAnswer find(const ImageView& image, const FrameOrientation& orientation);
  // Of the latest picture, the surest first; none unless its status was kOk. Score: sigmas.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }
  // As if no picture had come.
  void forget();

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  static constexpr int kCompared = 3;  // earlier pictures a pixel

  // An earlier frame that may be compared with, in the order of preference.
  struct Compared {
    TileCorners corners;
    FrameMatch match;
    DifferenceModel model;
    float scale = 0;       // of z
    bool usable = false;   // its warp is there, and what came of it is believed
    bool matched = false;  // to this picture
    bool chosen = false;   // by a tile
  };
  struct TileChoice {
    std::array<std::uint8_t, kCompared> which;  // of compared_
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
  // Of the picture at hand.
  std::size_t smooth_pixels_;
  std::vector<std::uint16_t> smooth_;
  std::array<Compared, EarlierFrames::kMost> compared_;  // by the order of earlier_
  std::vector<TileChoice> tiles_;
  std::vector<float> scratch_;
  std::vector<std::int16_t> piece_;  // z about a box
};

}  // namespace alidade
