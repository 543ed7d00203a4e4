#include "test/accuracy/map_stills.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <optional>
#include <ostream>
#include <random>

#include "core/mapping/map_adjustment.h"
#include "core/model/mechanics.h"
#include "test/accuracy/homography_chain.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"
#include "test/simulator/lens.h"
#include "test/simulator/zoom_curve.h"

namespace alidade::test {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;
constexpr int kLevels = 5;
constexpr int kColumns = 5;
constexpr int kRows = 4;
constexpr double kWide_px = 1200;
constexpr double kTele_px = 24000;
constexpr double kSmallest_px = 1.5;
constexpr double kLargest_px = 12;

struct TruePicture {
  int level = 0;
  double pan = 0, tilt = 0;
  Eigen::Matrix3d R;  // base from camera
  simulator::Lens lens;
};

struct Stills {
  std::vector<TruePicture> pictures;
  MapEvidence evidence;
  double first_position = 0, last_position = 0;
};

simulator::ZoomConfig zoom_of_stills() {
  simulator::ZoomConfig out;
  out.focal_length = {kWide_px, kTele_px};
  out.distortion = {-0.04, 0.015};
  out.centre = {5, -3};
  out.centre_wander = 4;
  return out;
}

Eigen::Vector3d pan_axis() { return Eigen::Vector3d(-0.012, 0.001, 1).normalized(); }
Eigen::Vector3d tilt_axis() { return Eigen::Vector3d(0.002, 1, 0.014).normalized(); }

Eigen::Matrix3d orientation(double pan, double tilt, double roll) {
  Eigen::Matrix3d base_from_rdf;
  base_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
  return Eigen::AngleAxisd(pan, pan_axis()).toRotationMatrix() *
         Eigen::AngleAxisd(tilt, tilt_axis()).toRotationMatrix() * base_from_rdf *
         Eigen::AngleAxisd(roll, Eigen::Vector3d::UnitZ()).toRotationMatrix();
}

class StillsMaker {
 public:
  StillsMaker(const MapStillsOptions& options, std::uint64_t seed)
      : options_(options), curve_(zoom_of_stills()), random_(seed) {}

  [[nodiscard]] Stills make() {
    Stills out;
    const double margin = 0.02;
    out.first_position = std::log(kWide_px) - options_.sheet_error - margin;
    out.last_position = std::log(kTele_px) + options_.sheet_error + margin;
    for (int level = 0; level < kLevels; ++level) {
      for (int column = 0; column < kColumns; ++column) {
        for (int row = 0; row < kRows; ++row) add_picture(level, column, row, &out);
      }
    }
    for (const TruePicture& picture : out.pictures) {
      for (int i = 0; i < options_.directions; ++i) add_landmark(picture, &out);
    }
    return out;
  }

 private:
  double normal() { return normal_(random_); }
  double part() { return part_(random_); }

