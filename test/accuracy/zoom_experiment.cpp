#include "test/accuracy/zoom_experiment.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>
#include <ostream>
#include <random>
#include <unordered_set>

#include "core/calibration/zoom_fit.h"
#include "core/model/direction.h"
#include "test/accuracy/report.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

constexpr int kReadings = 40;
constexpr double kMargin_s = 1;  // at either end of a dwell, as `alidade calibrate` has it
constexpr double kLeastDwell_s = 6;
constexpr int kAxesSize = 4;
constexpr std::array<const char*, kZoomQuantityCount> kNames = {"log f", "corner distortion",
                                                                "centre u", "centre v"};

CalibrationInput part_in(const CalibrationInput& all, const ZoomStretch& stretch) {
  CalibrationInput part;
  part.width = all.width;
  part.height = all.height;
  part.noise = all.noise;
  std::unordered_set<std::int64_t> names;
  for (const CalibrationFrame& frame : all.frames) {
    if (frame.stamp_s < stretch.begin_s + kMargin_s || frame.stamp_s > stretch.end_s - kMargin_s)
      continue;
    part.frames.push_back(frame);
    names.insert(frame.frame);
  }
  for (const CalibrationTelemetry& sample : all.telemetry) {
    if (sample.stamp_s >= stretch.begin_s && sample.stamp_s <= stretch.end_s)
      part.telemetry.push_back(sample);
  }
  for (const CalibrationObservation& seen : all.observations) {
    if (names.count(seen.frame) > 0) part.observations.push_back(seen);
  }
  return part;
}

// What a curve says of one run, against the truth.
struct CurveErrors {
  bool fitted = false;
  std::string error;
  std::array<double, kZoomQuantityCount> square{};   // e^T P^-1 e over the nodes
  std::array<double, kZoomQuantityCount> worst{};    // sigmas, of one node
  std::array<double, kZoomQuantityCount> largest{};  // of one node, in the quantity's unit
  std::vector<double> neighbour_px;                  // both coordinates, one node before the last
  double axes_square = 0;
  double axes_worst = 0;                 // rad
  std::vector<double> normalised;        // f at other readings, a movement's error in it
  std::vector<double> normalised_curve;  // without
  std::vector<double> relative;          // errors of f, of the curve
  std::vector<double> relative_sigma;    // a movement's in it
  std::vector<double> relative_nearest;  // errors of the nearest node's f
  int beyond = 0;                        // 3 sigmas
};

double square_of(const Eigen::VectorXd& e, const Eigen::MatrixXd& covariance) {
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const Eigen::VectorXd whitened = scale.asDiagonal() * e;
  return whitened.dot(correlation.ldlt().solve(whitened));
}

// log f, corner distortion, centre.
Eigen::Vector4d quantities_of(const simulator::Lens& lens, const simulator::ImageConfig& image) {
  const double half_diagonal = std::hypot(image.width, image.height) / 2;
  Eigen::Vector4d y;
  y << std::log(lens.focal_length),
      lens.radial_distortion * std::pow(half_diagonal / lens.focal_length, 2),
      lens.centre - Eigen::Vector2d(image.width, image.height) / 2;
  return y;
}

