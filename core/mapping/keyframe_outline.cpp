#include "core/mapping/keyframe_outline.h"

#include "core/mapping/map_projection.h"

namespace alidade {

std::vector<Vector3<double>> keyframe_outline(const SceneMap& map, const SceneKeyframe& keyframe) {
  constexpr int kPerSide = 4;
  const Camera<double> camera = map.camera_of(keyframe);
  const PictureMotion motion = map.motion_of(keyframe);
  const Matrix3<double> R = keyframe.R_base_from_camera.toRotationMatrix();
  const double w = camera.width;
  const double h = camera.height;
  const Vector2<double> corners[] = {{0, 0}, {w, 0}, {w, h}, {0, h}, {0, 0}};
  std::vector<Vector3<double>> out;
  for (int side = 0; side < 4; ++side) {
    for (int i = 0; i < kPerSide; ++i) {
      const double share = static_cast<double>(i) / kPerSide;
      const Vector2<double> u = (1 - share) * corners[side] + share * corners[side + 1];
      Vector3<double> d;
      if (unproject_to_map(camera, motion, R, u, &d) == ProjectionStatus::kOk) out.push_back(d);
    }
  }
  return out;
}

}  // namespace alidade
