#include "core/calibration/departures.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <utility>

#include "core/calibration/chance.h"
#include "core/calibration/departure_score.h"
#include "core/calibration/depth_spread.h"

namespace alidade::internal {

namespace {

// Of all causes together, where nothing departs from the model.
constexpr double kFalseCause = 0.01;
constexpr std::size_t kMostCauses = 4;
constexpr const char* kFifthOrderName = "distortion of fifth order";
// A lens's distortion of fifth order in the corner: one standard deviation, as a part of the radius
// there, and of the distortion of third order there.
constexpr double kUsualFifthOrder = 0.003;
constexpr double kFifthOfThird = 0.2;
// What the other unknowns leave of a combination of columns; less is theirs.
constexpr double kLeastLeft = 1e-6;

constexpr int kGearKnots = 12;
constexpr int kDriftKnots = 8;
constexpr int kHeights = 5;  // nodes over the scene, from its lowest to its highest landmark
constexpr int kShapes = kHeights + 1;  // and a slope from left to right

// Columns of telemetry rows come first, so that each row has neighbouring ones.
constexpr int kGearPan = 0;
constexpr int kGearTilt = kGearPan + kGearKnots;
constexpr int kPlayPan = kGearTilt + kGearKnots;
constexpr int kPlayTilt = kPlayPan + 1;
constexpr int kLateAxis = kPlayTilt + 1;
constexpr int kTelemetryColumns = kLateAxis + 1;
constexpr int kFocusDrift = kTelemetryColumns;
constexpr int kFifthOrder = kFocusDrift + kDriftKnots;
constexpr int kCentre = kFifthOrder + 1;
constexpr int kLag = kCentre + 2;
constexpr int kParallax = kLag + 1;
constexpr int kDriftingScene = kParallax + 3 * kShapes;
constexpr int kColumns = kDriftingScene + 2 * kShapes;

// A departure: columns first to first + count - 1 of the score.
struct Suspect {
  const char* cause;
  const char* unit;
  int first;
  int count;
  double in_unit;  // of a column's coefficient
};

// Linear interpolation between equally spaced nodes.
struct Hats {
  double begin;
  double spacing;
  int count;

  Hats(double first, double last, int nodes)
      : begin(first), spacing(std::max(last - first, 1e-12) / (nodes - 1)), count(nodes) {}

  template <class Use>
  void at(double x, Use use) const {
    const double place = std::clamp((x - begin) / spacing, 0.0, count - 1.0);
    const int node = std::min(static_cast<int>(place), count - 2);
    use(node, node + 1 - place);
    use(node + 1, place - node);
  }
};

struct Range {
  double least = 1e300;
  double most = -1e300;

  void add(double x) {
    least = std::min(least, x);
    most = std::max(most, x);
  }
  [[nodiscard]] double middle() const { return 0.5 * (least + most); }
  [[nodiscard]] double half() const { return std::max(0.5 * (most - least), 1e-12); }
};

// Of each telemetry sample, which way each axis last moved by more than what its readings and
// their noise can feign: -1, 0 (not yet), 1.
class Direction {
 public:
  explicit Direction(double least) : least_(least) {}
  double at(double angle) {
    if (!begun_ || direction_ * (angle - extreme_) > 0) extreme_ = angle;
    begun_ = true;
    const double back = angle - extreme_;
    if (direction_ == 0 ? std::abs(back) > least_ : -direction_ * back > least_) {
      direction_ = back > 0 ? 1 : -1;
      extreme_ = angle;
    }
    return direction_;
  }

 private:
  double least_;
  bool begun_ = false;
  double extreme_ = 0;
  double direction_ = 0;
};

class Columns {
 public:
  Columns(const Adjustment& adjustment, const AdjustmentState& state, const Linearisation& at)
      : trajectory_(state.trajectory), camera_(state.physical_camera()) {
    const auto see = [this](double t) {
      const PanTilt<double> angle = trajectory_.position(t);
      angle_[0].add(angle.pan);
      angle_[1].add(angle.tilt);
      time_.add(t);
    };
    adjustment.visit(
        state, at,
        [&](const ObservationRow& row) {
          see(row.time_s);
          const Vector2<double> place = place_of(row);
          scene_[0].add(place[0]);
          scene_[1].add(place[1]);
        },
        [&](const TelemetryRow& row) { see(row.time_s); });
    corner_ = std::hypot(0.5 * camera_.width, 0.5 * camera_.height);
  }

