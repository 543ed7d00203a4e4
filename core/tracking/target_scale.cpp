#include "core/tracking/target_scale.h"

#include "core/ground/image_plane.h"

namespace alidade {

PlaneStatus upright_target(const WorldPlane& plane, const FrameOrientation& frame,
                           const Vector2<double>& foot_u, double height_m, UprightTarget* out) {
  UprightTarget target;
  target.foot_u = foot_u;
  PlaneStatus status = plane_point_of_pixel(plane, frame, foot_u, &target.position);
  if (status != PlaneStatus::kOk) return status;
  const Vector3<double> head_w(target.position.x(), target.position.y(), height_m);
  status = pixel_of_point(plane, frame, head_w, &target.head_u);
  if (status != PlaneStatus::kOk) return status;
  target.height_px = (target.head_u - foot_u).norm();
  *out = target;
  return PlaneStatus::kOk;
}

}  // namespace alidade