// dwell_s: when each node was visited.
void judge_nodes(const ZoomRecording& truth, const ZoomCurve& curve,
                 const std::vector<double>& dwell_s, CurveErrors* errors) {
  const ZoomCurve::Content& content = curve.content();
  const auto dwells = static_cast<Eigen::Index>(dwell_s.size());
  Eigen::MatrixXd e(dwells, kZoomQuantityCount);
  std::vector<int> node_of;
  for (int i = 0; i < content.nodes; ++i) {
    node_of.push_back(i);
  }
  for (Eigen::Index i = 0; i < dwells; ++i) {
    const auto node = static_cast<std::size_t>(node_of[static_cast<std::size_t>(i)]);
    const Eigen::Vector4d y = quantities_of(
        truth.camera().lens_at(dwell_s[static_cast<std::size_t>(i)]), truth.config().image);
    for (int q = 0; q < kZoomQuantityCount; ++q) {
      e(i, q) = content.level[static_cast<std::size_t>(q)] +
                content.value(kZoomQuantityCount * static_cast<int>(node) + q, 0) - y[q];
    }
  }
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    const auto at = static_cast<std::size_t>(q);
    Eigen::MatrixXd covariance(dwells, dwells);
    for (Eigen::Index i = 0; i < dwells; ++i) {
      for (Eigen::Index j = 0; j < dwells; ++j) {
        covariance(i, j) =
            content.covariance(kZoomQuantityCount * node_of[static_cast<std::size_t>(i)] + q,
                               kZoomQuantityCount * node_of[static_cast<std::size_t>(j)] + q);
      }
      errors->worst[at] =
          std::max(errors->worst[at], std::abs(e(i, q)) / std::sqrt(covariance(i, i)));
      errors->largest[at] = std::max(errors->largest[at], std::abs(e(i, q)));
    }
    // Without the centre, its covariance is zero.
    errors->square[at] = covariance(0, 0) > 0 ? square_of(e.col(q), covariance) : 0;
  }
  for (const int q : {2, 3}) errors->neighbour_px.push_back(e(dwells - 2, q));
  Eigen::VectorXd axes(kAxesSize);
  const Mechanics<double>& mechanics = content.shared.mechanics;
  axes << direction_minus<double>(truth.camera().pan_axis(), mechanics.pan_axis),
      direction_minus<double>(truth.camera().tilt_axis(), mechanics.tilt_axis);
  constexpr int kFirstAxis = 2;  // of kSharedParameters
  static_assert(kSharedParameters[kFirstAxis] == Parameter::kPanAxis0);
  const Eigen::Index row = kZoomQuantityCount * content.nodes + kFirstAxis;
  errors->axes_square = square_of(axes, content.covariance.block(row, row, kAxesSize, kAxesSize));
  errors->axes_worst = axes.cwiseAbs().maxCoeff();
}

void judge_between(const ZoomRecording& truth, const ZoomCurve& curve, std::uint64_t seed,
                   CurveErrors* errors) {
  std::mt19937_64 random(seed + 77);
  std::normal_distribution<double> normal;
  const ZoomCurve::Content& content = curve.content();
  for (int i = 0; i < kReadings; ++i) {
    const double reading = curve.first_reading() +
                           (curve.last_reading() - curve.first_reading()) * (i + 0.5) / kReadings;
    Calibration c;
    if (!curve.at(reading, &c)) {
      errors->error = "no calibration between the nodes";
      return;
    }
    const double f = truth.zoom().nominal_lens(reading).focal_length;
    const double eps = truth.config().zoom->sigma_rep * normal(random);
    const double error = std::log(c.camera.focal_length / f);
    const double sigma =
        std::sqrt(c.covariance(index(Parameter::kFocalLength), index(Parameter::kFocalLength))) /
        c.camera.focal_length;
    const double of_curve =
        std::sqrt(std::max(1e-18, sigma * sigma - std::pow(content.repeatability, 2)));
    errors->normalised.push_back((error - eps) / sigma);
    errors->normalised_curve.push_back(error / of_curve);
    errors->relative.push_back(std::abs(error - eps));
    errors->relative_sigma.push_back(sigma);
    errors->beyond += std::abs(error - eps) > 3 * sigma ? 1 : 0;
    double nearest = 1e300;
    double nearest_f = 0;
    for (int node = 0; node < content.nodes; ++node) {
      const double away = std::abs(content.reading[static_cast<std::size_t>(node)] - reading);
      if (away >= nearest) continue;
      nearest = away;
      nearest_f = curve.node(node).camera.focal_length;
    }
    errors->relative_nearest.push_back(std::abs(std::log(nearest_f / f) - eps));
  }
}

// One recording, its dwells calibrated once with and once without a free optical centre.
struct ZoomRun {
  std::uint64_t seed = 0;
  CurveErrors with_centre;
  CurveErrors middle;  // taken as the centre
};