  // By sample, in sequence.
  DepartureColumns of(const TelemetryRow& row) {
    DepartureColumns X = DepartureColumns::Zero(2, kTelemetryColumns);
    const Vector2<double> angle = trajectory_.position(row.basis).vector();
    const Vector2<double> rate = trajectory_.rate(row.basis).vector();
    for (int axis = 0; axis < 2; ++axis) {
      const Range& range = angle_[static_cast<std::size_t>(axis)];
      const Hats hats(range.least, range.most, kGearKnots);
      const double unit = 1 / row.sigma[axis];
      hats.at(angle[axis], [&](int node, double weight) {
        X(axis, (axis == 0 ? kGearPan : kGearTilt) + node) += unit * weight;
      });
      X(axis, axis == 0 ? kPlayPan : kPlayTilt) =
          0.5 * unit * direction_[static_cast<std::size_t>(axis)].at(angle[axis]);
    }
    X(0, kLateAxis) = -rate[0] / row.sigma[0];
    return X;
  }

  [[nodiscard]] DepartureColumns of(const ObservationRow& row) const {
    DepartureColumns X = DepartureColumns::Zero(2, kColumns - kTelemetryColumns);
    const auto column = [&X](int index) { return X.col(index - kTelemetryColumns); };
    const Vector2<double> x(row.d_c.x() / row.d_c.z(), row.d_c.y() / row.d_c.z());
    Hats(time_.least, time_.most, kDriftKnots).at(row.time_s, [&](int node, double weight) {
      column(kFocusDrift + node) += weight * row.J_camera.col(camera_column::kFocalLength);
    });
    const Vector2<double> from_centre = camera_.focal_length * x;
    const double radius = from_centre.norm() / corner_;
    column(kFifthOrder) = row.whiten * (from_centre / corner_ * std::pow(radius, 4));
    X.middleCols<2>(kCentre - kTelemetryColumns) = row.whiten;
    column(kLag) = -row.whiten * row.u_rate * row.u_rate.norm();

    const Vector2<double> place = place_of(row);
    Eigen::Matrix<double, kShapes, 1> shape = Eigen::Matrix<double, kShapes, 1>::Zero();
    Hats(scene_[1].least, scene_[1].most, kHeights).at(place[1], [&](int node, double weight) {
      shape[node] += weight;
    });
    shape[kHeights] = (place[0] - scene_[0].middle()) / scene_[0].half();
    const Matrix<double, 2, 3> J = row.whiten * row.J_u_dc;
    const double since = row.time_s - time_.middle();
    for (int s = 0; s < kShapes; ++s) {
      X.middleCols<3>(kParallax - kTelemetryColumns + 3 * s) = -shape[s] * J;
      X.middleCols<2>(kDriftingScene - kTelemetryColumns + 2 * s) =
          shape[s] * since * J.leftCols<2>();
    }
    return X;
  }

 private:
  const TrajectorySpline& trajectory_;
  Camera<double> camera_;
  double corner_ = 1;
  // About the directions of landmarks: pan and tilt, and where in the picture.
  [[nodiscard]] Vector2<double> place_of(const ObservationRow& row) const {
    return trajectory_.position(row.basis).vector() +
           Vector2<double>(row.d_c.x(), -row.d_c.y()) / row.d_c.z();
  }