  void add_picture(int level, int column, int row, Stills* out) {
    const double range = std::log(kTele_px / kWide_px);
    const double log_nominal =
        std::clamp(std::log(kWide_px) + range * level / (kLevels - 1) + 0.2 * (part() - 0.5),
                   std::log(kWide_px), std::log(kTele_px));
    const double w = curve_.part_at(log_nominal);
    TruePicture picture;
    picture.level = level;
    const double eps = options_.repeatability * normal();
    const double on_curve = std::exp(curve_.log_focal_length(w));
    picture.lens.focal_length = on_curve * std::exp(eps);
    picture.lens.radial_distortion = curve_.distortion(w) * std::pow(2 * on_curve / kWidth, 2) *
                                     std::exp(2 * options_.hold * eps);
    picture.lens.centre = Eigen::Vector2d(kWidth, kHeight) / 2 + curve_.centre_offset(w);
    const double field_u = kWidth / std::exp(log_nominal);
    const double field_v = kHeight / std::exp(log_nominal);
    picture.pan = 0.4 + field_u * (0.5 * (column - (kColumns - 1) / 2.0) + 0.1 * (part() - 0.5));
    picture.tilt = -0.1 + field_v * (0.5 * (row - (kRows - 1) / 2.0) + 0.1 * (part() - 0.5));
    picture.R = orientation(picture.pan, picture.tilt, options_.roll_wobble * normal());
    out->pictures.push_back(picture);

    MapPicture known;
    known.position = log_nominal + options_.sheet_error * std::sin(2 + 1.3 * log_nominal);
    known.eps_sigma = options_.repeatability;
    const auto measured = [&](double angle) {
      return angle + options_.angle_noise * normal() +
             (part() < 0.5 ? -options_.backlash : options_.backlash);
    };
    Mechanics<double> mechanics;
    mechanics.pan_axis = pan_axis();
    mechanics.tilt_axis = tilt_axis();
    Matrix<double, 3, 2> J;
    OrientationPrior prior;
    prior.R_base_from_camera = R_base_from_camera(
        mechanics, PanTilt<double>{measured(picture.pan), measured(picture.tilt)}, &J);
    const double angle_variance = std::pow(std::hypot(options_.angle_noise, options_.backlash), 2);
    prior.covariance = angle_variance * J * J.transpose();
    prior.covariance(2, 2) += options_.roll_wobble * options_.roll_wobble;
    known.R_start = prior.R_base_from_camera;
    known.telemetry = prior;
    out->evidence.pictures.push_back(known);
  }

  void add_landmark(const TruePicture& born, Stills* out) {
    const Eigen::Vector2d at(kWidth * part(), kHeight * part());
    const Eigen::Vector2d slope = born.lens.slope(at.x(), at.y());
    const Eigen::Vector3d d = (born.R * Eigen::Vector3d(slope.x(), slope.y(), 1)).normalized();
    const double size =
        kSmallest_px * std::pow(kLargest_px / kSmallest_px, part()) / born.lens.focal_length;
    const int landmark = out->evidence.landmarks++;
    for (std::size_t i = 0; i < out->pictures.size(); ++i) {
      const TruePicture& picture = out->pictures[i];
      const double size_px = size * picture.lens.focal_length;
      if (size_px < kSmallest_px || size_px > kLargest_px || part() < 0.5) continue;
      const auto u = picture.lens.project(picture.R.transpose() * d);
      if (!u || u->x() < 0 || u->x() > kWidth || u->y() < 0 || u->y() > kHeight) continue;
      MapObservation seen;
      seen.picture = static_cast<int>(i);
      seen.landmark = landmark;
      seen.sigma_px = options_.nearest_px * std::pow(3, std::log(size_px / kSmallest_px) /
                                                            std::log(kLargest_px / kSmallest_px));
      seen.u = *u + seen.sigma_px * Eigen::Vector2d(normal(), normal());
      if (part() < options_.wrong_share) {
        // Half of the wrong ones anywhere, half beside the right place.
        seen.u = part() < 0.5 ? Eigen::Vector2d(kWidth * part(), kHeight * part())
                              : Eigen::Vector2d(*u + 5 * Eigen::Vector2d(normal(), normal()));
      }
      out->evidence.observations.push_back(seen);
    }
  }