CurveErrors judge_dwells(const ZoomRecording& recording, const std::vector<ZoomStretch>& dwells,
                         double centre_sigma_px, std::uint64_t seed) {
  CurveErrors errors;
  std::vector<Calibration> calibrations;
  std::vector<double> dwell_s;
  CalibrationOptions options;
  options.centre_sigma_px = centre_sigma_px;
  for (const ZoomStretch& dwell : dwells) {
    CalibrationResult result = calibrate(part_in(recording.input(), dwell), options);
    if (!result.ok()) {
      errors.error = "reading " + number(dwell.zoom) + ": " + result.message;
      continue;
    }
    result.calibration.zoom = dwell.zoom;
    calibrations.push_back(result.calibration);
    dwell_s.push_back((dwell.begin_s + dwell.end_s) / 2 - recording.config().camera.clock_offset);
  }
  ZoomFitOptions fit_options = zoom_fit_options(options);
  fit_options.repeatability = recording.config().zoom->sigma_rep;
  ZoomFit fit;
  errors.fitted = fit_zoom(calibrations, fit_options, &fit, &errors.error);
  if (!errors.fitted) return errors;
  judge_nodes(recording, fit.curve, dwell_s, &errors);
  judge_between(recording, fit.curve, seed, &errors);
  return errors;
}

ZoomRun make_run(const ZoomExperimentOptions& options, std::uint64_t seed) {
  ZoomRun run;
  run.seed = seed;
  const ZoomRecording recording(options.scenario, seed);
  const std::vector<ZoomStretch> dwells =
      find_zoom_stretches(recording.readings(), {0, ZoomStretchOptions().glitch_s, kLeastDwell_s});
  run.with_centre =
      judge_dwells(recording, dwells, kUsualCentreShare * recording.input().width, seed);
  run.middle = judge_dwells(recording, dwells, 0, seed);
  return run;
}

// One way of calibrating over all runs.
class ZoomVerdict {
 public:
  ZoomVerdict(std::string name, bool judged, std::vector<std::string>* missed)
      : name_(std::move(name)), judged_(judged), missed_(missed) {}

  [[nodiscard]] std::string mean_square(const std::string& what, double sum, int count) {
    const double probability = 1 - (1 - kVerdictProbability) / kStatistics;
    const double mean = sum / count;
    if (!mean_square_interval(count, probability).contains(mean))
      fail(what + " is " + number(mean));
    const Interval interval = mean_square_interval(count, kPrintedProbability);
    return number(mean) + " (" + number(interval.low) + " to " + number(interval.high) + ")";
  }
  void fail(const std::string& what) {
    if (judged_) missed_->push_back(name_ + ": " + what);
  }

 private:
  static constexpr int kStatistics = 5;
  std::string name_;
  bool judged_;
  std::vector<std::string>* missed_;
};

double square_mean(const std::vector<double>& values) {
  return std::pow(root_mean_square(values), 2);
}

