#include "test/accuracy/zoom_experiment.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
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
  Eigen::MatrixXd normalised_nodes;                  // nodes x quantities, sigmas
  std::array<double, kZoomQuantityCount> worst{};    // sigmas, of one node
  std::array<double, kZoomQuantityCount> largest{};  // of one node, in the quantity's unit
  std::vector<double> neighbour_px;                  // both coordinates, one node before the last
  double axes_square = 0;
  double axes_worst = 0;                 // rad
  std::vector<double> normalised;        // f at other readings, a movement's error in it
  std::vector<double> normalised_curve;  // without
  std::vector<double> relative;          // errors of f
  std::vector<double> relative_curve;    // without
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
  errors->normalised_nodes.setZero(dwells, kZoomQuantityCount);
  std::vector<int> node_of;
  for (int i = 0; i < content.nodes; ++i) {
    if (!content.is_between[static_cast<std::size_t>(i)]) node_of.push_back(i);
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
      if (covariance(i, i) > 0)
        errors->normalised_nodes(i, q) = e(i, q) / std::sqrt(covariance(i, i));
      errors->worst[at] = std::max(errors->worst[at], std::abs(errors->normalised_nodes(i, q)));
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
    const double sigma = relative_focal_length_sigma(c);
    const double of_curve =
        std::sqrt(std::max(1e-18, sigma * sigma - std::pow(content.repeatability, 2)));
    errors->normalised.push_back((error - eps) / sigma);
    errors->normalised_curve.push_back(error / of_curve);
    errors->relative.push_back(std::abs(error - eps));
    errors->relative_curve.push_back(std::abs(error));
    errors->relative_sigma.push_back(sigma);
    errors->beyond += std::abs(error - eps) > 3 * sigma ? 1 : 0;
    double nearest = 1e300;
    double nearest_f = 0;
    for (int node = 0; node < content.nodes; ++node) {
      const double away = std::abs(content.reading[static_cast<std::size_t>(node)] - reading);
      if (away >= nearest || content.is_between[static_cast<std::size_t>(node)]) continue;
      nearest = away;
      nearest_f = curve.node(node).camera.focal_length;
    }
    errors->relative_nearest.push_back(std::abs(std::log(nearest_f / f) - eps));
  }
}

// Calibrations of single dwells, each by itself: squares of errors over sigmas.
struct AloneErrors {
  std::array<std::vector<double>, kZoomQuantityCount> square;
  std::vector<double> axes_square;  // e^T P^-1 e
  std::vector<double> axes_worst;   // rad
};

struct ZoomRun {
  std::uint64_t seed = 0;
  std::vector<std::string> errors;
  AloneErrors alone;         // optical centre free
  AloneErrors alone_middle;  // the image's middle taken as the optical centre
  CurveErrors dwells;
  CurveErrors movements;  // their part in it
};

struct Dwells {
  std::vector<ZoomStretch> stretch;  // of each calibration
  std::vector<Calibration> calibration;
  std::vector<double> time_s;  // of the middle, true
};

Dwells calibrate_dwells(const ZoomRecording& recording, const std::vector<ZoomStretch>& stretches,
                        const CalibrationOptions& options, std::vector<std::string>* errors) {
  Dwells dwells;
  for (const ZoomStretch& dwell : stretches) {
    CalibrationResult result = calibrate(part_in(recording.input(), dwell), options);
    if (!result.ok()) {
      errors->push_back("reading " + number(dwell.zoom) + " left out: " + result.message);
      continue;
    }
    result.calibration.zoom = dwell.zoom;
    dwells.stretch.push_back(dwell);
    dwells.calibration.push_back(result.calibration);
    dwells.time_s.push_back((dwell.begin_s + dwell.end_s) / 2 -
                            recording.config().camera.clock_offset);
  }
  return dwells;
}