  std::array<Range, 2> angle_;
  std::array<Range, 2> scene_;
  Range time_;
  // Steps of 1e-5 rad and less are no reversal.
  std::array<Direction, 2> direction_ = {Direction(1e-5), Direction(1e-5)};
};

// What a score says of some columns of one unit. The chi-square and its degrees of freedom count
// what the other unknowns leave. The best theta has a prior: 0 with the likeliest size. So what is
// hardly left stays small.
struct Fit {
  double chi_square = 0;
  double freedom = 0;
  Eigen::VectorXd theta;
};

using Eigen3 = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>;

double least_left(const Eigen::VectorXd& full) { return kLeastLeft * full.maxCoeff(); }

Fit fit(const Eigen::MatrixXd& information, const Eigen::VectorXd& full,
        const Eigen::VectorXd& score) {
  const Eigen3 eigen(information);
  const Eigen::VectorXd left = eigen.eigenvalues().cwiseMax(0.0);
  const Eigen::VectorXd s = eigen.eigenvectors().transpose() * score;
  const double least = least_left(full);
  Fit out;
  double largest = 0;
  for (Eigen::Index i = 0; i < s.size(); ++i) {
    if (left[i] < least) continue;
    out.chi_square += s[i] * s[i] / left[i];
    out.freedom += 1;
    largest = std::max(largest, s[i] * s[i] / (left[i] * left[i]));
  }
  // Logarithm of the likelihood of a size, over steps of a fifth from far too small.
  double best = -1e300;
  double variance = 0;
  for (double v = 1e-6 * largest; v > 0 && v <= largest; v *= 1.44) {
    double likelihood = 0;
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      if (left[i] < least) continue;
      likelihood += 0.5 * (s[i] * s[i] * v / (1 + v * left[i]) - std::log1p(v * left[i]));
    }
    if (likelihood <= best) continue;
    best = likelihood;
    variance = v;
  }
  if (!(variance > 0)) return out;
  const Eigen::VectorXd after = (left.array() + 1 / variance).inverse();
  out.theta = eigen.eigenvectors() * after.cwiseProduct(s);
  return out;
}

double half_range(const Eigen::VectorXd& x) { return 0.5 * (x.maxCoeff() - x.minCoeff()); }

std::vector<Suspect> suspects(const AdjustmentState& state,
                              const std::array<bool, kGlobalCount>& fixed) {
  const double f = state.camera.focal_length;
  std::vector<Suspect> all = {{"gear of pan", "mrad", kGearPan, kGearKnots, 1e3},
                              {"gear of tilt", "mrad", kGearTilt, kGearKnots, 1e3},
                              {"play", "mrad", kPlayPan, 2, 1e3},
                              {"one axis late", "ms", kLateAxis, 1, 1e3},
                              {"focal length drifts", "per mille", kFocusDrift, kDriftKnots, 1e3},
                              {kFifthOrderName, "px in the corner", kFifthOrder, 1, 1},
                              {"pictures late at speed", "ms per 1000 px/s", kLag, 1, 1e6},
                              {"parallax", "mrad", kParallax, 3 * kShapes, 1e3},
                              {"scene moves", "px/s", kDriftingScene, 2 * kShapes, f}};
  if (fixed[static_cast<std::size_t>(index(Parameter::kCentreU))]) {
    all.push_back({"optical centre", "px", kCentre, 2, 1});
  }
  return all;
}

// What the data leave open of the distortion of fifth order, px in the corner: its posterior.
// information, score: of it, all else eliminated, the other causes too. growth: by how much the
// data say less of the lens than white errors would allow.
struct FifthOrder {
  double mean = 0;
  double variance = 0;
};

FifthOrder fifth_order(const AdjustmentState& state, double information, double score,
                       double growth) {
  const double corner = std::hypot(0.5 * state.camera.width, 0.5 * state.camera.height);
  const double prior =
      corner * std::hypot(kUsualFifthOrder, kFifthOfThird * state.corner_distortion[0]);
  FifthOrder out;
  out.variance = 1 / (std::max(0.0, information) / growth + 1 / (prior * prior));
  out.mean = out.variance * score / growth;
  return out;
}

CalibrationCause cause_of(const DepthSpread& spread) {
  return {"different distances", spread.excess, spread.landmarks, 1e3 * spread.sigma,
          "per mille of the focal length"};
}

}  // namespace

