#pragma once
// SceneMapUpkeep's data on one picture, for scene_map_upkeep.cpp and landmark_birth.cpp alone: the
// picture's pose, where it shows the map's landmarks, and which of them were found and changed.

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "core/mapping/map_projection.h"
#include "core/mapping/scene_map_upkeep.h"

namespace alidade {

struct SceneMapUpkeep::Picture {
  struct Box {
    Vector2<double> least, most;  // px; corners
    bool empty = true;

    void add(const Vector2<double>& u) {
      least = empty ? u : Vector2<double>(least.cwiseMin(u));
      most = empty ? u : Vector2<double>(most.cwiseMax(u));
      empty = false;
    }
    [[nodiscard]] double area() const { return empty ? 0 : (most - least).prod(); }
  };
  struct Visible {
    std::size_t index = 0;  // into the map's landmarks
    Vector2<double> u;      // px
    double scale_px = 0;    // sigma of the blob
    bool expected = false;  // it should be found
  };

  PosedPicture posed;
  // Mean of the matched landmarks' common covariances, rad^2, in base.
  Matrix3<double> common = Matrix3<double>::Zero();
  double share_of_landmarks = 0;                  // as in update_landmark()
  Box matched;                                    // around the matched features
  std::vector<char> taken;                        // by feature: 1 if matched
  std::vector<Visible> visible;                   // by increasing index
  std::vector<std::size_t> found;                 // indices of matched landmarks, increasing
  std::map<std::int64_t, SceneLandmark> changed;  // by id

  // Cp at a direction, in tangent_basis(d_b).
  [[nodiscard]] Matrix2<double> common_at(const Vector3<double>& d_b) const {
    const Matrix<double, 3, 2> basis = tangent_basis(d_b);
    return basis.transpose() * common * basis;
  }
  // Where the picture shows a direction, px. False: nowhere, or nearer to the border than
  // border_px.
  [[nodiscard]] bool shows(const Vector3<double>& d_b, double border_px, Vector2<double>* u) const {
    double row = posed.motion.reference_row;
    MapProjection p;
    for (int step = 0; step < 3; ++step) {
      if (project_from_map(posed.camera, posed.motion, posed.R_base_from_camera, row, d_b, &p) !=
          ProjectionStatus::kOk) {
        return false;
      }
      row = p.u.y();
    }
    *u = p.u;
    return p.u.x() >= border_px && p.u.x() <= posed.camera.width - border_px &&
           p.u.y() >= border_px && p.u.y() <= posed.camera.height - border_px;
  }
};

}  // namespace alidade
