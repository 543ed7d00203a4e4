#pragma once
// The ground plane as JSON: the answer of /api/v1/plane, a fit with its misfits, and what /api/v1/direction adds to a direction. Names and units are those of
// plane.yaml.

#include <nlohmann/json_fwd.hpp>

#include "core/ground/plane_estimate.h"
#include "core/ground/plane_fit.h"

namespace alidade {

// Values with sigmas, covariance, origin or null.
[[nodiscard]] nlohmann::ordered_json plane_json(const PlaneEstimate& estimate);

// Of a fit with kOk or kMisfit.
[[nodiscard]] nlohmann::ordered_json plane_fit_json(const PlaneEvidence& evidence,
                                                    const PlaneFit& fit);

// Where a direction with this covariance (rad^2, in its tangent_basis) meets the ground: position_m, covariance_m2, distance_m from
// the camera, latitude_deg and longitude_deg where the plane has an origin; or error.
[[nodiscard]] nlohmann::ordered_json plane_point_json(const PlaneEstimate& estimate,
                                                      const Vector3<double>& d_b,
                                                      const Matrix2<double>& cov_d);

}  // namespace alidade
