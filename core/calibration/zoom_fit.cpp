#include "core/calibration/zoom_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <map>
#include <utility>

#include "core/calibration/movement_evidence.h"
#include "core/calibration/number_text.h"
#include "core/calibration/partial_inverse.h"
#include "core/calibration/zoom_evidence.h"
#include "core/calibration/zoom_sample.h"
#include "core/calibration/zoom_solution.h"

namespace alidade {
namespace {

using internal::free_places;
using internal::zoom_place_of;
using internal::ZoomEvidence;
using internal::ZoomSample;
using internal::ZoomSampleVector;
using internal::ZoomSolution;

std::string reading_text(double reading) { return "reading " + short_text(reading); }

// Rejects a mixture of two cameras: the chi-square exceeds its expectation by too many of its
// standard deviations.
bool belong_together(const ZoomFit& fit, const ZoomFitOptions& options, double worst_reading,
                     std::string* error) {
  const double expected = fit.degrees_of_freedom;
  if (fit.chi_square <= expected + options.two_cameras * std::sqrt(2 * std::max(expected, 1.0)))
    return true;
  *error = "the calibration at " + reading_text(worst_reading) +
           " does not share line delay, axes and clock offset with the others (" +
           short_text(fit.chi_square) + " in place of " + short_text(expected) +
           "); calibrations of one camera on one mount are needed";
  return false;
}

// Two dwells at one reading must agree in focal length, within six sigmas of lens repeatability and
// calibrations.
bool comes_back(double reading, const std::array<double, 2>& log_f,
                const std::array<double, 2>& variance, double repeatability, std::string* error) {
  const double sigma = std::sqrt(2 * repeatability * repeatability + variance[0] + variance[1]);
  if (std::abs(log_f[1] - log_f[0]) <= 6 * sigma) return true;
  *error = "at " + reading_text(reading) + " the focal length is " +
           short_text(std::exp(log_f[0])) + " and " + short_text(std::exp(log_f[1])) +
           " px; does the reading follow the lens?";
  return false;
}

// What every calibration needs: a zoom reading and the camera's image size.
bool is_usable(const Calibration& c, const Camera<double>& camera, std::string* error) {
  if (!c.zoom || !std::isfinite(*c.zoom)) {
    *error = "a calibration has no zoom reading; one for each is needed";
    return false;
  }
  if (c.camera.width == camera.width && c.camera.height == camera.height) return true;
  *error = "the calibrations are of images of different sizes; one camera is needed";
  return false;
}

// Chi-square of the shared parameters, sample against curve. False: a covariance is not positive.
bool compare_shared(const ZoomSample& sample, const ZoomCurve::Content& curve,
                    const ZoomFitOptions& options, ZoomFit* fit) {
  Eigen::MatrixXd covariance = curve.covariance.bottomRightCorner<kSharedCount, kSharedCount>() +
                               sample.covariance.bottomRightCorner<kSharedCount, kSharedCount>();
  if (options.clock_is_another) {
    constexpr double kAny_s = 1;
    const int clock = zoom_place_of(Parameter::kClockOffset) - kZoomQuantityCount;
    covariance(clock, clock) += kAny_s * kAny_s;
  }
  const std::vector<int> places = free_places(covariance);
  const Eigen::MatrixXd weight = internal::inverse_over(covariance, places);
  if (weight.size() == 0) return false;
  const Eigen::VectorXd d = sample.value.tail<kSharedCount>();
  fit->chi_square = d.dot(weight * d);
  fit->degrees_of_freedom = static_cast<int>(places.size());
  return true;
}

bool make_sample(const Calibration& c, const Calibration& reference, const ZoomFitOptions& options,
                 ZoomSample* sample) {
  *sample = internal::make_zoom_sample(c, reference);
  Eigen::MatrixXd covariance = sample->covariance;
  internal::take_common_clock_error(free_places(covariance), zoom_place_of(Parameter::kClockOffset),
                                    options.common_clock_sigma_s, &covariance);
  sample->covariance = covariance;
  return internal::set_zoom_information(free_places(covariance), options, reference, sample);
}

// Nodes of a curve made of these calibrations alone: ordered by reading, then by index.
std::vector<int> nodes_by_calibration(const std::vector<Calibration>& calibrations) {
  std::vector<int> node_of(calibrations.size(), 0);
  for (std::size_t i = 0; i < calibrations.size(); ++i) {
    for (std::size_t j = 0; j < calibrations.size(); ++j) {
      const double a = *calibrations[i].zoom;
      const double b = *calibrations[j].zoom;
      if (b < a || (b == a && j < i)) ++node_of[i];
    }
  }
  return node_of;
}

}  // namespace

std::vector<double> readings_between(const std::vector<Calibration>& calibrations) {
  constexpr double kClose = 0.15;  // of log f
  std::map<double, double> log_f_at;
  for (const Calibration& c : calibrations) {
    if (c.zoom && std::isfinite(*c.zoom)) log_f_at[*c.zoom] = std::log(c.camera.focal_length);
  }
  struct Gap {
    double begin;
    double end;
    double rise;
    int nodes = 0;
  };
  std::vector<Gap> gaps;
  for (auto next = log_f_at.begin(); next != log_f_at.end(); ++next) {
    if (next == log_f_at.begin()) continue;
    const auto before = std::prev(next);
    gaps.push_back({before->first, next->first, std::abs(next->second - before->second)});
  }
  auto room = ZoomCurve::kMaxNodes - static_cast<int>(calibrations.size() + log_f_at.size());
  for (; room > 0 && !gaps.empty(); --room) {
    const auto widest = std::max_element(gaps.begin(), gaps.end(), [](const Gap& a, const Gap& b) {
      return a.rise / (a.nodes + 1) < b.rise / (b.nodes + 1);
    });
    if (widest->rise / (widest->nodes + 1) < kClose) break;
    ++widest->nodes;
  }
  std::vector<double> readings;
  for (const Gap& gap : gaps) {
    for (int i = 1; i <= gap.nodes; ++i) {
      readings.push_back(gap.begin + (gap.end - gap.begin) * i / (gap.nodes + 1));
    }
  }
  return readings;
}

std::vector<std::string> zoom_advice(const ZoomCurve& curve, double share) {
  std::vector<std::string> advice;
  const ZoomCurve::Content& content = curve.content();
  for (int i = 1; i < content.nodes; ++i) {
    const double begin = content.reading[static_cast<std::size_t>(i - 1)];
    const double end = content.reading[static_cast<std::size_t>(i)];
    Calibration c;
    if (!curve.at(0.5 * (begin + end), &c)) continue;
    const double sigma = relative_focal_length_sigma(c);
    if (sigma <= share) continue;
    constexpr double kPercent = 100;
    advice.push_back("zoom between readings " + short_text(begin) + " and " + short_text(end) +
                     " was never seen: the focal length is known to " +
                     short_text(std::round(kPercent * 10 * sigma) / 10) +
                     " % there; dwell between them, or let the zoom pass while the camera sees "
                     "texture");
  }
  return advice;
}

ZoomFitOptions zoom_fit_options(const CalibrationOptions& made_with) {
  ZoomFitOptions options;
  const auto add = [&options](Parameter parameter, const std::optional<CalibrationPrior>& prior) {
    if (prior && prior->sigma > 0) {
      options.shared_priors.push_back({parameter, prior->value, prior->sigma});
    }
  };
  add(Parameter::kAspect, made_with.aspect);
  add(Parameter::kLineDelay, made_with.line_delay);
  add(Parameter::kClockOffset, made_with.clock_offset);
  add(Parameter::kPanScale, made_with.pan_scale);
  add(Parameter::kTiltScale, made_with.tilt_scale);
  options.axis_sigma_rad = made_with.axis_sigma_rad;
  options.centre_sigma_px = made_with.centre_sigma_px;
  return options;
}

bool fit_zoom(const std::vector<Calibration>& calibrations, const ZoomFitOptions& options,
              ZoomFit* fit, std::string* error) {
  return fit_zoom(calibrations, {}, options, fit, error);
}

bool fit_zoom(const std::vector<Calibration>& calibrations,
              const std::vector<MovementObservation>& movements, const ZoomFitOptions& options,
              ZoomFit* fit, std::string* error) {
  if (calibrations.size() > ZoomCurve::kMaxNodes) {
    *error = std::to_string(calibrations.size()) + " zoom readings are given; up to " +
             std::to_string(ZoomCurve::kMaxNodes) + " can be used";
    return false;
  }
  std::vector<Calibration> sorted = calibrations;
  for (const Calibration& c : sorted) {
    if (!is_usable(c, sorted.front().camera, error)) return false;
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Calibration& a, const Calibration& b) { return *a.zoom < *b.zoom; });
  if (sorted.size() < 2 || !(*sorted.back().zoom > *sorted.front().zoom)) {
    *error = "calibrations at two zoom readings or more are needed";
    return false;
  }
  std::vector<ZoomSample> samples;
  std::vector<double> readings;
  std::vector<int> places;
  for (const Calibration& c : sorted) {
    ZoomSample sample;
    if (!make_sample(c, sorted.front(), options, &sample)) {
      *error =
          "the calibration at " + reading_text(*c.zoom) + " has a covariance that is not positive";
      return false;
    }
    const std::vector<int> free = free_places(sample.covariance);
    if (samples.empty()) places = free;
    if (free != places) {
      *error = "the calibrations at " + reading_text(*sorted.front().zoom) + " and " +
               reading_text(*c.zoom) +
               " do not hold the same parameters exact; make them with the same priors";
      return false;
    }
    samples.push_back(sample);
    readings.push_back(sample.reading);
  }
  ZoomEvidence evidence = internal::no_zoom_evidence(readings);
  // The levels of distortion and centre are 0; that of log f is its mean.
  for (const ZoomSample& sample : samples) {
    evidence.level[0] += sample.value[0] / static_cast<double>(samples.size());
  }
  for (int i = 0; i < evidence.nodes(); ++i) {
    const ZoomSample& sample = samples[static_cast<std::size_t>(i)];
    internal::add_zoom_sample(sample, i, i == 0, &evidence);
    if (i == 0) continue;
    const ZoomSample& before = samples[static_cast<std::size_t>(i - 1)];
    if (before.reading == sample.reading &&
        !comes_back(sample.reading, {before.value[0], sample.value[0]},
                    {before.covariance(0, 0), sample.covariance(0, 0)}, options.repeatability,
                    error)) {
      return false;
    }
  }
  std::vector<int> node_of = nodes_by_calibration(calibrations);
  const int clock = zoom_place_of(Parameter::kClockOffset);
  double clock_information = 0;
  for (const ZoomSample& sample : samples) {
    if (sample.covariance(clock, clock) > 0)
      clock_information += 1 / sample.covariance(clock, clock);
  }
  const double clock_sigma_s = clock_information > 0 ? 1 / std::sqrt(clock_information) : 0;
  if (!internal::add_movements(movements, options, clock_sigma_s, &node_of, &evidence)) {
    *error = "a movement of the zoom has a covariance that is not positive";
    return false;
  }
  const std::vector<bool> is_between = evidence.is_between;
  ZoomSolution fitting(std::move(evidence), std::move(places), sorted.front(), options);
  if (!fitting.run(error)) return false;
  double worst = -1;
  double worst_reading = 0;
  fit->chi_square = 0;
  int node = -1;
  for (const ZoomSample& sample : samples) {
    ++node;
    while (is_between[static_cast<std::size_t>(node)]) ++node;
    const ZoomSampleVector left = fitting.left_of(sample, node);
    const double square = left.dot(sample.information * left);
    fit->chi_square += square;
    if (square <= worst) continue;
    worst = square;
    worst_reading = sample.reading;
  }
  fit->degrees_of_freedom = fitting.shared_places() * (static_cast<int>(samples.size()) - 1);
  fit->node = 0;
  if (!belong_together(*fit, options, worst_reading, error)) return false;
  return fitting.curve(&fit->curve, error);
}