AloneErrors judge_alone(const ZoomRecording& recording, const Dwells& dwells) {
  AloneErrors errors;
  for (std::size_t i = 0; i < dwells.calibration.size(); ++i) {
    const Calibration& c = dwells.calibration[i];
    const simulator::Lens lens = recording.camera().lens_at(dwells.time_s[i]);
    const Eigen::Vector2d centre =
        lens.centre - Eigen::Vector2d(c.camera.width, c.camera.height) / 2;
    const std::array<double, kZoomQuantityCount> error = {
        c.camera.focal_length - lens.focal_length,
        c.camera.distortion.radial - lens.radial_distortion, c.camera.centre_u - centre.x(),
        c.camera.centre_v - centre.y()};
    constexpr std::array<Parameter, kZoomQuantityCount> kOf = {
        Parameter::kFocalLength, Parameter::kRadialDistortion, Parameter::kCentreU,
        Parameter::kCentreV};
    for (std::size_t q = 0; q < kOf.size(); ++q) {
      const double variance = c.covariance(index(kOf[q]), index(kOf[q]));
      if (variance > 0) errors.square[q].push_back(error[q] * error[q] / variance);
    }
    Eigen::VectorXd axes(kAxesSize);
    axes << direction_minus<double>(recording.camera().pan_axis(), c.mechanics.pan_axis),
        direction_minus<double>(recording.camera().tilt_axis(), c.mechanics.tilt_axis);
    const int first = index(Parameter::kPanAxis0);
    errors.axes_square.push_back(
        square_of(axes, c.covariance.block<kAxesSize, kAxesSize>(first, first)));
    errors.axes_worst.push_back(axes.cwiseAbs().maxCoeff());
  }
  return errors;
}

CurveErrors judge_curve(const ZoomRecording& recording, const Dwells& dwells,
                        const std::vector<MovementObservation>& movements,
                        const CalibrationOptions& options, const ZoomExperimentOptions& experiment,
                        std::uint64_t seed, ZoomFit* fit) {
  CurveErrors errors;
  ZoomFitOptions fit_options = zoom_fit_options(options);
  fit_options.zoom_late_sigma_s = experiment.zoom_late_sigma_s;
  fit_options.repeatability = recording.config().zoom->sigma_rep;
  errors.fitted = fit_zoom(dwells.calibration, movements, fit_options, fit, &errors.error);
  if (!errors.fitted) return errors;
  // Nodes are in the order of readings.
  std::vector<std::size_t> order(dwells.time_s.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return dwells.stretch[a].zoom < dwells.stretch[b].zoom;
  });
  std::vector<double> time_s;
  for (const std::size_t i : order) time_s.push_back(dwells.time_s[i]);
  judge_nodes(recording, fit->curve, time_s, &errors);
  judge_between(recording, fit->curve, seed, &errors);
  return errors;
}

ZoomRun make_run(const ZoomExperimentOptions& options, std::uint64_t seed) {
  ZoomRun run;
  run.seed = seed;
  const ZoomRecording recording(options.scenario, seed);
  const std::vector<ZoomStretch> stretches =
      find_zoom_stretches(recording.readings(), {0, ZoomStretchOptions().glitch_s, kLeastDwell_s});
  CalibrationOptions calibration;
  std::vector<std::string> ignored;
  run.alone_middle =
      judge_alone(recording, calibrate_dwells(recording, stretches, calibration, &ignored));
  calibration.centre_sigma_px = kUsualCentreShare * recording.input().width;
  const Dwells dwells = calibrate_dwells(recording, stretches, calibration, &run.errors);
  run.alone = judge_alone(recording, dwells);
  ZoomFit fit;
  run.dwells = judge_curve(recording, dwells, {}, calibration, options, seed, &fit);
  if (!run.dwells.fitted) {
    run.errors.push_back(run.dwells.error);
    return run;
  }
  if (!options.movements) return run;
  std::vector<MovementObservation> observations;
  const std::vector<double> readings = readings_between(dwells.calibration);
  for (const ZoomMovement& movement :
       find_movements(recording.input(), recording.readings(), dwells.stretch)) {
    MovementObservation observation;
    std::string error;
    if (!observe_movement(movement, fit.curve, readings, &observation, &error)) {
      run.errors.push_back("movement from " + number(movement.from.zoom) + " to " +
                           number(movement.to.zoom) + ": " + error);
      continue;
    }
    for (std::size_t i = 0; i < dwells.stretch.size(); ++i) {
      if (dwells.stretch[i].begin_s == movement.from.begin_s) observation.from = i;
      if (dwells.stretch[i].begin_s == movement.to.begin_s) observation.to = i;
    }
    observations.push_back(observation);
  }
  ZoomFit with_movements;
  run.movements =
      judge_curve(recording, dwells, observations, calibration, options, seed, &with_movements);
  if (!run.movements.fitted) run.errors.push_back(run.movements.error);
  return run;
}

// One way of calibrating over all runs.
class ZoomVerdict {
 public:
  ZoomVerdict(std::string name, std::vector<std::string>* missed)
      : name_(std::move(name)), missed_(missed) {}

