#pragma once
// One calibration at a zoom reading as a linear observation: of log f, corner distortion and optical centre there, and of what all
// readings share (core/model/zoom_curve.h), the latter as changes from a reference; axes in the reference's tangent basis.
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
  ZoomSampleMatrix information = ZoomSampleMatrix::Zero();  // its inverse over what is not exact
  // Of the priors that went in, and times their means.
  ZoomSampleVector prior_information = ZoomSampleVector::Zero();
  ZoomSampleVector prior_weighted = ZoomSampleVector::Zero();
};

// Where a lens or shared parameter stands in a sample.
[[nodiscard]] int zoom_place_of(Parameter parameter);

// Without the information; c has a zoom.
[[nodiscard]] ZoomSample make_zoom_sample(const Calibration& c, const Calibration& reference);
// The nominal axes are those of CalibrationOptions. False: the covariance is not positive.
[[nodiscard]] bool set_zoom_information(const std::vector<int>& places,
                                        const ZoomFitOptions& options, const Calibration& reference,
                                        ZoomSample* sample);

// What all polls of the telemetry have in common is no error of one calibration: taken off a covariance's clock offset, as far as it
// stays positive. places: of the covariance that are not exact; clock: the offset's row.
void take_common_clock_error(const std::vector<int>& places, int clock, double common_sigma_s,
                             Eigen::MatrixXd* covariance);

}  // namespace alidade::internal
