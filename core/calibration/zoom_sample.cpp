#include "core/calibration/zoom_sample.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/calibration/partial_inverse.h"
#include "core/model/direction.h"

namespace alidade::internal {
namespace {

// The calibration parameter at an index of a sample.
Parameter zoom_parameter_at(int i) {
  return i < kZoomQuantityCount
             ? kParameterOfQuantity[static_cast<std::size_t>(i)]
             : kSharedParameters[static_cast<std::size_t>(i - kZoomQuantityCount)];
}

}  // namespace

int zoom_place_of(Parameter parameter) {
  int place = 0;
  while (zoom_parameter_at(place) != parameter) ++place;
  return place;
}

ZoomSample make_zoom_sample(const Calibration& c, const Calibration& reference) {
  ZoomSample sample;
  sample.reading = *c.zoom;
  sample.value.head<kZoomQuantityCount>() = zoom_quantities(c.camera);
  for (const Parameter p : {Parameter::kAspect, Parameter::kLineDelay, Parameter::kPanScale,
                            Parameter::kTiltScale, Parameter::kClockOffset}) {
    sample.value[zoom_place_of(p)] = parameter_value(c, p) - parameter_value(reference, p);
  }

  ZoomSampleMatrix J = ZoomSampleMatrix::Identity();
  J.topLeftCorner<kZoomQuantityCount, kZoomQuantityCount>() = zoom_quantities_by_camera(c.camera);
  const auto set_axis = [&](Parameter first, const Vector3<double>& axis,
                            const Vector3<double>& of_reference) {
    const int place = zoom_place_of(first);
    Matrix<double, 2, 3> J_axis;
    sample.value.segment<2>(place) = direction_minus<double>(axis, of_reference, &J_axis);
    J.block<2, 2>(place, place) = J_axis * tangent_basis(axis);
  };
  set_axis(Parameter::kPanAxis0, c.mechanics.pan_axis, reference.mechanics.pan_axis);
  set_axis(Parameter::kTiltAxis0, c.mechanics.tilt_axis, reference.mechanics.tilt_axis);

  ZoomSampleMatrix covariance;
  for (int i = 0; i < kZoomSampleSize; ++i) {
    for (int j = 0; j < kZoomSampleSize; ++j) {
      covariance(i, j) = c.covariance(index(zoom_parameter_at(i)), index(zoom_parameter_at(j)));
    }
  }
  sample.covariance = J * covariance * J.transpose();
  return sample;
}

bool set_zoom_information(const std::vector<int>& places, const ZoomFitOptions& options,
                          const Calibration& reference, ZoomSample* sample) {
  const Eigen::MatrixXd information = inverse_over(sample->covariance, places);
  if (information.size() == 0) return false;
  sample->information = information;
  const auto set_prior = [&](Parameter parameter, double mean, double sigma) {
    const int place = zoom_place_of(parameter);
    constexpr double kRounding = 1e-6;
    const double variance = sample->covariance(place, place);
    if (sigma <= 0 || variance <= 0 || variance > (1 + kRounding) * sigma * sigma) return;
    sample->prior_information[place] = 1 / (sigma * sigma);
    sample->prior_weighted[place] = mean / (sigma * sigma);
  };
  set_prior(Parameter::kCentreU, 0, options.centre_sigma_px);
  set_prior(Parameter::kCentreV, 0, options.centre_sigma_px);
  const auto set_axis_prior = [&](Parameter first, const Vector3<double>& nominal,
                                  const Vector3<double>& of_reference) {
    const Vector2<double> mean = direction_minus<double>(nominal, of_reference);
    set_prior(first, mean[0], options.axis_sigma_rad);
    set_prior(static_cast<Parameter>(index(first) + 1), mean[1], options.axis_sigma_rad);
  };
  set_axis_prior(Parameter::kPanAxis0, Vector3<double>::UnitZ(), reference.mechanics.pan_axis);
  set_axis_prior(Parameter::kTiltAxis0, Vector3<double>::UnitY(), reference.mechanics.tilt_axis);
  for (const ZoomFitOptions::Prior& prior : options.shared_priors) {
    set_prior(prior.parameter, prior.value - parameter_value(reference, prior.parameter),
              prior.sigma);
  }
  return true;
}

void take_common_clock_error(const std::vector<int>& places, int clock, double common_sigma_s,
                             Eigen::MatrixXd* covariance) {
  constexpr double kMost = 0.96;  // of what the other parameters leave open
  if (!(common_sigma_s > 0) || std::count(places.begin(), places.end(), clock) == 0) return;
  const Eigen::MatrixXd information = inverse_over(*covariance, places);
  if (information.size() == 0) return;
  (*covariance)(clock, clock) -=
      std::min(common_sigma_s * common_sigma_s, kMost / information(clock, clock));
}

}  // namespace alidade::internal