bool extend_zoom(const ZoomCurve& curve, const Calibration& added, std::optional<int> visit,
                 const ZoomFitOptions& options, ZoomFit* fit, std::string* error) {
  ZoomCurve::Content before = curve.content();
  if (!is_usable(added, before.shared.camera, error)) return false;
  if (!visit && before.nodes == ZoomCurve::kMaxNodes) {
    before = internal::without_a_node(before);
    if (!set_inverses(&before)) {
      *error = "the zoom curve has nodes too close for its smoothness";
      return false;
    }
  }
  ZoomSample sample;
  if (!make_sample(added, before.shared, options, &sample)) {
    *error = "the calibration at " + reading_text(*added.zoom) +
             " has a covariance that is not positive";
    return false;
  }
  const std::vector<int> places = free_places(sample.covariance);
  internal::ZoomCurveParts parts;
  parts.common_clock_sigma_s = options.common_clock_sigma_s;
  parts.clock_is_another = options.clock_is_another;
  parts.places = places;
  ZoomEvidence evidence;
  const Eigen::MatrixXd covariance = before.covariance;
  if (free_places(covariance) !=
      internal::no_zoom_evidence({before.reading.begin(), before.reading.begin() + before.nodes})
          .rows(places)) {
    *error =
        "the calibration at " + reading_text(sample.reading) +
        " and the zoom curve do not hold the same parameters exact; make them with the same priors";
    return false;
  }
  if (!internal::take_apart(ZoomCurve(before), parts, &evidence)) {
    *error = "the zoom curve has a covariance that is not positive";
    return false;
  }
  for (int i = 0; !visit && i < before.nodes; ++i) {
    const int row = evidence.row(i, 0);
    if (evidence.reading[static_cast<std::size_t>(i)] != sample.reading) continue;
    if (!comes_back(sample.reading, {before.level[0] + before.value(row, 0), sample.value[0]},
                    {covariance(row, row), sample.covariance(0, 0)}, options.repeatability,
                    error)) {
      return false;
    }
  }
  fit->node = visit ? *visit : internal::insert_node(sample.reading, &evidence);
  internal::add_zoom_sample(sample, fit->node, false, &evidence);
  if (!compare_shared(sample, before, options, fit)) {
    *error = "the zoom curve has a covariance that is not positive";
    return false;
  }
  if (!belong_together(*fit, options, sample.reading, error)) return false;
  ZoomSolution fitting(evidence, places, before.shared, options);
  if (fitting.run(error) && fitting.curve(&fit->curve, error)) return true;
  // Where smoothness alone holds nodes together, the evidence is a small difference of large
  // numbers, and rounding may leave less than none of it. That is no word against the calibration.
  std::string as_before;
  ZoomSolution again(std::move(evidence), places, before.shared, options);
  return again.run_as(before, &as_before) && again.curve(&fit->curve, &as_before);
}

}  // namespace alidade
