#pragma once
// A point of the pattern as a rolling shutter sees it while the camera moves: its row v decides when it is seen, and when it
// is seen decides the row.
//   v = project(p_camera(t_frame + v * line_delay))_v                                        (Oth 6, solved for v)
// With the row that the model predicts in place of the measured one, the residual's covariance is the detection's own, and
// (Oth 18 to 21) is not needed. Jacobians follow from the implicit function theorem.

#include "core/model/projection_status.h"
#include "core/pattern/lens.h"
#include "core/pattern/pose_curve.h"

namespace alidade {

struct MovingProjection {
  Vector2<double> u;                                // px
  double time_s = 0;                                // when the point's row was exposed
  SplineBasis basis;                                // of the pose then
  Matrix<double, 2, 6> J_u_x;                       // by the pose then
  Matrix<double, 2, kLensParameterCount> J_u_lens;  // line delay included
};

// The four control points of the segment.
using ControlPoints = Matrix<double, 6, 4>;

[[nodiscard]] ControlPoints control_points_of(const PoseCurve& curve, int segment);

// row_guess: px, where the solution for the row begins. Only by the segment's polynomials, also beyond its ends: what a
// solver's parameter blocks are does not change while it steps. kNoRow: the image moves as fast as the read-out, or
// the row was not found. Outputs are written with kOk only.
[[nodiscard]] ProjectionStatus project_moving(const PoseCurve& curve, int segment,
                                              const ControlPoints& points, const LensVector& lens,
                                              double frame_time_s, const Vector3<double>& p,
                                              double row_guess, MovingProjection* projection,
                                              bool with_jacobians);

}  // namespace alidade