  MapStillsOptions options_;
  simulator::ZoomCurve curve_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> part_{0, 1};
};

struct Variant {
  std::string name;
  bool free_focal_lengths = false;  // of each picture by itself; else a curve and the repeatability
  bool centre_in_middle = false;
  bool no_distortion = false;
  bool no_telemetry = false;
  bool homographies = false;  // no adjustment: from one picture to the next
};

// From the middle of the widest pictures, which is told where it looks, and its true focal length.
MapAdjustment chain(const Stills& stills) {
  constexpr int kRoot = kRows * (kColumns / 2) + kRows / 2;
  const TruePicture& truth = stills.pictures[kRoot];
  AdjustedPicture known;
  known.R_base_from_camera = truth.R;
  known.camera = {truth.lens.focal_length, 1, {0}, kWidth, kHeight};
  std::vector<char> reached;
  MapAdjustment out;
  out.pictures = chain_homographies(stills.evidence, kRoot, known, &reached);
  const bool all = std::find(reached.begin(), reached.end(), 0) == reached.end();
  out.status = all ? MapStatus::kOk : MapStatus::kNotConnected;
  return out;
}

MapAdjustment adjust_variant(const Stills& stills, const Variant& variant) {
  if (variant.homographies) return chain(stills);
  constexpr double kHeld = 1e-7;
  MapOptions options;
  options.lens = LensCurve({kWide_px, 1, {0}, kWidth, kHeight}, stills.first_position,
                           stills.last_position, 0.3);
  if (variant.free_focal_lengths) options.level_sigma[0] = kHeld;
  if (variant.no_distortion) options.level_sigma[1] = kHeld;
  if (variant.centre_in_middle) options.level_sigma.tail<2>().setConstant(kHeld);
  MapEvidence evidence = stills.evidence;
  for (MapPicture& picture : evidence.pictures) {
    if (variant.free_focal_lengths) picture.eps_sigma = 0.3;
    if (variant.no_telemetry) picture.telemetry.reset();
  }
  return adjust_map(evidence, options);
}

// Of one picture.
struct StillErrors {
  double log_f = 0;
  double shape_px =
      0;  // rms over the image of the directions of pixels in the camera's frame, turned to fit at the best
  double pixels_px =
      0;  // rms over the image of the directions of pixels in base, a common turn of all pictures taken off
  double rotation_px = 0;  // rms over the image of what the orientation moves pixels by, likewise
};

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

StillErrors still_errors(const TruePicture& truth, const AdjustedPicture& found,
                         const Eigen::Matrix3d& common) {
  StillErrors out;
  const double f = truth.lens.focal_length;
  out.log_f = std::log(found.camera.focal_length / f);
  const Eigen::Vector3d xi =
      rotation_vector(truth.R.transpose() * common.transpose() * found.R_base_from_camera);
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  std::vector<std::pair<Eigen::Vector3d, Eigen::Vector3d>> points;  // direction and its error
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 9; ++column) {
      const Eigen::Vector2d u(kWidth * (column + 0.5) / 9, kHeight * (row + 0.5) / 7);
      const Eigen::Vector2d slope = truth.lens.slope(u.x(), u.y());
      const Eigen::Vector3d d = Eigen::Vector3d(slope.x(), slope.y(), 1).normalized();
      Vector3<double> d_found;
      if (unproject(found.camera, u, &d_found) != ProjectionStatus::kOk) {
        out.shape_px = HUGE_VAL;
        out.pixels_px = HUGE_VAL;
        return out;
      }
      const Eigen::Vector3d off = d_found - d;
      const Eigen::Matrix3d J = -skew(Vector3<double>(d));  // of a small turn
      N += J.transpose() * J;
      b += J.transpose() * off;
      points.emplace_back(d, off);
      const Eigen::Vector3d in_base = common.transpose() * found.R_base_from_camera * d_found;
      out.pixels_px += (in_base - truth.R * d).squaredNorm();
      out.rotation_px += xi.cross(d).squaredNorm();
    }
  }
  const Eigen::Vector3d turn = N.ldlt().solve(b);
  for (const auto& [d, off] : points) out.shape_px += (off - turn.cross(d)).squaredNorm();
  const auto n = static_cast<double>(points.size());
  out.shape_px = f * std::sqrt(out.shape_px / n);
  out.pixels_px = f * std::sqrt(out.pixels_px / n);
  out.rotation_px = f * std::sqrt(out.rotation_px / n);
  return out;
}

