#pragma once
// One calibration at a zoom reading as a linear observation of log f, corner distortion and optical
// centre at that reading, and of the parameters that all readings share
// (core/model/lens/zoom_curve.h). Shared parameters are changes from a reference calibration; axes
// are in the reference's tangent basis. Units of ZoomQuantity and Parameter. Pure; allocates.

#include <Eigen/Core>
#include <vector>

#include "core/calibration/zoom_fit.h"

namespace alidade::internal {

inline constexpr int kZoomSampleSize = kZoomQuantityCount + kSharedCount;
using ZoomSampleVector = Eigen::Matrix<double, kZoomSampleSize, 1>;
using ZoomSampleMatrix = Eigen::Matrix<double, kZoomSampleSize, kZoomSampleSize>;

struct ZoomSample {
  double reading = 0;  // device units
  ZoomSampleVector value = ZoomSampleVector::Zero();
  ZoomSampleMatrix covariance = ZoomSampleMatrix::Zero();
  // Inverse of the covariance over the rows that are not exact; zero in the exact rows.
  ZoomSampleMatrix information = ZoomSampleMatrix::Zero();
  // Information of the priors that the calibration used, and this information times their means.
  ZoomSampleVector prior_information = ZoomSampleVector::Zero();
  ZoomSampleVector prior_weighted = ZoomSampleVector::Zero();
};

// Index of a parameter in a sample. The parameter must be one of the lens or a shared one; for
// kCount the behaviour is undefined.
[[nodiscard]] int zoom_place_of(Parameter parameter);

// All but the information and the priors. c must have a zoom; without it the behaviour is
// undefined.
[[nodiscard]] ZoomSample make_zoom_sample(const Calibration& c, const Calibration& reference);
// Sets the information and the priors. places: sample indices that are not exact. The priors of the
// axes are about base z (pan) and base y (tilt). False: the covariance at `places` is not positive
// definite.
[[nodiscard]] bool set_zoom_information(const std::vector<int>& places,
                                        const ZoomFitOptions& options, const Calibration& reference,
                                        ZoomSample* sample);

// Subtracts common_sigma_s^2 from the variance of the clock offset: the clock error that all
// telemetry polls share does not belong to a single calibration. Subtracts less if the covariance
// would not stay positive definite. places: rows of *covariance that are not exact. clock: the
// row of *covariance for the clock offset. Nothing happens if the clock's row is exact or the
// covariance is not positive definite.
void take_common_clock_error(const std::vector<int>& places, int clock, double common_sigma_s,
                             Eigen::MatrixXd* covariance);

}  // namespace alidade::internal
