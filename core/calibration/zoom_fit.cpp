#include "core/calibration/zoom_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/model/direction.h"

namespace alidade {

namespace {

constexpr int kSampleSize = kZoomQuantityCount + kSharedCount;
using SampleVector = Eigen::Matrix<double, kSampleSize, 1>;
using SampleMatrix = Eigen::Matrix<double, kSampleSize, kSampleSize>;

// Beyond this sum of squares less its expectation, in its standard deviations, two cameras are mixed.
constexpr double kTwoCameras = 8;

// One calibration: the quantities at its reading, then the shared parameters as changes from those of the first.
struct Sample {
  double reading = 0;
  SampleVector value = SampleVector::Zero();
  SampleMatrix covariance = SampleMatrix::Zero();
  SampleMatrix information = SampleMatrix::Zero();  // its inverse over what is not exact
  // Of the priors that went in, and times their means.
  SampleVector prior_information = SampleVector::Zero();
  SampleVector prior_weighted = SampleVector::Zero();
};

// Where a parameter of a calibration stands in a sample.
Parameter parameter_at(int i) {
  constexpr std::array<Parameter, kZoomQuantityCount> kLens = {
      Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kCentreU,
      Parameter::kCentreV};
  return i < kZoomQuantityCount
             ? kLens[static_cast<std::size_t>(i)]
             : kSharedParameters[static_cast<std::size_t>(i - kZoomQuantityCount)];
}

int place_of(Parameter parameter) {
  int place = 0;
  while (parameter_at(place) != parameter) ++place;
  return place;
}

// Of a shared parameter but the axes.
double value_of(const Calibration& c, Parameter parameter) {
  switch (parameter) {
    case Parameter::kAspect:
      return c.camera.aspect;
    case Parameter::kLineDelay:
      return c.line_delay;
    case Parameter::kPanScale:
      return c.mechanics.pan_scale;
    case Parameter::kTiltScale:
      return c.mechanics.tilt_scale;
    default:
      return c.clock_offset;
  }
}

std::string reading_text(double reading) { return "reading " + short_text(reading); }

Sample make_sample(const Calibration& c, const Calibration& reference) {
  Sample sample;
  sample.reading = *c.zoom;
  const double per_corner =
      std::pow(2 * c.camera.focal_length / std::hypot(c.camera.width, c.camera.height), 2);
  sample.value.head<kZoomQuantityCount>() << std::log(c.camera.focal_length),
      c.camera.radial_distortion / per_corner, c.camera.centre_u, c.camera.centre_v;
  for (const Parameter p : {Parameter::kAspect, Parameter::kLineDelay, Parameter::kPanScale,
                            Parameter::kTiltScale, Parameter::kClockOffset}) {
    sample.value[place_of(p)] = value_of(c, p) - value_of(reference, p);
  }

  SampleMatrix J = SampleMatrix::Identity();
  J(0, 0) = 1 / c.camera.focal_length;
  J(1, 0) = -2 * c.camera.radial_distortion / (per_corner * c.camera.focal_length);
  J(1, 1) = 1 / per_corner;
  const auto set_axis = [&](Parameter first, const Vector3<double>& axis,
                            const Vector3<double>& of_reference) {
    const int place = place_of(first);
    Matrix<double, 2, 3> J_axis;
    sample.value.segment<2>(place) = direction_minus<double>(axis, of_reference, &J_axis);
    J.block<2, 2>(place, place) = J_axis * tangent_basis(axis);
  };
  set_axis(Parameter::kPanAxis0, c.mechanics.pan_axis, reference.mechanics.pan_axis);
  set_axis(Parameter::kTiltAxis0, c.mechanics.tilt_axis, reference.mechanics.tilt_axis);

  SampleMatrix covariance;
  for (int i = 0; i < kSampleSize; ++i) {
    for (int j = 0; j < kSampleSize; ++j) {
      covariance(i, j) = c.covariance(index(parameter_at(i)), index(parameter_at(j)));
    }
  }
  sample.covariance = J * covariance * J.transpose();
  return sample;
}

std::vector<int> free_places(const SampleMatrix& covariance) {
  std::vector<int> places;
  for (int i = 0; i < kSampleSize; ++i) {
    if (covariance(i, i) > 0) places.push_back(i);
  }
  return places;
}

Eigen::MatrixXd part(const Eigen::MatrixXd& matrix, const std::vector<int>& places) {
  const auto size = static_cast<Eigen::Index>(places.size());
  Eigen::MatrixXd result(size, size);
  for (Eigen::Index i = 0; i < size; ++i) {
    for (Eigen::Index j = 0; j < size; ++j) {
      result(i, j) =
          matrix(places[static_cast<std::size_t>(i)], places[static_cast<std::size_t>(j)]);
    }
  }
  return result;
}

// Of a positive definite matrix whose rows differ by many orders of magnitude; empty if it is none.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd scale = matrix.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LLT<Eigen::MatrixXd> llt(scale.asDiagonal() * matrix * scale.asDiagonal());
  if (llt.info() != Eigen::Success) return {};
  const Eigen::MatrixXd inverse =
      llt.solve(Eigen::MatrixXd::Identity(matrix.rows(), matrix.cols()));
  return scale.asDiagonal() * inverse * scale.asDiagonal();
}

// The nominal axes are those of CalibrationOptions.
bool set_information(const std::vector<int>& places, const ZoomFitOptions& options,
                     const Calibration& reference, Sample* sample) {
  const Eigen::MatrixXd information = inverse_of(part(sample->covariance, places));
  if (information.size() == 0) return false;
  const auto set_prior = [&](Parameter parameter, double mean, double sigma) {
    const int place = place_of(parameter);
    if (sigma <= 0 || sample->covariance(place, place) <= 0) return;
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
    set_prior(prior.parameter, prior.value - value_of(reference, prior.parameter), prior.sigma);
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    for (std::size_t j = 0; j < places.size(); ++j) {
      sample->information(places[i], places[j]) =
          information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return true;
}

// Of the nodes' values, a movement's error at each included.
Eigen::MatrixXd process_covariance(const ZoomCurve::Content& content, int quantity) {
  const ZoomSmoothness& smoothness = content.smoothness[static_cast<std::size_t>(quantity)];
  const double first = content.reading[0];
  const double last = content.reading[static_cast<std::size_t>(content.nodes - 1)];
  const auto position = [&](int node) {
    return (content.reading[static_cast<std::size_t>(node)] - first) / (last - first);
  };
  // Two visits of one reading are not quite one, or no rounding would tell them apart.
  constexpr double kApart = 1e-5;
  Eigen::MatrixXd K(content.nodes, content.nodes);
  for (int i = 0; i < content.nodes; ++i) {
    for (int j = 0; j < content.nodes; ++j)
      K(i, j) = smoothness.covariance(position(i), position(j));
    K(i, i) += std::pow(kApart * smoothness.level_sigma, 2);
    if (quantity == 0) K(i, i) += content.repeatability * content.repeatability;
  }
  return K;
}

// What is usual of lenses: a focal length whose logarithm bends by as much as it rises, a distortion of some parts in a
// hundred at the corner, a centre within a hundredth of the image that wanders by half of that.
std::array<ZoomSmoothness, kZoomQuantityCount> usual(const std::vector<Sample>& samples,
                                                     const Camera<double>& camera) {
  const double rise = std::abs(samples.back().value[0] - samples.front().value[0]);
  const double centre_px = 0.01 * camera.width;
  return {ZoomSmoothness{5, 20, 1.5 * std::max(rise, 0.1)}, ZoomSmoothness{0.3, 0.3, 0.1},
          ZoomSmoothness{centre_px, centre_px, 0.5 * centre_px},
          ZoomSmoothness{centre_px, centre_px, 0.5 * centre_px}};
}

class Fit {
 public:
  Fit(std::vector<Sample> samples, std::vector<int> places, const Calibration& reference,
      const ZoomFitOptions& options)
      : samples_(std::move(samples)),
        places_(std::move(places)),
        reference_(reference),
        options_(options),
        nodes_(static_cast<int>(samples_.size())) {}

  bool run(ZoomFit* fit, std::string* error) {
    set_levels();
    choose_roughness();
    if (!solve()) {
      *error = "the calibrations leave what their readings share undetermined";
      return false;
    }
    fit->chi_square = chi_square_;
    fit->degrees_of_freedom = degrees_of_freedom_;
    if (!belong_together(error)) return false;
    fit->curve = ZoomCurve(content_);
    return is_monotone(fit->curve, error);
  }

 private:
  [[nodiscard]] int row(int node, int place) const {
    return place < kZoomQuantityCount ? kZoomQuantityCount * node + place
                                      : kZoomQuantityCount * nodes_ + place - kZoomQuantityCount;
  }

  void set_levels() {
    content_.nodes = nodes_;
    for (int i = 0; i < nodes_; ++i) {
      content_.reading[static_cast<std::size_t>(i)] = samples_[static_cast<std::size_t>(i)].reading;
    }
    content_.repeatability = options_.repeatability;
    content_.smoothness = usual(samples_, reference_.camera);
    // Distortion and centre are about 0 from the start; the focal length may be any.
    double sum = 0;
    for (const Sample& sample : samples_) sum += sample.value[0];
    content_.level[0] = sum / nodes_;
  }

  // Likelihood of each quantity by itself, the others taken as open.
  void choose_roughness() {
    constexpr int kSteps = 33;
    constexpr double kDecades = 2;          // on either side
    constexpr double kPriorDecades = 0.75;  // standard deviation
    for (int q = 0; q < kZoomQuantityCount; ++q) {
      ZoomSmoothness& smoothness = content_.smoothness[static_cast<std::size_t>(q)];
      const double usual_roughness = smoothness.roughness;
      double best = -1e300;
      double best_roughness = usual_roughness;
      Eigen::VectorXd y(nodes_);
      for (int i = 0; i < nodes_; ++i) {
        y[i] = samples_[static_cast<std::size_t>(i)].value[q] -
               content_.level[static_cast<std::size_t>(q)];
      }
      for (int step = 0; step < kSteps; ++step) {
        const double decades = kDecades * (2.0 * step / (kSteps - 1) - 1);
        smoothness.roughness = usual_roughness * std::pow(10, decades);
        Eigen::MatrixXd K = process_covariance(content_, q);
        for (int i = 0; i < nodes_; ++i) {
          K(i, i) += samples_[static_cast<std::size_t>(i)].covariance(q, q);
        }
        const Eigen::LLT<Eigen::MatrixXd> llt(K);
        if (llt.info() != Eigen::Success) continue;
        const double log_determinant = 2 * llt.matrixLLT().diagonal().array().log().sum();
        const double likelihood = -0.5 * (y.dot(llt.solve(y)) + log_determinant) -
                                  0.5 * std::pow(decades / kPriorDecades, 2);
        if (likelihood <= best) continue;
        best = likelihood;
        best_roughness = smoothness.roughness;
      }
      smoothness.roughness = best_roughness;
    }
  }

  bool solve() {
    const int size = kZoomQuantityCount * nodes_ + kSharedCount;
    Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd g = Eigen::VectorXd::Zero(size);
    std::vector<Eigen::VectorXd> seen;  // each sample's value, levels taken off
    for (int i = 0; i < nodes_; ++i) {
      const Sample& sample = samples_[static_cast<std::size_t>(i)];
      SampleVector value = sample.value;
      for (int q = 0; q < kZoomQuantityCount; ++q) {
        value[q] -= content_.level[static_cast<std::size_t>(q)];
      }
      const SampleVector weighted = sample.information * value;
      for (int a = 0; a < kSampleSize; ++a) {
        // A shared parameter's prior is left in once.
        const double share = a < kZoomQuantityCount || i > 0 ? 1 : 0;
        g[row(i, a)] += weighted[a] - share * sample.prior_weighted[a];
        H(row(i, a), row(i, a)) -= share * sample.prior_information[a];
        for (int b = 0; b < kSampleSize; ++b) H(row(i, a), row(i, b)) += sample.information(a, b);
      }
      seen.emplace_back(value);
    }
    if (!set_inverses(&content_)) return false;
    for (int q = 0; q < kZoomQuantityCount; ++q) {
      const auto& inverse = content_.inverse[static_cast<std::size_t>(q)];
      for (int i = 0; i < nodes_; ++i) {
        for (int j = 0; j < nodes_; ++j) H(row(i, q), row(j, q)) += inverse(i, j);
      }
    }
    // What all calibrations take as exact is exact.
    std::vector<int> rows;
    for (int i = 0; i < nodes_; ++i) {
      for (const int place : places_) {
        if (i == 0 || place < kZoomQuantityCount) rows.push_back(row(i, place));
      }
    }
    std::sort(rows.begin(), rows.end());
    const Eigen::MatrixXd inverse = inverse_of(part(H, rows));
    if (inverse.size() == 0) return false;
    content_.covariance.setZero(size, size);
    for (std::size_t i = 0; i < rows.size(); ++i) {
      for (std::size_t j = 0; j < rows.size(); ++j) {
        content_.covariance(rows[i], rows[j]) =
            inverse(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
    const Eigen::VectorXd x = content_.covariance * g;
    content_.value = x.head(kZoomQuantityCount * nodes_);
    take_shared(x.tail<kSharedCount>());
    measure_misfit(seen, x);
    return true;
  }

  void take_shared(const Eigen::Matrix<double, kSharedCount, 1>& change) {
    const auto of = [&](Parameter p) { return change[place_of(p) - kZoomQuantityCount]; };
    const auto axis = [&](const Vector3<double>& from, Parameter first) {
      const auto second = static_cast<Parameter>(index(first) + 1);
      return Vector3<double>(
          direction_plus<double>(from, Vector2<double>(of(first), of(second))).normalized());
    };
    Calibration& shared = content_.shared;
    shared = reference_;
    shared.camera.aspect += of(Parameter::kAspect);
    shared.line_delay += of(Parameter::kLineDelay);
    shared.mechanics.pan_axis = axis(reference_.mechanics.pan_axis, Parameter::kPanAxis0);
    shared.mechanics.tilt_axis = axis(reference_.mechanics.tilt_axis, Parameter::kTiltAxis0);
    shared.mechanics.pan_scale += of(Parameter::kPanScale);
    shared.mechanics.tilt_scale += of(Parameter::kTiltScale);
    shared.clock_offset += of(Parameter::kClockOffset);
    shared.covariance.setZero();
  }

  // How far each calibration is from what all say together, its priors counted with it.
  void measure_misfit(const std::vector<Eigen::VectorXd>& seen, const Eigen::VectorXd& x) {
    chi_square_ = 0;
    worst_ = 0;
    double worst = -1;
    for (int i = 0; i < nodes_; ++i) {
      SampleVector left = seen[static_cast<std::size_t>(i)];
      for (int a = 0; a < kSampleSize; ++a) left[a] -= x[row(i, a)];
      const double square = left.dot(samples_[static_cast<std::size_t>(i)].information * left);
      chi_square_ += square;
      if (square <= worst) continue;
      worst = square;
      worst_ = i;
    }
    int shared = 0;
    for (const int place : places_) shared += place >= kZoomQuantityCount ? 1 : 0;
    degrees_of_freedom_ = shared * (nodes_ - 1);
  }

  bool belong_together(std::string* error) const {
    const double expected = degrees_of_freedom_;
    if (chi_square_ <= expected + kTwoCameras * std::sqrt(2 * std::max(expected, 1.0))) return true;
    *error = "the calibration at " +
             reading_text(samples_[static_cast<std::size_t>(worst_)].reading) +
             " does not share line delay, axes and clock offset with the others (" +
             short_text(chi_square_) + " in place of " + short_text(expected) +
             "); calibrations of one camera on one mount are needed";
    return false;
  }

  [[nodiscard]] bool is_monotone(const ZoomCurve& curve, std::string* error) const {
    constexpr int kSteps = 200;
    const bool rises = samples_.back().value[0] > samples_.front().value[0];
    double last_f = 0;
    double last = 0;
    for (int i = 0; i <= kSteps; ++i) {
      const double reading =
          curve.first_reading() + (curve.last_reading() - curve.first_reading()) * i / kSteps;
      Calibration c;
      if (!curve.at(reading, &c)) return false;
      const double sigma =
          std::sqrt(c.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength)));
      const double back = rises ? last_f - c.camera.focal_length : c.camera.focal_length - last_f;
      if (i > 0 && back > 3 * sigma) {
        *error = "the focal length goes back between zoom readings " + short_text(last) + " and " +
                 short_text(reading) + "; readings of one lens, in one unit, are needed";
        return false;
      }
      if (i == 0 || back < 0) {
        last_f = c.camera.focal_length;
        last = reading;
      }
    }
    return true;
  }

  std::vector<Sample> samples_;
  std::vector<int> places_;  // not exact
  const Calibration& reference_;
  const ZoomFitOptions& options_;
  int nodes_;
  ZoomCurve::Content content_;
  double chi_square_ = 0;
  int degrees_of_freedom_ = 0;
  int worst_ = 0;
};

}  // namespace

bool set_inverses(ZoomCurve::Content* content) {
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    const Eigen::MatrixXd inverse = inverse_of(process_covariance(*content, q));
    if (inverse.size() == 0) return false;
    content->inverse[static_cast<std::size_t>(q)] = inverse;
  }
  return true;
}

bool fit_zoom(const std::vector<Calibration>& calibrations, const ZoomFitOptions& options,
              ZoomFit* fit, std::string* error) {
  if (calibrations.size() > ZoomCurve::kMaxNodes) {
    *error = std::to_string(calibrations.size()) + " zoom readings are given; up to " +
             std::to_string(ZoomCurve::kMaxNodes) + " can be used";
    return false;
  }
  std::vector<Calibration> sorted = calibrations;
  for (const Calibration& c : sorted) {
    if (!c.zoom || !std::isfinite(*c.zoom)) {
      *error = "a calibration has no zoom reading; one for each is needed";
      return false;
    }
    if (c.camera.width != sorted.front().camera.width ||
        c.camera.height != sorted.front().camera.height) {
      *error = "the calibrations are of images of different sizes; one camera is needed";
      return false;
    }
  }
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Calibration& a, const Calibration& b) { return *a.zoom < *b.zoom; });
  if (sorted.size() < 2 || !(*sorted.back().zoom > *sorted.front().zoom)) {
    *error = "calibrations at two zoom readings or more are needed";
    return false;
  }
  std::vector<Sample> samples;
  std::vector<int> places;
  for (const Calibration& c : sorted) {
    samples.push_back(make_sample(c, sorted.front()));
    const std::vector<int> free = free_places(samples.back().covariance);
    if (samples.size() == 1) places = free;
    if (free != places) {
      *error = "the calibrations at " + reading_text(samples.front().reading) + " and " +
               reading_text(*c.zoom) +
               " do not take the same parameters as exact; make them with "
               "the same priors";
      return false;
    }
  }
  // Where a lens comes back to, it comes back to about the same.
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double apart = samples[i].value[0] - samples[i - 1].value[0];
    const double sigma = std::sqrt(2 * options.repeatability * options.repeatability +
                                   samples[i].covariance(0, 0) + samples[i - 1].covariance(0, 0));
    if (samples[i].reading != samples[i - 1].reading || std::abs(apart) <= 6 * sigma) continue;
    *error = "at " + reading_text(samples[i].reading) + " the focal length is " +
             short_text(std::exp(samples[i - 1].value[0])) + " and " +
             short_text(std::exp(samples[i].value[0])) + " px; does the reading follow the lens?";
    return false;
  }
  for (Sample& sample : samples) {
    if (set_information(places, options, sorted.front(), &sample)) continue;
    *error = "the calibration at " + reading_text(sample.reading) +
             " has a covariance that is not positive";
    return false;
  }
  return Fit(std::move(samples), std::move(places), sorted.front(), options).run(fit, error);
}

}  // namespace alidade