// The turn that all pictures have in common, by what their middles show, each weighted by how finely it sees: an orientation by
// itself may lean against the optical centre.
Eigen::Matrix3d common_turn(const std::vector<TruePicture>& truth, const MapAdjustment& found) {
  Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const double weight = std::pow(truth[i].lens.focal_length, 2);
    for (const double share : {0.25, 0.75}) {
      const Eigen::Vector2d u(share * kWidth, (1 - share) * kHeight);
      const Eigen::Vector2d slope = truth[i].lens.slope(u.x(), u.y());
      const Eigen::Vector3d d =
          (truth[i].R * Eigen::Vector3d(slope.x(), slope.y(), 1)).normalized();
      Vector3<double> d_found;
      if (unproject(found.pictures[i].camera, u, &d_found) != ProjectionStatus::kOk) continue;
      const Eigen::Matrix3d J = -skew(Vector3<double>(d));
      N += weight * J.transpose() * J;
      b += weight * J.transpose() * (found.pictures[i].R_base_from_camera * d_found - d);
    }
  }
  return exp_so3(Vector3<double>(N.ldlt().solve(b)));
}

// Normalised square of all pictures' errors together; its mean over many runs is the number of unknowns, 4 a picture.
double joint_square(const std::vector<TruePicture>& truth, const MapAdjustment& found) {
  Eigen::VectorXd error(4 * static_cast<Eigen::Index>(truth.size()));
  for (std::size_t i = 0; i < truth.size(); ++i) {
    const AdjustedPicture& picture = found.pictures[i];
    error.segment<4>(4 * static_cast<Eigen::Index>(i))
        << rotation_vector(truth[i].R.transpose() * picture.R_base_from_camera),
        std::log(picture.camera.focal_length / truth[i].lens.focal_length);
  }
  const Eigen::VectorXd scale = found.covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd correlation = scale.asDiagonal() * found.covariance * scale.asDiagonal();
  const Eigen::VectorXd scaled = scale.cwiseProduct(error);
  return scaled.dot(correlation.ldlt().solve(scaled));
}

struct LevelErrors {
  std::vector<double> log_f, shape, pixels, rotation;
};

struct VariantResult {
  std::array<LevelErrors, kLevels> levels;
  std::vector<double> cpu_s, anees, noise, steps, hold, hold_sigma;
  int failed = 0;
};

