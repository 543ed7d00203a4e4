#pragma once
// VisibleLandmarks: the map's landmarks that a predicted view puts into the image, of all octaves.
// The constructor takes all memory; nothing else allocates. One thread.

#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/landmark_map.h"

namespace alidade {

class ViewProjection;

struct VisibleLandmark {
  int slot;           // of the map
  int octave;         // in which it is seen: the landmark's, unless the lens has zoomed
  Vector2<double> u;  // px of the image, predicted to about a pixel; all its patch is in the image
};

// Number of octaves by which a landmark appears larger at this focal length (px) than in its
// reference image; negative: smaller.
[[nodiscard]] int octaves_larger(const Landmark& landmark, double focal_length);

class VisibleLandmarks {
 public:
  // capacity: of the map.
  explicit VisibleLandmarks(int capacity);

  // cone_margin: factor for the angle from the optical axis to the farthest corner; allows for the
  // camera's turn during read-out and for a wrong prediction.
  void reset(const Calibration& calibration, double cone_margin);
  // For another lens of the calibration.
  void change_lens(const Calibration& calibration, double cone_margin);

  // In ascending order of slots; valid until the next call. octaves: of the image. across_octaves:
  // landmarks may be made at other focal lengths; each is then seen in the octave in which it has
  // about its original size, or not at all if the image does not have that octave.
  const std::vector<VisibleLandmark>& find(const Calibration& calibration, const LandmarkMap& map,
                                           const ViewProjection& view, int octaves,
                                           bool across_octaves);
  const std::vector<VisibleLandmark>& find(const Calibration& calibration, const LandmarkMap& map,
                                           const ViewProjection& view) {
    return find(calibration, map, view, 0, false);
  }
  // Result of the last find().
  [[nodiscard]] const std::vector<VisibleLandmark>& latest() const { return visible_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  double cosine_of_cone_ = 1;
  std::vector<int> slots_;
  std::vector<VisibleLandmark> visible_;
};

}  // namespace alidade
