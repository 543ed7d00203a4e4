#include "edge_app/verify/pair_equations.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/calibration/centre_frame.h"
#include "core/calibration/chance.h"
#include "core/model/median.h"
#include "edge_app/verify/covariance_root.h"

namespace alidade {
namespace {

constexpr double kHuber = 3;        // sigmas of noise; a residual beyond counts less
constexpr double kFullRank = 1e-6;  // of a diagonal, by which it grows
constexpr double kNotSeen = 1e-9;   // share of a column that nothing else explains
// Amplitudes at which the likelihood of a noise is looked at first, as powers of the factor.
constexpr double kNoiseFactor = 3;
constexpr double kLeastJitter_s = 3e-4;
constexpr double kLeastNoise_rad = 1e-5;
constexpr int kNoiseSteps = 7;
constexpr double kWorthRefining = 4;  // twice the gain of log likelihood

}  // namespace

PairEquations::PairEquations(const std::vector<SeenFrame>& frames,
                             const std::vector<PairRows>& pairs, const Calibration& calibration,
                             const TelemetryError& telemetry_error, double motion_inflation)
    : frames_(frames), pairs_(pairs), departures_(all_departures(frames)) {
  for (const SeenFrame& frame : frames) {
    claimed_.emplace_back(motion_inflation *
                          frame.by_all_samples.motion_covariance.topLeftCorner<4, 4>());
  }
  ParameterCovariance<double> parameters = covariance_with_centre(calibration);
  parameters(index(Parameter::kClockOffset), index(Parameter::kClockOffset)) +=
      shared_time_variance();
  parameter_root_ = covariance_root(parameters);
  for (const DepartureColumns& departure : departures_) {
    first_column_.push_back(columns_);
    columns_ += departure.count();
    add_known(departure, telemetry_error);
  }
  noise_size_.assign(departures_.size(), 0);
  set_roots();
}

void PairEquations::sum_with_noise() {
  add_up_pairs();
  take_noise();
  measure_noise();
  add_up_pairs();
}

std::vector<Vector4<double>> PairEquations::frame_errors() {
  sum_with_noise();
  take_noise();
  std::vector<Vector4<double>> out;
  for (std::size_t i = 0; i < frames_.size(); ++i) out.emplace_back(error_of_frame(i));
  return out;
}

void PairEquations::sum() {
  sum_with_noise();
  pair_scatter_ = pair_scatter();
}

DepartureTest PairEquations::test(std::size_t d) {
  DepartureTest out = is_noise(d) ? test_noise(d) : test(std::vector<std::size_t>{d});
  out.departure = departures_[d].departure;
  out.at = departures_[d].at;
  out.claimed_sigma = claimed_sigma(d);
  return out;
}

DepartureTest PairEquations::test(const std::vector<std::size_t>& departures) const {
  DepartureTest out;
  const std::vector<int> at = columns_at(departures);
  const auto n = static_cast<int>(at.size());
  if (n == 0) return out;
  Eigen::MatrixXd left(n, solution_.size());
  Eigen::MatrixXd own(n, n);
  Eigen::VectorXd right(n);
  for (int i = 0; i < n; ++i) {
    const int row = at[static_cast<std::size_t>(i)];
    left.row(i) << sums_.block(row, 0, 1, unknowns()), columns_of(free_, row, 1);
    right[i] = sums_(row, last());
  }
  for (int i = 0; i < n; ++i) own.row(i) = columns_of(at, at[static_cast<std::size_t>(i)], 1);
  const Eigen::VectorXd s = right - left * solution_;
  const Eigen::MatrixXd explained = information_.solve(left.transpose());
  const Eigen::MatrixXd V = own - left * explained;
  judge(own.diagonal(), s, V, scatter_of(at, explained, V), &out);
  return out;
}

void PairEquations::set_free(const std::vector<std::size_t>& departures) {
  free_ = columns_at(departures);
  std::fill(noise_size_.begin(), noise_size_.end(), 0);
  for (const std::size_t d : departures) {
    if (is_noise(d)) noise_size_[d] = likeliest(d).size;
  }
  take_noise();
}

double PairEquations::claimed_sigma(std::size_t d) const {
  if (departures_[d].parameters.empty()) return 0;
  return parameter_root_.row(departures_[d].parameters.front()).norm();
}

std::vector<int> PairEquations::columns_at(const std::vector<std::size_t>& departures) const {
  std::vector<int> out;
  for (const std::size_t d : departures) {
    for (int i = 0; i < departures_[d].count(); ++i)
      out.push_back(unknowns() + first_column_[d] + i);
  }
  return out;
}

double PairEquations::shared_time_variance() const {
  std::vector<double> sigmas;
  for (const SeenFrame& frame : frames_) sigmas.push_back(frame.time_sigma_s);
  if (sigmas.empty()) return 0;
  const double middle = median(std::move(sigmas));
  return middle * middle;
}

void PairEquations::add_known(const DepartureColumns& departure, const TelemetryError& error) {
  const auto add = [&](double sigma, const FrameColumn& column) {
    if (!(sigma > 0)) return;
    known_.push_back(column);
    for (double& each : known_.back().of_frame) each *= sigma;
  };
  for (std::size_t k = 0; k < departure.columns.size(); ++k) {
    const FrameColumn& column = departure.columns[k];
    if (departure.departure == Departure::kPanGear) add(error.pan.sigma(departure.at[k]), column);
    if (departure.departure == Departure::kTiltGear) add(error.tilt.sigma(departure.at[k]), column);
    if (departure.departure == Departure::kPanPlay) add(error.pan_play.sigma_rad, column);
    if (departure.departure == Departure::kTiltPlay) add(error.tilt_play.sigma_rad, column);
  }
}

Vector2<double> PairEquations::by(const FrameColumn& column, const PairRows& pair,
                                  const PlaceRow& place) {
  const double first = column.of_frame[pair.first];
  const double second = column.of_frame[pair.second];
  switch (column.what) {
    case FrameColumn::What::kPan:
      return place.J_first.col(0) * first + place.J_second.col(0) * second;
    case FrameColumn::What::kTilt:
      return place.J_first.col(1) * first + place.J_second.col(1) * second;
    case FrameColumn::What::kFocalLength:
      break;
  }
  const int f = index(Parameter::kFocalLength);
  return place.P_first.col(f) * first + place.P_second.col(f) * second;
}

Eigen::Matrix<double, 2, Eigen::Dynamic> PairEquations::row(const PairRows& pair,
                                                            const PlaceRow& place) const {
  Eigen::Matrix<double, 2, Eigen::Dynamic> out(2, 2 * kFrameErrors + shared() + columns_ + 1);
  out.leftCols<kFrameErrors>() = place.J_first;
  out.middleCols<kFrameErrors>(kFrameErrors) = place.J_second;
  const Sensitivity<2> P = place.P_first + place.P_second;
  int at = 2 * kFrameErrors;
  out.middleCols<kParameterCount>(at) = P * parameter_root_;
  at += kParameterCount;
  for (const FrameColumn& column : known_) out.col(at++) = by(column, pair, place);
  for (const DepartureColumns& departure : departures_) {
    for (const int parameter : departure.parameters) out.col(at++) = P.col(parameter);
    for (const FrameColumn& column : departure.columns) out.col(at++) = by(column, pair, place);
  }
  out.col(at) = place.residual;
  return out;
}

std::vector<int> PairEquations::places_of(const PairRows& pair) const {
  std::vector<int> out;
  for (const std::size_t frame : {pair.first, pair.second}) {
    for (int i = 0; i < kFrameErrors; ++i)
      out.push_back(kFrameErrors * static_cast<int>(frame) + i);
  }
  for (int i = kFrameErrors * static_cast<int>(frames_.size()); i <= last(); ++i) out.push_back(i);
  return out;
}

void PairEquations::add_up_pairs() {
  of_pair_.clear();
  std::size_t n = 0;
  for (const PairRows& pair : pairs_) {
    const int size = 2 * kFrameErrors + shared() + columns_ + 1;
    Eigen::MatrixXd own = Eigen::MatrixXd::Zero(size, size);
    for (const PlaceRow& place : pair.places) {
      const double weight = weights_.empty() ? 1 : weights_[n++];
      const Eigen::Matrix<double, 2, Eigen::Dynamic> rows = row(pair, place);
      own.noalias() += rows.transpose() * (weight * place.covariance.inverse()) * rows;
    }
    of_pair_.push_back(std::move(own));
  }
}

void PairEquations::set_roots() {
  frame_roots_.clear();
  for (std::size_t i = 0; i < frames_.size(); ++i) {
    Matrix4<double> covariance = claimed_[i];
    for (std::size_t d = 0; d < departures_.size(); ++d) {
      if (noise_size_[d] == 0) continue;
      const FrameNoise B = noise_size_[d] * departures_[d].noise[i];
      covariance += B * B.transpose();
    }
    frame_roots_.emplace_back(covariance_root(covariance));
  }
}

void PairEquations::unwhiten(const PairRows& pair, Eigen::MatrixXd* rows) const {
  rows->topRows<kFrameErrors>() = (frame_roots_[pair.first] * rows->topRows<kFrameErrors>()).eval();
  rows->middleRows<kFrameErrors>(kFrameErrors) =
      (frame_roots_[pair.second] * rows->middleRows<kFrameErrors>(kFrameErrors)).eval();
}

void PairEquations::add_up(double picture_variance) {
  sums_ = Eigen::MatrixXd::Zero(last() + 1, last() + 1);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const PairRows& pair = pairs_[p];
    Eigen::MatrixXd own = of_pair_[p] / picture_variance;
    const auto whiten = [&own](int from, const Matrix4<double>& root) {
      own.middleRows<kFrameErrors>(from) =
          (root.transpose() * own.middleRows<kFrameErrors>(from)).eval();
      own.middleCols<kFrameErrors>(from) = (own.middleCols<kFrameErrors>(from) * root).eval();
    };
    whiten(0, frame_roots_[pair.first]);
    whiten(kFrameErrors, frame_roots_[pair.second]);
    const std::vector<int> at = places_of(pair);
    const auto size = static_cast<int>(own.rows());
    for (int i = 0; i < size; ++i) {
      for (int j = 0; j < size; ++j)
        sums_(at[static_cast<std::size_t>(i)], at[static_cast<std::size_t>(j)]) += own(i, j);
    }
  }
}