void report_way(const std::vector<const CurveErrors*>& runs, const std::string& name,
                std::size_t nodes, bool judged, std::vector<std::string>* missed,
                std::ostream& out) {
  ZoomVerdict verdict(name, judged, missed);
  const auto count = static_cast<int>(runs.size());
  Table at_nodes;
  at_nodes.title = name + ", " + std::to_string(count) + " runs: at the nodes";
  at_nodes.header = {"", "mean of e^T P^-1 e a degree of freedom (95 %)", "worst, sigmas",
                     "largest error"};
  for (std::size_t q = 0; q < kNames.size(); ++q) {
    double sum = 0;
    double worst = 0;
    std::vector<double> largest_errors;
    for (const CurveErrors* run : runs) {
      sum += run->square[q];
      worst = std::max(worst, run->worst[q]);
      largest_errors.push_back(run->largest[q]);
    }
    const bool free = sum > 0;
    at_nodes.rows.push_back(
        {kNames[q],
         free ? verdict.mean_square(kNames[q], sum, count * static_cast<int>(nodes)) : "-",
         free ? number(worst) : "-", number(largest(largest_errors))});
  }
  double axes = 0;
  double axes_worst = 0;
  std::vector<double> neighbour;
  for (const CurveErrors* run : runs) {
    axes += run->axes_square;
    axes_worst = std::max(axes_worst, run->axes_worst);
    neighbour.insert(neighbour.end(), run->neighbour_px.begin(), run->neighbour_px.end());
  }
  at_nodes.rows.push_back(
      {"axes", verdict.mean_square("axes", axes, kAxesSize * count), "-", number(axes_worst)});
  std::vector<double> neighbour_sizes;
  for (const double px : neighbour) neighbour_sizes.push_back(std::abs(px));
  at_nodes.notes = {"centre at the node before the last: rms " +
                    number(root_mean_square(neighbour)) + " px, largest " +
                    number(largest(neighbour_sizes)) + " px"};
  at_nodes.print(out);

  std::vector<double> normalised, of_curve, relative, sigma, nearest;
  int beyond_most = 0;
  int beyond = 0;
  const auto add = [](const std::vector<double>& from, std::vector<double>* to) {
    to->insert(to->end(), from.begin(), from.end());
  };
  double largest_normalised = 0;
  for (const CurveErrors* run : runs) {
    add(run->normalised, &normalised);
    add(run->normalised_curve, &of_curve);
    add(run->relative, &relative);
    add(run->relative_sigma, &sigma);
    add(run->relative_nearest, &nearest);
    beyond_most = std::max(beyond_most, run->beyond);
    beyond += run->beyond;
    if (run->beyond > 1) verdict.fail(std::to_string(run->beyond) + " of 40 beyond 3 sigmas");
  }
  for (const double n : normalised) largest_normalised = std::max(largest_normalised, std::abs(n));
  if (largest_normalised > kWrongSigmas)
    verdict.fail("f is " + number(largest_normalised) + " sigmas off");
  Table between;
  between.title = name + ": f at " + std::to_string(kReadings) + " other readings, relative";
  between.header = {"", "median", "rms", "largest"};
  const auto row = [&](const char* what, const std::vector<double>& values) {
    between.rows.push_back(
        {what, number(median(values)), number(root_mean_square(values)), number(largest(values))});
  };
  row("error", relative);
  row("sigma", sigma);
  row("error of the nearest node's f", nearest);
  between.notes = {"error / sigma: mean square " + number(square_mean(normalised)) + ", largest " +
                       number(largest_normalised) +
                       "; the curve's alone, without what a movement adds: mean square " +
                       number(square_mean(of_curve)),
                   std::to_string(beyond) + " of " + std::to_string(normalised.size()) +
                       " beyond 3 sigmas, most in a run " + std::to_string(beyond_most)};
  between.print(out);
}

}  // namespace

std::vector<std::string> run_zoom_experiment(const ZoomExperimentOptions& options,
                                             std::ostream& out) {
  std::vector<std::string> missed;
  std::vector<ZoomRun> runs;
  for (int i = 0; i < options.runs; ++i) {
    runs.push_back(make_run(options, options.first_seed + static_cast<std::uint64_t>(i)));
  }
  const auto report = [&](const char* name, CurveErrors ZoomRun::*way, bool judged) {
    std::vector<const CurveErrors*> fitted;
    for (const ZoomRun& run : runs) {
      const CurveErrors& errors = run.*way;
      if (errors.fitted) fitted.push_back(&errors);
      if (errors.error.empty()) continue;
      out << name << ", seed " << run.seed << ": " << errors.error << "\n";
      if (judged) missed.push_back(std::string(name) + ": " + errors.error);
    }
    if (!fitted.empty()) {
      report_way(fitted, name, options.scenario.focal_lengths.size(), judged, &missed, out);
    }
  };
  report("optical centre estimated", &ZoomRun::with_centre, true);
  report("optical centre taken as the middle", &ZoomRun::middle, false);
  return missed;
}

}  // namespace alidade::test
