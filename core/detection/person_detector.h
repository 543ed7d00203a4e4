#pragma once
// People who stand upright, by OpenCV's HOG and its SVM (Dalal and Triggs 2005), at the one scale that the world plane tells (Lisanti et al.,
// section 4.1): how tall somebody is in the picture where the feet are at a row (target_scale.h).
// The picture is taken in bands of foot rows, in each of which that height varies by less than height_step; a band, with room for heads, is
// scaled so that people are as tall as the SVM was taught, 96 px, and looked at once. What stands in another band, or is not as tall as
// its own feet's place says, is dropped; of what overlaps, the surest stays. For comparison: at all scales.
// Where the height in pixels is outside [least_height_px, most_height_px] nobody is looked for. Score: distance from the SVM's plane.
// Scratch memory is taken as OpenCV does: not for the real-time thread. For one thread.

#include <memory>
#include <vector>

#include "core/detection/detection_box.h"
#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

struct PersonOptions {
  double height_m = 1.75;         // of people
  double height_tolerance = 0.2;  // log of heights over each other: of a person and height_m
  double height_step = 1.1;       // of pixels' heights within a band, above 1
  double least_height_px = 48;
  double most_height_px = 480;
  double threshold = 0;        // of the score
  double most_overlap = 0.45;  // of two boxes that stay
  int most_boxes = 64;

  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class PersonStatus {
  kOk,
  kNoImage,        // not valid, or not of the size of the orientation's calibration
  kNoOrientation,  // mode none
  kNowhere  // people would be too small or too large everywhere, or there is no ground in view
};

[[nodiscard]] const char* to_string(PersonStatus status);

class PersonDetector {
 public:
  // options are valid.
  explicit PersonDetector(const PersonOptions& options);
  ~PersonDetector();
  PersonDetector(const PersonDetector&) = delete;
  PersonDetector& operator=(const PersonDetector&) = delete;

  [[nodiscard]] PersonStatus find(const ImageView& image, const FrameOrientation& frame,
                                  const WorldPlane& plane);
  // Of any height between the least and the most, in steps of 5 %, anywhere.
  [[nodiscard]] PersonStatus find_at_all_scales(const ImageView& image);
  // Of the latest picture, the surest first.
  [[nodiscard]] const std::vector<DetectionBox>& boxes() const { return boxes_; }

 private:
  struct Hog;
  // Foot rows [top, bottom) of people about height_px tall.
  struct Band {
    double top, bottom, height_px;
  };

  void find_bands(const FrameOrientation& frame, const WorldPlane& plane, int width, int height);
  void look_at(const ImageView& image, const Band& band);
  void drop_overlapped();

  PersonOptions options_;
  std::unique_ptr<Hog> hog_;
  std::vector<Band> bands_;
  std::vector<DetectionBox> boxes_;
};

}  // namespace alidade