double cpu_seconds() {
  return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

void add_run(const Stills& stills, const Variant& variant, VariantResult* out, std::ostream& log) {
  const double begin_s = cpu_seconds();
  const MapAdjustment found = adjust_variant(stills, variant);
  out->cpu_s.push_back(cpu_seconds() - begin_s);
  if (found.status != MapStatus::kOk) {
    ++out->failed;
    log << variant.name << ": " << to_string(found.status) << "\n";
    return;
  }
  const Eigen::Matrix3d common = common_turn(stills.pictures, found);
  for (std::size_t i = 0; i < stills.pictures.size(); ++i) {
    const TruePicture& truth = stills.pictures[i];
    const StillErrors errors = still_errors(truth, found.pictures[i], common);
    LevelErrors& level = out->levels.at(static_cast<std::size_t>(truth.level));
    level.log_f.push_back(std::abs(errors.log_f));
    level.shape.push_back(errors.shape_px);
    level.pixels.push_back(errors.pixels_px);
    level.rotation.push_back(errors.rotation_px);
  }
  if (!variant.no_telemetry && !variant.homographies) {
    out->anees.push_back(joint_square(stills.pictures, found) /
                         (4 * static_cast<double>(stills.pictures.size())));
  }
  out->noise.push_back(found.noise_scale);
  out->steps.push_back(found.steps);
  out->hold.push_back(found.lens.hold());
  out->hold_sigma.push_back(found.hold_sigma);
}

std::string both(const std::vector<double>& values) {
  return values.empty() ? "-" : number(median(values), 2) + " / " + number(largest(values), 2);
}

void print_variant(const Variant& variant, const VariantResult& result, int pictures,
                   std::ostream& out) {
  Table table;
  table.title = variant.name + " (median / largest)";
  table.header = {"f, px", "f, relative", "shape, px", "pixels in base, px", "rotation, px"};
  for (int level = 0; level < kLevels; ++level) {
    const LevelErrors& at = result.levels.at(static_cast<std::size_t>(level));
    const double f =
        kWide_px * std::pow(kTele_px / kWide_px, level / static_cast<double>(kLevels - 1));
    table.rows.push_back(
        {number(f, 3), both(at.log_f), both(at.shape), both(at.pixels), both(at.rotation)});
  }
  table.notes.push_back("CPU " + both(result.cpu_s) + " s, steps " + both(result.steps) +
                        ", noise found " + both(result.noise) + " of that claimed");
  if (!result.hold.empty()) {
    table.notes.push_back("hold " + number(mean(result.hold), 3) + " in the mean, its sigma " +
                          number(median(result.hold_sigma), 2));
  }
  if (!result.anees.empty()) {
    const int count = 4 * pictures * static_cast<int>(result.anees.size());
    const Interval interval = mean_square_interval(count, 0.95);
    table.notes.push_back("ANEES of all pictures together " + number(mean(result.anees), 3) +
                          " (95 %: " + number(interval.low, 3) + " to " + number(interval.high, 3) +
                          ")");
  }
  if (result.failed > 0) table.notes.push_back(std::to_string(result.failed) + " runs failed");
  table.print(out);
  out << "\n";
}

std::vector<std::string> marks_missed(const VariantResult& result, int pictures) {
  std::vector<std::string> missed;
  const auto expect = [&](const std::string& what, double value, double most) {
    if (!(value <= most)) missed.push_back(what + " " + number(value, 3) + " > " + number(most, 3));
  };
  if (result.failed > 0) missed.push_back(std::to_string(result.failed) + " runs failed");
  for (int i = 0; i < kLevels; ++i) {
    const LevelErrors& at = result.levels.at(static_cast<std::size_t>(i));
    const std::string level = "level " + std::to_string(i + 1) + ": ";
    if (at.log_f.empty()) continue;
    expect(level + "largest relative error of f", largest(at.log_f), 1e-4);
    expect(level + "median relative error of f", median(at.log_f), 2e-5);
    expect(level + "largest error of pixels' directions, px", largest(at.pixels), 0.1);
    expect(level + "largest error of rotation, px", largest(at.rotation),
           i == kLevels - 1 ? 0.3 : 0.15);
  }
  expect("CPU, s", largest(result.cpu_s), 10);
  const int count = 4 * pictures * static_cast<int>(result.anees.size());
  if (count > 0 && !mean_square_interval(count, 0.95).contains(mean(result.anees))) {
    missed.push_back("ANEES " + number(mean(result.anees), 3) + " outside its interval");
  }
  return missed;
}

}  // namespace

std::vector<std::string> run_map_stills(const MapStillsOptions& options, std::ostream& out) {
  std::vector<Variant> variants = {
      {"one lens as curves over the zoom"},
      {"one lens as curves, without telemetry", false, false, false, true},
      {"free focal lengths", true},
      {"free focal lengths, optical centre in the middle", true, true},
      {"free focal lengths, optical centre in the middle, no distortion", true, true, true},
      {"homographies from picture to picture, no adjustment", false, false, false, false, true}};
  if (options.alone) variants.resize(1);
  std::vector<VariantResult> results(variants.size());
  int pictures = 0;
  for (int run = 0; run < options.runs; ++run) {
    const Stills stills =
        StillsMaker(options, options.first_seed + static_cast<std::uint64_t>(run)).make();
    pictures = static_cast<int>(stills.pictures.size());
    out << "seed " << options.first_seed + static_cast<std::uint64_t>(run) << ": " << pictures
        << " pictures, " << stills.evidence.landmarks << " directions, "
        << stills.evidence.observations.size() << " observations" << std::endl;
    for (std::size_t i = 0; i < variants.size(); ++i) {
      add_run(stills, variants[i], &results[i], out);
    }
  }
  out << "\n";
  for (std::size_t i = 0; i < variants.size(); ++i) {
    print_variant(variants[i], results[i], pictures, out);
  }
  return marks_missed(results.front(), pictures);
}

}  // namespace alidade::test
