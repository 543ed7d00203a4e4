#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <optional>
#include <stdexcept>
#include <utility>

#include "core/pattern/pattern_adjustment.h"
#include "core/pattern/pattern_start.h"
#include "test/accuracy/pattern_paper.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

namespace internal = ::alidade::internal;

struct Pose {
  Eigen::Matrix3d R_pattern_from_camera;
  Eigen::Vector3d centre;  // of the camera, m, pattern's frame
};

Pose true_pose(const HandMotion& motion, const Eigen::Vector3d& board_centre, double time_s) {
  const auto seen = [&](const Eigen::Vector3d& p) {
    return motion.in_camera(p, board_centre, time_s);
  };
  const Eigen::Vector3d origin = seen(Eigen::Vector3d::Zero());
  Eigen::Matrix3d R;
  for (int i = 0; i < 3; ++i) R.col(i) = seen(Eigen::Vector3d::Unit(i)) - origin;
  return {R.transpose(), -R.transpose() * origin};
}

Pose curve_pose(const PoseCurve& curve, double time_s) {
  const PoseVector x = curve.value(curve.basis(time_s));
  return {curve.R_pattern_from_camera(x), x.head<3>()};
}

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::abs(Eigen::AngleAxisd(a.transpose() * b).angle());
}

std::ofstream opened(const std::filesystem::path& folder, const char* name) {
  std::filesystem::create_directories(folder);
  std::ofstream file(folder / name);
  if (!file) throw std::runtime_error("cannot write " + (folder / name).string());
  return file;
}

struct Knots {
  int segments = 0;
  double line_delay_us = 0;
  double sigma_us = 0;
  double cost = 0;  // sum of squared residuals in sigmas over their number
  double position_rms_mm = 0;
};

Knots judged(const PatternScene& scene, const PatternData& data, const LensVector& lens,
             const LensMatrix& covariance, const PoseCurve& curve) {
  Knots knots;
  knots.segments = curve.segments();
  const int p = index(LensParameter::kLineDelay);
  knots.line_delay_us = 1e6 * lens[p];
  knots.sigma_us = 1e6 * std::sqrt(covariance(p, p));
  const auto residuals = pattern_residuals(data, lens, curve);
  double sum = 0;
  for (const PatternResidual& residual : residuals) sum += residual.error.squaredNorm();
  knots.cost = sum / (2 * static_cast<double>(residuals.size()) * scene.noise_px * scene.noise_px);
  const Eigen::Vector3d centre = centre_of(data.points_m);
  const HandMotion motion(scene.seed, scene.speed, scene.hand);
  std::vector<double> errors;
  for (const PatternFrame& frame : data.frames)
    errors.push_back(1e3 * (curve_pose(curve, frame.time_s).centre -
                            true_pose(motion, centre, frame.time_s).centre)
                               .norm());
  knots.position_rms_mm = root_mean_square(errors);
  return knots;
}

// Line delay's error over the number of knots, with two sigmas as bars; the automatic choice in red.
void draw(const std::vector<Knots>& uniform, const Knots& automatic, double true_us,
          std::ostream& svg) {
  constexpr double kWidth = 640, kHeight = 400, kMargin = 60, kHighest_us = 1.5;
  const double most = std::log(uniform.back().segments);
  const double least = std::log(uniform.front().segments);
  const auto x = [&](int segments) {
    return kMargin + (std::log(segments) - least) / (most - least) * (kWidth - 2 * kMargin);
  };
  const auto y = [&](double us) {
    return kHeight / 2 -
           std::clamp(us, -kHighest_us, kHighest_us) / kHighest_us * (kHeight / 2 - kMargin);
  };
  svg << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << kWidth << "\" height=\"" << kHeight
      << "\" font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" "
         "fill=\"white\"/>\n";
  for (const double us : {-kHighest_us, -1.0, -0.5, 0.0, 0.5, 1.0, kHighest_us})
    svg << "<line x1=\"" << kMargin << "\" x2=\"" << kWidth - kMargin << "\" y1=\"" << y(us)
        << "\" y2=\"" << y(us) << "\" stroke=\"#ccc\"/><text x=\"10\" y=\"" << y(us) + 4 << "\">"
        << us << " us</text>\n";
  const auto mark = [&](const Knots& knots, const char* colour) {
    const double error = knots.line_delay_us - true_us;
    svg << "<line x1=\"" << x(knots.segments) << "\" x2=\"" << x(knots.segments) << "\" y1=\""
        << y(error - 2 * knots.sigma_us) << "\" y2=\"" << y(error + 2 * knots.sigma_us)
        << "\" stroke=\"" << colour << "\"/><circle cx=\"" << x(knots.segments) << "\" cy=\""
        << y(error) << "\" r=\"4\" fill=\"" << colour << "\"/>\n";
  };
  for (const Knots& knots : uniform) {
    mark(knots, "black");
    svg << "<text x=\"" << x(knots.segments) - 8 << "\" y=\"" << kHeight - 30 << "\">"
        << knots.segments << "</text>\n";
  }
  mark(automatic, "red");
  svg << "<text x=\"" << kWidth / 2 - 150 << "\" y=\"" << kHeight - 10
      << "\">segments of the curve; red: the automatic choice</text>\n"
      << "<text x=\"" << kMargin << "\" y=\"20\">error of the line delay, with two sigmas (beyond "
      << kHighest_us << " us: at the edge)</text>\n</svg>\n";
}

}  // namespace

