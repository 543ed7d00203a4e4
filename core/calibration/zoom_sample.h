#pragma once
// One calibration at a zoom reading as a linear observation of log f, corner distortion and optical
// centre at that reading, and of what all readings share (core/model/lens/zoom_curve.h). Shared
// parameters are changes from a reference, axes in the reference's tangent basis.
// Units of ZoomQuantity and Parameter. Pure; allocates.

#include <Eigen/Core>
#include <vector>

#include "core/calibration/zoom_fit.h"

namespace alidade::internal {

inline constexpr int kZoomSampleSize = kZoomQuantityCount + kSharedCount;
using ZoomSampleVector = Eigen::Matrix<double, kZoomSampleSize, 1>;
using ZoomSampleMatrix = Eigen::Matrix<double, kZoomSampleSize, kZoomSampleSize>;

struct ZoomSample {
  double reading = 0;
  ZoomSampleVector value = ZoomSampleVector::Zero();
  ZoomSampleMatrix covariance = ZoomSampleMatrix::Zero();
  ZoomSampleMatrix information = ZoomSampleMatrix::Zero();  // inverse, without exact rows
  // Information of the priors that went in, and that times their means.
  ZoomSampleVector prior_information = ZoomSampleVector::Zero();
  ZoomSampleVector prior_weighted = ZoomSampleVector::Zero();
};

// Index of a lens or shared parameter in a sample.
[[nodiscard]] int zoom_place_of(Parameter parameter);

// Leaves the information at zero; c must have a zoom.
[[nodiscard]] ZoomSample make_zoom_sample(const Calibration& c, const Calibration& reference);
// Sets the information. The nominal axes are those of CalibrationOptions. False: the covariance is
// not positive.
[[nodiscard]] bool set_zoom_information(const std::vector<int>& places,
                                        const ZoomFitOptions& options, const Calibration& reference,
                                        ZoomSample* sample);

// Subtracts the clock error that all telemetry polls share from a covariance's clock offset, as far
// as the covariance stays positive: that error does not belong to a single calibration. places:
// rows that are not exact. clock: the offset's row.
void take_common_clock_error(const std::vector<int>& places, int clock, double common_sigma_s,
                             Eigen::MatrixXd* covariance);

}  // namespace alidade::internal