Departures find_departures(const Adjustment& adjustment, const AdjustmentState& state,
                           const Linearisation& at, const ReducedFactor& factor,
                           double lens_growth) {
  std::vector<DepartureScore> scores(1, DepartureScore(kColumns, at));
  DepartureScore& score = scores.front();
  Columns columns(adjustment, state, at);
  adjustment.visit(
      state, at,
      [&](const ObservationRow& row) { score.add(row, kTelemetryColumns, columns.of(row)); },
      [&](const TelemetryRow& row) { score.add(row, 0, columns.of(row)); });
  DepartureScore::finish(factor, adjustment, &scores);

  std::vector<Suspect> left = suspects(state, adjustment.fixed());
  const double limit = std::log(kFalseCause / static_cast<double>(left.size() + 1));
  Departures found;
  const auto add_to_focal_length = [&](double variance) {
    const int f = index(Parameter::kFocalLength);
    if (!adjustment.fixed()[static_cast<std::size_t>(f)]) found.error(f, f) += variance;
  };
  double likeliest = limit;
  const Eigen::VectorXd full = score.full_information().diagonal();
  Eigen::MatrixXd N = score.information();
  Eigen::VectorXd s = score.score();
  bool fifth_order_shows = false;
  double of_fifth_order = N(kFifthOrder, kFifthOrder);
  while (found.causes.size() < kMostCauses) {
    double least = limit;
    std::size_t best = left.size();
    Fit best_fit;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Suspect& c = left[i];
      Fit now = fit(N.block(c.first, c.first, c.count, c.count), full.segment(c.first, c.count),
                    s.segment(c.first, c.count));
      if (now.theta.size() == 0) continue;
      const double chance = log_chance(now.chi_square, now.freedom);
      if (chance >= least) continue;
      least = chance;
      best = i;
      best_fit = std::move(now);
    }
    if (best == left.size()) break;
    if (found.causes.empty()) likeliest = least;
    const Suspect c = left[best];
    fifth_order_shows = fifth_order_shows || c.first == kFifthOrder;
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(best));
    const double size = c.in_unit * best_fit.theta.norm() / std::sqrt(c.count);
    found.causes.push_back({c.cause, best_fit.chi_square, best_fit.freedom, size, c.unit});

    const DepartureEffect effect = score.effect().middleCols(c.first, c.count);
    const GlobalVector error = effect * best_fit.theta;
    found.error += error * error.transpose();
    // The published focal length is one for all times, also for those after the recording.
    if (c.first == kFocusDrift) add_to_focal_length(std::pow(half_range(best_fit.theta), 2));
    // What is left beside it.
    const Eigen::MatrixXd rows = N.middleRows(c.first, c.count);
    const Eigen::VectorXd s_of_it = s.segment(c.first, c.count);
    const Eigen3 eigen(rows.middleCols(c.first, c.count));
    for (Eigen::Index i = 0; i < c.count; ++i) {
      const double of_it = eigen.eigenvalues()[i];
      if (of_it < least_left(full.segment(c.first, c.count))) continue;
      const Eigen::VectorXd along = eigen.eigenvectors().col(i);
      const Eigen::VectorXd tied = rows.transpose() * along / of_it;
      s -= tied * along.dot(s_of_it);
      N -= tied * (along.transpose() * rows);
    }
    if (!fifth_order_shows) of_fifth_order = N(kFifthOrder, kFifthOrder);
  }
  if (!state.nearness.empty()) {
    found.depth = nearness_spread(state, at);
    found.depth_is_shown = true;
    found.depth_is_likeliest = true;
    found.causes.insert(found.causes.begin(), cause_of(found.depth));
  } else {
    found.depth = depth_spread(adjustment, state, at, factor);
    found.depth_is_likeliest = found.depth.log_chance < likeliest;
    found.depth_is_shown = found.depth.log_chance < limit;
    if (found.depth_is_shown) {
      found.causes.insert(found.depth_is_likeliest ? found.causes.begin() : found.causes.end(),
                          cause_of(found.depth));
    }
  }
  if (found.causes.empty()) return found;
  // Residuals that have other causes no longer say that there is none of this.
  const double shown = fifth_order_shows ? 0 : s[kFifthOrder];
  const FifthOrder open = fifth_order(state, of_fifth_order, shown, lens_growth);
  const double square = open.variance + open.mean * open.mean;
  const GlobalVector effect = score.effect().col(kFifthOrder);
  found.hidden = square * effect * effect.transpose();
  if (!fifth_order_shows) {
    found.causes.push_back(
        {std::string("possible ") + kFifthOrderName,
         shown * shown / std::max(of_fifth_order, kLeastLeft * full[kFifthOrder]), 1,
         std::sqrt(square), "px in the corner"});
  }
  return found;
}

}  // namespace alidade::internal