Eigen::MatrixXd PairEquations::columns_of(const std::vector<int>& columns, int row,
                                          int rows) const {
  Eigen::MatrixXd out(rows, static_cast<int>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    out.col(static_cast<int>(k)) = sums_.block(row, columns[k], rows, 1);
  return out;
}

void PairEquations::fill(Eigen::MatrixXd* N, Eigen::VectorXd* g) const {
  const int n = unknowns();
  const int more = static_cast<int>(free_.size());
  *N = Eigen::MatrixXd::Zero(n + more, n + more);
  N->topLeftCorner(n, n) = sums_.topLeftCorner(n, n);
  N->topLeftCorner(n, n).diagonal().array() += 1;  // the claimed covariances
  *g = Eigen::VectorXd(n + more);
  g->head(n) = sums_.block(0, last(), n, 1);
  for (int a = 0; a < more; ++a) {
    const int column = free_[static_cast<std::size_t>(a)];
    N->block(0, n + a, n, 1) = sums_.block(0, column, n, 1);
    N->block(n + a, 0, 1, n) = N->block(0, n + a, n, 1).transpose();
    for (int b = 0; b < more; ++b)
      (*N)(n + a, n + b) = sums_(column, free_[static_cast<std::size_t>(b)]);
    // What the recording does not show of it stays where it is.
    (*N)(n + a, n + a) *= 1 + kNotSeen;
    (*g)[n + a] = sums_(column, last());
  }
}

void PairEquations::solve() {
  Eigen::MatrixXd N;
  Eigen::VectorXd g;
  fill(&N, &g);
  information_.compute(N);
  solution_ = information_.solve(g);
}

void PairEquations::take_noise() {
  set_roots();
  add_up();
  solve();
}

double PairEquations::log_likelihood(std::size_t d, double size) {
  noise_size_[d] = size;
  set_roots();
  add_up(pair_scatter_);
  Eigen::MatrixXd N;
  Eigen::VectorXd g;
  fill(&N, &g);
  // Several times as fast as LDLT, but not for what has no full rank, as a curve that is free.
  const auto more = static_cast<int>(free_.size());
  N.bottomRightCorner(more, more).diagonal() *= 1 + kFullRank;
  const Eigen::LLT<Eigen::MatrixXd> factor(N);
  if (factor.info() != Eigen::Success) return -std::numeric_limits<double>::infinity();
  return 0.5 * g.dot(factor.solve(g)) - factor.matrixLLT().diagonal().array().log().sum();
}

PairEquations::Likeliest PairEquations::likeliest(std::size_t d) {
  const double least =
      departures_[d].departure == Departure::kTimeJitter ? kLeastJitter_s : kLeastNoise_rad;
  const double without = log_likelihood(d, 0);
  if (!std::isfinite(without)) return {};
  const auto gain_at = [&](double size) { return 2 * (log_likelihood(d, size) - without); };
  std::vector<double> gains;
  for (int i = 0; i < kNoiseSteps; ++i) {
    gains.push_back(gain_at(least * std::pow(kNoiseFactor, i)));
    if (gains.back() < -kWorthRefining) break;
  }
  const auto best = std::max_element(gains.begin(), gains.end());
  const auto at = static_cast<double>(best - gains.begin());
  Likeliest out;
  if (!(*best > 0)) {
    // Where the likelihood has fallen by 1/2.
    std::size_t i = 0;
    while (i + 1 < gains.size() && gains[i] > -1) ++i;
    out.sigma = least * std::pow(kNoiseFactor, static_cast<double>(i));
    return out;
  }
  double step = std::log(kNoiseFactor);
  double centre = std::log(least) + at * step;
  out = {std::exp(centre), std::exp(centre), *best};
  if (*best < kWorthRefining) return out;
  for (int round = 0; round < 3; ++round) {
    const double below = gain_at(std::exp(centre - step));
    const double above = gain_at(std::exp(centre + step));
    const double curvature = below - 2 * out.gain + above;
    if (!(curvature < 0)) break;
    centre += std::clamp(0.5 * (below - above) / curvature, -1.0, 1.0) * step;
    out.size = std::exp(centre);
    // Of log size; twice the log likelihood falls by its square.
    out.sigma = out.size * step * std::sqrt(-2 / curvature);
    out.gain = gain_at(out.size);
    step /= 3;
  }
  return out;
}

double PairEquations::pair_scatter() {
  constexpr double kAtWill_rad = 0.03;
  constexpr double kLeastFreedom = 8;
  double& noise_rad = noise_size_[static_cast<std::size_t>(Departure::kAngleNoise)];
  noise_rad = kAtWill_rad;
  take_noise();
  const double shared_square = square_of_shared();
  noise_rad = 0;
  take_noise();
  std::vector<bool> is_seen(frames_.size(), false);
  for (const PairRows& pair : pairs_) is_seen[pair.first] = is_seen[pair.second] = true;
  const auto seen = static_cast<double>(std::count(is_seen.begin(), is_seen.end(), true));
  const double freedom = 2 * (static_cast<double>(pairs_.size()) - seen + 1);
  if (freedom < kLeastFreedom) return std::numeric_limits<double>::infinity();
  return std::max(1.0, shared_square / freedom);
}

DepartureTest PairEquations::test_noise(std::size_t d) {
  DepartureTest out;
  if (!std::isfinite(pair_scatter_)) return out;
  const double before = noise_size_[d];
  const Likeliest found = likeliest(d);
  noise_size_[d] = before;
  take_noise();
  out.freedom = 1;
  out.chi_square = found.gain;
  constexpr double kHalf = -0.6931471805599453;  // log: in the other half the likeliest is 0
  if (found.gain > 0) out.log_chance = internal::log_chance(found.gain, 1) + kHalf;
  out.size = {found.size};
  out.sigma = {found.sigma};
  return out;
}

Vector4<double> PairEquations::error_of_frame(std::size_t frame) const {
  return frame_roots_[frame] *
         solution_.segment<kFrameErrors>(kFrameErrors * static_cast<int>(frame));
}

std::vector<Vector2<double>> PairEquations::left_of(const PairRows& pair) const {
  Eigen::VectorXd x(2 * kFrameErrors + shared());
  x << error_of_frame(pair.first), error_of_frame(pair.second),
      solution_.segment(kFrameErrors * static_cast<int>(frames_.size()), shared());
  std::vector<Vector2<double>> out;
  for (const PlaceRow& place : pair.places)
    out.emplace_back(place.residual - row(pair, place).leftCols(x.size()) * x);
  return out;
}

double PairEquations::square_of_shared() const {
  double square = 0;
  std::size_t n = 0;
  for (const PairRows& pair : pairs_) {
    const std::vector<Vector2<double>> left = left_of(pair);
    Matrix2<double> information = Matrix2<double>::Zero();
    Vector2<double> sum = Vector2<double>::Zero();
    for (std::size_t i = 0; i < left.size(); ++i) {
      const Matrix2<double> weight = weights_[n++] * pair.places[i].covariance.inverse();
      information += weight;
      sum += weight * left[i];
    }
    square += sum.dot(information.inverse() * sum);
  }
  return square;
}

void PairEquations::measure_noise() {
  std::vector<double> squares;
  for (const PairRows& pair : pairs_) {
    const std::vector<Vector2<double>> left = left_of(pair);
    for (std::size_t i = 0; i < left.size(); ++i)
      squares.push_back(left[i].dot(pair.places[i].covariance.inverse() * left[i]));
  }
  if (squares.empty()) return;
  const double of_noise = median(squares) / (2 * std::log(2.0));
  const double variance = std::max(1.0, of_noise);
  noise_ratio_ = std::sqrt(of_noise);
  weights_.clear();
  for (const double square : squares) {
    const double sigmas = std::sqrt(square / variance);
    weights_.push_back(std::min(1.0, kHuber / std::max(sigmas, 1e-12)) / variance);
  }
}

double PairEquations::scatter_of(const std::vector<int>& at, const Eigen::MatrixXd& explained,
                                 const Eigen::MatrixXd& V) const {
  const auto n = static_cast<int>(V.rows());
  const int x_count = 2 * kFrameErrors + shared();
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(n);
  Eigen::VectorXd expected = Eigen::VectorXd::Zero(n);
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const std::vector<int> places = places_of(pairs_[p]);
    const Eigen::MatrixXd& own = of_pair_[p];
    Eigen::MatrixXd change = Eigen::MatrixXd::Zero(own.rows(), n + 1);  // Z~, and r - X x
    for (int i = 0; i < x_count; ++i) {
      const int global = places[static_cast<std::size_t>(i)];
      change.row(i) << -explained.row(global), -solution_[global];
    }
    for (std::size_t k = 0; k < free_.size(); ++k) {
      const int global = unknowns() + static_cast<int>(k);
      change.row(free_[k] - unknowns() + x_count) << -explained.row(global), -solution_[global];
    }
    for (int i = 0; i < n; ++i)
      change(at[static_cast<std::size_t>(i)] - unknowns() + x_count, i) += 1;
    change(own.rows() - 1, n) = 1;
    unwhiten(pairs_[p], &change);
    const Eigen::MatrixXd product = own * change;
    for (int i = 0; i < n; ++i) {
      const double part = change.col(i).dot(product.col(n));
      squares[i] += part * part;
      expected[i] += change.col(i).dot(product.col(i));
    }
  }
  double out = 1;
  for (int i = 0; i < n; ++i) {
    const int column = at[static_cast<std::size_t>(i)];
    if (V(i, i) > kNotSeen * sums_(column, column))
      out = std::max(out, 1 + (squares[i] - expected[i]) / V(i, i));
  }
  return out;
}