  [[nodiscard]] std::string mean_square(const std::string& what, double sum, int count) {
    const double probability = 1 - (1 - kVerdictProbability) / kStatistics;
    const double mean = sum / count;
    if (!mean_square_interval(count, probability).contains(mean))
      fail(what + " is " + number(mean));
    const Interval interval = mean_square_interval(count, kPrintedProbability);
    return number(mean) + " (" + number(interval.low) + " to " + number(interval.high) + ")";
  }
  void fail(const std::string& what) { missed_->push_back(name_ + ": " + what); }

 private:
  static constexpr int kStatistics = 5;
  std::string name_;
  std::vector<std::string>* missed_;
};

double square_mean(const std::vector<double>& values) {
  return std::pow(root_mean_square(values), 2);
}

void report_way(const std::vector<const CurveErrors*>& runs, const std::string& name,
                std::size_t nodes, std::vector<std::string>* missed, std::ostream& out) {
  ZoomVerdict verdict(name, missed);
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
  for (std::size_t q = 0; q < kNames.size(); ++q) {
    std::string text = std::string("mean of (error / sigma)^2 of ") + kNames[q] + ", node by node:";
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(nodes); ++i) {
      double sum = 0;
      for (const CurveErrors* run : runs) {
        sum += std::pow(run->normalised_nodes(i, static_cast<Eigen::Index>(q)), 2);
      }
      text += " " + number(sum / count);
    }
    at_nodes.notes.push_back(text);
  }
  at_nodes.notes.push_back("centre at the node before the last: rms " +
                           number(root_mean_square(neighbour)) + " px, largest " +
                           number(largest(neighbour_sizes)) + " px");
  at_nodes.print(out);

  std::vector<double> normalised, of_curve, relative, relative_curve, sigma, nearest;
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
    add(run->relative_curve, &relative_curve);
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
  row("the curve's alone, without what a movement adds", relative_curve);
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

void report_alone(const std::vector<ZoomRun>& runs, AloneErrors ZoomRun::*way, const char* name,
                  std::ostream& out) {
  Table table;
  table.title = std::string("each dwell by itself, ") + name + ": mean of (error / sigma)^2";
  table.header = {"", "", "95 %", "largest, sigmas"};
  const auto add = [&](const char* what, const std::vector<double>& squares, int size) {
    if (squares.empty()) return;
    const Interval interval =
        mean_square_interval(size * static_cast<int>(squares.size()), kPrintedProbability);
    table.rows.push_back({what, number(mean(squares) / size),
                          number(interval.low) + " to " + number(interval.high),
                          number(std::sqrt(largest(squares)))});
  };
  for (std::size_t q = 0; q < kNames.size(); ++q) {
    std::vector<double> squares;
    for (const ZoomRun& run : runs) {
      squares.insert(squares.end(), (run.*way).square[q].begin(), (run.*way).square[q].end());
    }
    add(q == 0 ? "f" : q == 1 ? "k" : kNames[q], squares, 1);
  }
  std::vector<double> axes;
  std::vector<double> worst;
  for (const ZoomRun& run : runs) {
    axes.insert(axes.end(), (run.*way).axes_square.begin(), (run.*way).axes_square.end());
    worst.insert(worst.end(), (run.*way).axes_worst.begin(), (run.*way).axes_worst.end());
  }
  add("axes", axes, kAxesSize);
  table.notes = {"largest error of an axis " + number(largest(worst)) + " rad"};
  table.print(out);
}

}  // namespace

std::vector<std::string> run_zoom_experiment(const ZoomExperimentOptions& options,
                                             std::ostream& out) {
  std::vector<std::string> missed;
  std::vector<ZoomRun> runs;
  for (int i = 0; i < options.runs; ++i) {
    runs.push_back(make_run(options, options.first_seed + static_cast<std::uint64_t>(i)));
    for (const std::string& error : runs.back().errors) {
      out << "seed " << runs.back().seed << ": " << error << "\n";
      missed.push_back("seed " + std::to_string(runs.back().seed) + ": " + error);
    }
  }
  report_alone(runs, &ZoomRun::alone_middle, "the middle taken as the optical centre", out);
  report_alone(runs, &ZoomRun::alone, "optical centre free", out);
  const auto report = [&](const char* name, CurveErrors ZoomRun::*way) {
    std::vector<const CurveErrors*> fitted;
    for (const ZoomRun& run : runs) {
      if ((run.*way).fitted) fitted.push_back(&(run.*way));
    }
    if (!fitted.empty()) {
      report_way(fitted, name, options.scenario.focal_lengths.size(), &missed, out);
    }
  };
  report("curve of the dwells", &ZoomRun::dwells);
  if (options.movements) report("curve of dwells and movements", &ZoomRun::movements);
  return missed;
}

}  // namespace alidade::test
