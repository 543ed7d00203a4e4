#pragma once
// The ground plane as JSON: the answer of /api/v1/plane, a fit with its misfits, and what
// /api/v1/direction adds to a direction. Names and units: plane_file.h for the six values, the
// schemas PlaneFit and PlanePoint of openapi.yaml for the rest.

#include <nlohmann/json_fwd.hpp>

#include "core/ground/plane_estimate.h"
#include "core/ground/plane_fit.h"

namespace alidade {

// The values with their sigmas, the covariance, and the origin or null.
[[nodiscard]] nlohmann::ordered_json plane_json(const PlaneEstimate& estimate);

// The fit must be kOk or kMisfit.
[[nodiscard]] nlohmann::ordered_json plane_fit_json(const PlaneEvidence& evidence,
                                                    const PlaneFit& fit);

// Where a direction meets the ground: position_m (X, Y in the plane's frame w), covariance_m2 (of
// direction and plane), distance_m from the camera, and, if the plane has an origin, latitude_deg
// and longitude_deg. Only `error` if the direction does not meet the ground, or so near to the
// horizon that the sigma exceeds a fifth of the distance. d_b: unit vector, base frame; cov_d:
// rad^2, in tangent_basis(d_b).
[[nodiscard]] nlohmann::ordered_json plane_point_json(const PlaneEstimate& estimate,
                                                      const Vector3<double>& d_b,
                                                      const Matrix2<double>& cov_d);

}  // namespace alidade
