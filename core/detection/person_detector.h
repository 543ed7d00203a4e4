#pragma once
// PersonDetector: upright people, by OpenCV's HOG and its SVM (Dalal and Triggs 2005), at the one
// scale that follows from the world plane (Lisanti et al., section 4.1; target_scale.h).
// The image is searched in bands of foot rows; within a band a person's height varies by less than
// height_step. A band, with room for heads, is scaled so that people are 96 px tall, as the SVM was
// trained, and searched once. A person of another band, or of a height that does not fit the place
// of the feet, is dropped; of overlapping ones the surest stays. People of a height outside
// [least_height_px, most_height_px] are not searched for. Score: distance from the SVM's plane.
// Takes scratch memory as OpenCV does: not for the real-time thread. For one thread.

#include <memory>
#include <vector>

#include "core/detection/detection_box.h"
#include "core/ground/world_plane.h"
#include "core/realtime/frame_orientation.h"
#include "core/realtime/image/image_view.h"

namespace alidade {

struct PersonOptions {
  double height_m = 1.75;         // of people
  double height_tolerance = 0.2;  // largest |log(a box's height / that of height_m there)|
  double height_step = 1.1;       // largest ratio of heights in px within a band; > 1
  double least_height_px = 48;
  double most_height_px = 480;
  double threshold = 0;        // of the score
  double most_overlap = 0.45;  // of two boxes that both stay
  int most_boxes = 64;

  // False if a value is invalid. *error, if not null, then says which in one line.
  [[nodiscard]] bool validate(const char** error = nullptr) const;
};

enum class PersonStatus {
  kOk,
  kNoImage,        // not valid, stored bottom up, or its size is not the calibration's
  kNoOrientation,  // mode none
  // Everywhere people would be too small or too large, or no ground is in view.
  kNowhere
};

[[nodiscard]] const char* to_string(PersonStatus status);

class PersonDetector {
 public:
  // options must be valid.
  explicit PersonDetector(const PersonOptions& options);
  ~PersonDetector();
  PersonDetector(const PersonDetector&) = delete;
  PersonDetector& operator=(const PersonDetector&) = delete;

  [[nodiscard]] PersonStatus find(const ImageView& image, const FrameOrientation& frame,
                                  const WorldPlane& plane);
  // For comparison: any height from least to most, in steps of 5 %, anywhere. kOk or kNoImage (not
  // valid, or stored bottom up).
  [[nodiscard]] PersonStatus find_at_all_scales(const ImageView& image);
  // Boxes of the latest picture, surest first; empty unless its status was kOk.
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
