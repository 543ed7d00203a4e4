#pragma once
// A point of the pattern as a rolling shutter sees it while the camera moves. The point's row v
// determines the time at which it is seen, and the time determines the row:
//   v = project(p_camera(t_frame + v * line_delay))_v                  (Oth 6, solved for v)
// This uses the predicted row, not the measured one. So the residual's covariance is the
// detection's own, and (Oth 18 to 21) is not needed. Jacobians follow from the implicit function
// theorem.

#include <cstddef>

#include "core/model/projection_status.h"
#include "core/pattern/lens.h"
#include "core/pattern/pattern_data.h"
#include "core/pattern/pose_curve.h"

namespace alidade {

struct MovingProjection {
  Vector2<double> u;                                // px
  double time_s = 0;                                // when the point's row was exposed
  SplineBasis basis;                                // of the pose at time_s
  Matrix<double, 2, 6> J_u_x;                       // by the pose at time_s
  Matrix<double, 2, kLensParameterCount> J_u_lens;  // line delay included
};

// The four control points of the segment.
using ControlPoints = Matrix<double, 6, 4>;

[[nodiscard]] ControlPoints control_points_of(const PoseCurve& curve, int segment);

// p: m, pattern frame. row_guess: px, start of the iteration for the row. Uses only the segment's
// polynomials, even beyond its ends, so that a solver's parameter blocks do not change while it
// steps. kNoRow: the image moves about as fast as the read-out, or no row was found. *projection is
// written with kOk only, its Jacobians if with_jacobians.
[[nodiscard]] ProjectionStatus project_moving(const PoseCurve& curve, int segment,
                                              const ControlPoints& points, const LensVector& lens,
                                              double frame_time_s, const Vector3<double>& p,
                                              double row_guess, MovingProjection* projection,
                                              bool with_jacobians);

// Calls use(frame, observation, projection), the first two as indices, for each observation that
// can be projected, in the data's order.
template <class Use>
void for_each_projection(const PatternData& data, const LensVector& lens, const PoseCurve& curve,
                         bool with_jacobians, Use use) {
  const double line_delay = lens[index(LensParameter::kLineDelay)];
  int segment = 0;
  for (std::size_t f = 0; f < data.frames.size(); ++f) {
    const PatternFrame& frame = data.frames[f];
    for (std::size_t i = 0; i < frame.observations.size(); ++i) {
      const PatternObservation& observation = frame.observations[i];
      segment = curve.segment_at(frame.time_s + observation.u.y() * line_delay, segment);
      MovingProjection projection;
      if (project_moving(curve, segment, control_points_of(curve, segment), lens, frame.time_s,
                         data.points_m[static_cast<std::size_t>(observation.point)],
                         observation.u.y(), &projection, with_jacobians) == ProjectionStatus::kOk) {
        use(f, i, projection);
      }
    }
  }
}

}  // namespace alidade
