#pragma once
// VisibleLandmarks: the landmarks of the map that a predicted view puts into the image, of all octaves.
// Memory is taken by the constructor; nothing else allocates. One thread.

#include <vector>

#include "core/model/calibration.h"
#include "core/realtime/oe_mode/landmark_map.h"

namespace alidade {

class ViewProjection;

struct VisibleLandmark {
  int slot;           // of the map
  int octave;         // in which it is seen: the landmark's, but where the lens has zoomed
  Vector2<double> u;  // px of the image, predicted, to a pixel or so; its patch is all in it
};

// By how many octaves a landmark is larger in an image of this focal length, px, than in the one that it was made of.
[[nodiscard]] int octaves_larger(const Landmark& landmark, double focal_length);

class VisibleLandmarks {
 public:
  // capacity: of the map.
  explicit VisibleLandmarks(int capacity);

  // cone_margin: room for what the camera turns while it reads out, and for a wrong prediction, times the
  // angle from the optical axis to the farthest corner.
  void reset(const Calibration& calibration, double cone_margin);
  // The calibration has another lens.
  void change_lens(const Calibration& calibration, double cone_margin);

  // In ascending order of slots; valid until the next call. octaves: of the image. across_octaves:
  // landmarks were made with other focal lengths, too.
  // Each is seen in the octave in which it has about its size then, and not at all where the image has none.
  const std::vector<VisibleLandmark>& find(const Calibration& calibration, const LandmarkMap& map,
                                           const ViewProjection& view, int octaves,
                                           bool across_octaves);
  const std::vector<VisibleLandmark>& find(const Calibration& calibration, const LandmarkMap& map,
                                           const ViewProjection& view) {
    return find(calibration, map, view, 0, false);
  }
  // As find() left it.
  [[nodiscard]] const std::vector<VisibleLandmark>& latest() const { return visible_; }

  [[nodiscard]] std::size_t memory_bytes() const;

 private:
  double cosine_of_cone_ = 1;
  std::vector<int> slots_;
  std::vector<VisibleLandmark> visible_;
};

}  // namespace alidade
