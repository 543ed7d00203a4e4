#pragma once
// The ground plane as JSON: the answer of /api/v1/plane, a fit with its misfits, and what
// /api/v1/direction adds to a direction. Names and units are those of plane.yaml.

#include <nlohmann/json_fwd.hpp>

#include "core/ground/plane_estimate.h"
#include "core/ground/plane_fit.h"

namespace alidade {

// The values with their sigmas, the covariance, and the origin or null.
[[nodiscard]] nlohmann::ordered_json plane_json(const PlaneEstimate& estimate);

// The fit must be kOk or kMisfit.
[[nodiscard]] nlohmann::ordered_json plane_fit_json(const PlaneEvidence& evidence,
                                                    const PlaneFit& fit);

// Where a direction meets the ground: position_m, covariance_m2, distance_m from the camera, and,
// if the plane has an origin, latitude_deg and longitude_deg. If the direction does not meet the
// ground, only `error`. d_b: unit vector, base frame; cov_d: rad^2, in tangent_basis(d_b).
[[nodiscard]] nlohmann::ordered_json plane_point_json(const PlaneEstimate& estimate,
                                                      const Vector3<double>& d_b,
                                                      const Matrix2<double>& cov_d);

}  // namespace alidade