void PairEquations::judge(const Eigen::VectorXd& scale, const Eigen::VectorXd& s,
                          const Eigen::MatrixXd& V, double scatter, DepartureTest* out) {
  const auto n = static_cast<int>(s.size());
  Eigen::VectorXd unit = scale.cwiseMax(0.0).cwiseSqrt();
  for (double& each : unit) each = each > 0 ? 1 / each : 0;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(unit.asDiagonal() * V *
                                                              unit.asDiagonal());
  Eigen::VectorXd inverse = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i) {
    if (solver.eigenvalues()[i] <= kNotSeen) continue;
    inverse[i] = 1 / solver.eigenvalues()[i];
    ++out->freedom;
  }
  const Eigen::MatrixXd covariance = unit.asDiagonal() * solver.eigenvectors() *
                                     inverse.asDiagonal() * solver.eigenvectors().transpose() *
                                     unit.asDiagonal();
  const Eigen::VectorXd size = covariance * s;
  out->scatter = scatter;
  out->chi_square = s.dot(size) / scatter;
  if (out->freedom > 0) out->log_chance = internal::log_chance(out->chi_square, out->freedom);
  for (int i = 0; i < n; ++i) {
    out->size.push_back(size[i]);
    out->sigma.push_back(std::sqrt(std::max(0.0, scatter * covariance(i, i))));
  }
}

}  // namespace alidade