void print_uniform_knots(std::uint64_t seed, const std::filesystem::path& folder,
                         std::ostream& out) {
  PatternScene scene;
  scene.seed = seed;
  const PatternData data = simulate_pattern(scene);
  const double true_us = 1e6 * scene.lens.line_delay_s;
  const PatternCalibration calibration = calibrate_pattern(data);
  if (calibration.status != PatternStatus::kOk)
    throw std::runtime_error("figure 4: " + calibration.message);
  const Knots automatic =
      judged(scene, data, calibration.lens, calibration.covariance, calibration.curve);

  internal::PatternMask used;
  for (const PatternFrame& frame : data.frames)
    used.emplace_back(frame.observations.size(), char{1});
  const std::vector<internal::FramePose> poses = internal::start_poses(data, calibration.lens);
  internal::PatternAdjustmentOptions options;
  options.sigma_px = scene.noise_px;
  std::vector<Knots> uniform;
  for (const double knots_per_s :
       {1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0, 38.0, 44.0}) {
    internal::PatternState state;
    state.lens = calibration.lens;
    state.curve = internal::start_curve(poses, 1 / knots_per_s, calibration.frame_interval_s);
    if (internal::adjust_pattern(data, used, {}, options, &state) ==
        internal::AdjustmentEnd::kFailed)
      continue;
    const std::optional<internal::LensCovariance> covariance =
        internal::lens_covariance(data, used, {}, options, state);
    if (covariance)
      uniform.push_back(judged(scene, data, state.lens, covariance->covariance(), state.curve));
  }
  Table table;
  table.title = "Figure 4: uniform knots, one recording of 30 s, " + number(scene.rate_hz) +
                " frames/s, a true line delay of " + number(true_us, 4) + " us";
  table.header = {"segments",
                  "line delay, us",
                  "sigma",
                  "error / sigma",
                  "mean squared residual, sigma^2",
                  "position, rms, mm"};
  std::ofstream csv = opened(folder, "figure4.csv");
  csv << "segments,line_delay_us,sigma_us,mean_squared_residual,position_rms_mm,automatic\n";
  const auto add = [&](const Knots& k, bool is_automatic) {
    table.rows.push_back({std::to_string(k.segments) + (is_automatic ? ", automatic" : ""),
                          number(k.line_delay_us, 5), number(k.sigma_us, 2),
                          number((k.line_delay_us - true_us) / k.sigma_us, 2), number(k.cost),
                          number(k.position_rms_mm)});
    csv << k.segments << ',' << k.line_delay_us << ',' << k.sigma_us << ',' << k.cost << ','
        << k.position_rms_mm << ',' << is_automatic << '\n';
  };
  for (const Knots& knots : uniform) add(knots, false);
  add(automatic, true);
  table.print(out);
  std::ofstream svg = opened(folder, "figure4.svg");
  draw(uniform, automatic, true_us, svg);
}

void print_localization(std::uint64_t seed, const std::filesystem::path& folder,
                        std::ostream& out) {
  PatternScene scene;
  scene.seed = seed;
  scene.rate_hz = 7;
  scene.lens.line_delay_s = 137.5e-6;
  const PatternData data = simulate_pattern(scene);
  const Eigen::Vector3d centre = centre_of(data.points_m);
  const HandMotion motion(scene.seed, scene.speed, scene.hand);
  PatternCalibrationOptions options;
  options.known.mean = truth_of(scene.lens);
  options.known.fixed.fill(true);
  const PatternCalibration rolling = calibrate_pattern(data, options);
  if (rolling.status != PatternStatus::kOk)
    throw std::runtime_error("figure 5: " + rolling.message);
  LensVector global = options.known.mean;
  global[index(LensParameter::kLineDelay)] = 0;
  const double half_readout_s = 0.5 * scene.height * scene.lens.line_delay_s;

  struct Errors {
    const char* name;
    std::vector<double> position_mm, turn_rad;
  };
  Errors by_curve{"rolling shutter, curve", {}, {}};
  Errors by_frame{"frame by frame, at its first row's time", {}, {}};
  Errors by_middle{"frame by frame, at its middle row's time", {}, {}};
  std::ofstream csv = opened(folder, "figure5.csv");
  csv << "time_s,curve_mm,curve_rad,frame_mm,frame_rad,middle_mm,middle_rad\n";
  for (const internal::FramePose& pose : internal::start_poses(data, global)) {
    const double time_s = data.frames[static_cast<std::size_t>(pose.frame)].time_s;
    const auto add = [&](Errors* errors, const Pose& found, double at_s) {
      const Pose truth = true_pose(motion, centre, at_s);
      errors->position_mm.push_back(1e3 * (found.centre - truth.centre).norm());
      errors->turn_rad.push_back(
          angle_between(found.R_pattern_from_camera, truth.R_pattern_from_camera));
    };
    add(&by_curve, curve_pose(rolling.curve, time_s), time_s);
    add(&by_frame, {pose.R_pattern_from_camera, pose.centre}, time_s);
    add(&by_middle, {pose.R_pattern_from_camera, pose.centre}, time_s + half_readout_s);
    csv << time_s;
    for (const Errors* errors : {&by_curve, &by_frame, &by_middle})
      csv << ',' << errors->position_mm.back() << ',' << errors->turn_rad.back();
    csv << '\n';
  }
  Table table;
  table.title =
      "Figure 5: where the camera is, 30 s, 7 frames/s, 137.5 us; mean absolute errors (the paper, "
      "against Vicon: 8.34 mm and 0.03 rad, 189 mm and 0.34 rad)";
  table.header = {"", "position, mm", "orientation, rad", "largest, mm"};
  for (const Errors* errors : {&by_curve, &by_frame, &by_middle})
    table.rows.push_back({errors->name, number(mean(errors->position_mm)),
                          number(mean(errors->turn_rad), 2), number(largest(errors->position_mm))});
  table.print(out);
}

}  // namespace alidade::test
