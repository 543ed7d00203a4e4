#include "core/calibration/zoom_solution.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/calibration/number_text.h"
#include "core/calibration/partial_inverse.h"
#include "core/model/direction.h"

namespace alidade::internal {
namespace {

constexpr const char* kUndetermined =
    "the calibrations leave what their readings share undetermined";
constexpr int kFirstCentre = static_cast<int>(ZoomQuantity::kCentreU);  // and the one after it

// Prior covariance of the nodes' values. It includes the lens's repeatability at each dwell.
Eigen::MatrixXd process_covariance(const ZoomCurve::Content& content, int quantity) {
  const ZoomSmoothness& smoothness = content.smoothness[static_cast<std::size_t>(quantity)];
  const double first = content.reading[0];
  const double last = content.reading[static_cast<std::size_t>(content.nodes - 1)];
  const auto position = [&](int node) {
    return (content.reading[static_cast<std::size_t>(node)] - first) / (last - first);
  };
  // Two dwells at one reading get a tiny variance between them, else rounding makes K singular. It
  // is hundredths of a pixel.
  const double apart = quantity == 0 ? 1e-5 : 1e-4;
  Eigen::MatrixXd K(content.nodes, content.nodes);
  for (int i = 0; i < content.nodes; ++i) {
    for (int j = 0; j < content.nodes; ++j)
      K(i, j) = smoothness.covariance(position(i), position(j));
    K(i, i) += std::pow(apart * smoothness.level_sigma, 2);
    if (quantity == 0 && !content.is_between[static_cast<std::size_t>(i)])
      K(i, i) += content.repeatability * content.repeatability;
  }
  return K;
}

// Rise of log f from the first dwell to the last, by least squares with a loose prior on the
// curve's shape.
double rise_of(const ZoomEvidence& evidence) {
  constexpr double kAny = 10;  // sigma of log f less its level
  Eigen::MatrixXd information = evidence.information[0];
  information.diagonal().array() += 1 / (kAny * kAny);
  const Eigen::VectorXd log_f = information.ldlt().solve(evidence.weighted[0]);
  int first = 0;
  int last = evidence.nodes() - 1;
  while (first < last && evidence.is_between[static_cast<std::size_t>(first)]) ++first;
  while (last > first && evidence.is_between[static_cast<std::size_t>(last)]) --last;
  return log_f[last] - log_f[first];
}

// Usual lenses: the logarithm of the focal length bends by as much as it rises, the distortion at
// the corner is some hundredths, and the centre is within a hundredth of the image and wanders by
// half of that.
std::array<ZoomSmoothness, kZoomQuantityCount> usual(double rise, const Camera<double>& camera) {
  static_assert(kDistortionCount == 1, "a usual smoothness for each quantity");
  const double centre_px = kUsualCentreShare * camera.width;
  return {ZoomSmoothness{5, 20, 1.5 * std::max(std::abs(rise), 0.1)}, ZoomSmoothness{0.3, 0.3, 0.1},
          ZoomSmoothness{centre_px, centre_px, 0.5 * centre_px},
          ZoomSmoothness{centre_px, centre_px, 0.5 * centre_px}};
}

// Log likelihood of a quantity's roughness. It also holds if A leaves a node undetermined. With K
// the process's covariance, A the marginal information and b = A times the mean:
//   -(log |K| + log |K^-1 + A| - b^T (K^-1 + A)^-1 b) / 2
std::optional<double> curve_likelihood(const ZoomCurve::Content& content, int quantity,
                                       const ZoomEvidence& evidence) {
  const auto of = static_cast<std::size_t>(quantity);
  const Eigen::MatrixXd inverse = scaled_inverse(process_covariance(content, quantity));
  if (inverse.size() == 0) return std::nullopt;
  const auto log_determinant = [](const Eigen::MatrixXd& matrix, Eigen::LLT<Eigen::MatrixXd>* llt,
                                  Eigen::VectorXd* scale) -> std::optional<double> {
    *scale = matrix.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    llt->compute(scale->asDiagonal() * matrix * scale->asDiagonal());
    if (llt->info() != Eigen::Success) return std::nullopt;
    return 2 * (llt->matrixLLT().diagonal().array().log().sum() - scale->array().log().sum());
  };
  Eigen::LLT<Eigen::MatrixXd> of_prior;
  Eigen::LLT<Eigen::MatrixXd> of_both;
  Eigen::VectorXd scale;
  const auto prior = log_determinant(inverse, &of_prior, &scale);
  const auto both = log_determinant(inverse + evidence.information[of], &of_both, &scale);
  if (!prior || !both) return std::nullopt;
  const Eigen::VectorXd b = scale.cwiseProduct(evidence.weighted[of]);
  return 0.5 * (*prior - *both + b.dot(of_both.solve(b)));
}

bool is_monotone(const ZoomCurve& curve, std::string* error) {
  constexpr int kSteps = 200;
  const auto& value = curve.content().value;
  const bool rises = value(kZoomQuantityCount * (curve.content().nodes - 1), 0) > value(0, 0);
  double last_f = 0;
  double last = 0;
  for (int i = 0; i <= kSteps; ++i) {
    const double reading =
        curve.first_reading() + (curve.last_reading() - curve.first_reading()) * i / kSteps;
    Calibration c;
    if (!curve.at(reading, &c)) return false;
    const double sigma = parameter_sigma(c, Parameter::kFocalLength);
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

}  // namespace

ZoomSolution::ZoomSolution(ZoomEvidence evidence, std::vector<int> places,
                           const Calibration& reference, const ZoomFitOptions& options)
    : evidence_(std::move(evidence)),
      places_(std::move(places)),
      reference_(reference),
      options_(options),
      nodes_(evidence_.nodes()) {}

bool ZoomSolution::run(std::string* error) {
  const bool determined =
      set_marginals(places_, kUsualCentreShare * reference_.camera.width, &evidence_);
  if (!determined) {
    *error = kUndetermined;
    return false;
  }
  set_nodes();
  content_.repeatability = options_.repeatability;
  content_.smoothness = usual(rise_of(evidence_), reference_.camera);
  choose_roughness();
  if (solve()) return true;
  *error = kUndetermined;
  return false;
}

bool ZoomSolution::run_as(const ZoomCurve::Content& before, std::string* error) {
  set_nodes();
  content_.repeatability = before.repeatability;
  content_.smoothness = before.smoothness;
  // Roughness is per range of readings, which a node beyond the ends makes longer.
  const auto range = [](const ZoomCurve::Content& content) {
    return content.reading[static_cast<std::size_t>(content.nodes - 1)] - content.reading[0];
  };
  const double longer = range(content_) / range(before);
  for (ZoomSmoothness& smoothness : content_.smoothness) {
    smoothness.slope_sigma *= longer;
    smoothness.roughness *= longer * std::sqrt(longer);
  }
  if (solve()) return true;
  *error = kUndetermined;
  return false;
}

void ZoomSolution::set_nodes() {
  content_.nodes = nodes_;
  std::copy(evidence_.reading.begin(), evidence_.reading.end(), content_.reading.begin());
  std::copy(evidence_.is_between.begin(), evidence_.is_between.end(), content_.is_between.begin());
  content_.level = evidence_.level;
}

ZoomSampleVector ZoomSolution::left_of(const ZoomSample& sample, int node) const {
  ZoomSampleVector left = sample.value;
  for (int a = 0; a < kZoomSampleSize; ++a) left[a] -= solution_[evidence_.row(node, a)];
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    left[q] -= content_.level[static_cast<std::size_t>(q)];
  }
  return left;
}

int ZoomSolution::shared_places() const {
  return static_cast<int>(std::count_if(places_.begin(), places_.end(),
                                        [](int place) { return place >= kZoomQuantityCount; }));
}

bool ZoomSolution::curve(ZoomCurve* curve, std::string* error) const {
  *curve = ZoomCurve(content_);
  return is_monotone(*curve, error);
}

// The likelihood of each quantity by itself, with the others free. The nodes determine log f and
// distortion so well that the most likely roughness will do. Centres are known less well: the most
// likely roughness is often too smooth, and pulls them off by more than their sigmas. Their
// likelihood-weighted mean roughness is larger.
void ZoomSolution::choose_roughness() {
  constexpr int kSteps = 33;
  constexpr double kDecades = 2;          // on either side
  constexpr double kPriorDecades = 0.75;  // standard deviation
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    ZoomSmoothness& smoothness = content_.smoothness[static_cast<std::size_t>(q)];
    const double usual_roughness = smoothness.roughness;
    std::vector<double> roughness;
    std::vector<double> likelihood;
    for (int step = 0; step < kSteps; ++step) {
      const double decades = kDecades * (2.0 * step / (kSteps - 1) - 1);
      smoothness.roughness = usual_roughness * std::pow(10, decades);
      const std::optional<double> of_data = curve_likelihood(content_, q, evidence_);
      if (!of_data) continue;
      roughness.push_back(smoothness.roughness);
      likelihood.push_back(*of_data - 0.5 * std::pow(decades / kPriorDecades, 2));
    }
    smoothness.roughness = usual_roughness;
    if (likelihood.empty()) continue;
    const auto best = std::max_element(likelihood.begin(), likelihood.end());
    smoothness.roughness = roughness[static_cast<std::size_t>(best - likelihood.begin())];
    if (q < kFirstCentre) continue;
    double sum = 0;
    double weights = 0;
    for (std::size_t i = 0; i < roughness.size(); ++i) {
      const double weight = std::exp(likelihood[i] - *best);
      sum += weight * roughness[i];
      weights += weight;
    }
    smoothness.roughness = sum / weights;
  }
}

bool ZoomSolution::solve() {
  if (!set_inverses(&content_)) return false;
  Eigen::MatrixXd H = evidence_.H;
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    const auto& inverse = content_.inverse[static_cast<std::size_t>(q)];
    for (int i = 0; i < nodes_; ++i) {
      for (int j = 0; j < nodes_; ++j) H(evidence_.row(i, q), evidence_.row(j, q)) += inverse(i, j);
    }
  }
  // Parameters that all calibrations take as exact stay exact.
  const Eigen::MatrixXd covariance = inverse_over(H, evidence_.rows(places_));
  if (covariance.size() == 0) return false;
  content_.covariance = covariance;
  solution_ = content_.covariance * evidence_.g;
  content_.value = solution_.head(kZoomQuantityCount * nodes_);
  take_shared(solution_.tail<kSharedCount>());
  const int clock = evidence_.row(0, zoom_place_of(Parameter::kClockOffset));
  content_.covariance(clock, clock) += std::pow(options_.common_clock_sigma_s, 2);
  return true;
}

void ZoomSolution::take_shared(const Eigen::Matrix<double, kSharedCount, 1>& change) {
  const auto of = [&](Parameter p) { return change[zoom_place_of(p) - kZoomQuantityCount]; };
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

}  // namespace alidade::internal

namespace alidade {

bool set_inverses(ZoomCurve::Content* content) {
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    const Eigen::MatrixXd inverse =
        internal::scaled_inverse(internal::process_covariance(*content, q));
    if (inverse.size() == 0) return false;
    content->inverse[static_cast<std::size_t>(q)] = inverse;
  }
  return true;
}

}  // namespace alidade
