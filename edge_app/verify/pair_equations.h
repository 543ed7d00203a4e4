#pragma once
// PairEquations: the equations of all pairs of pictures (pair_rows.h) with the departures' columns
// (departure_columns.h), summed up and solved; tests of departures (model_check.h) beside those
// that are free. Unknowns, whitened by their claimed covariance: each frame's errors, the
// parameters, what is left of telemetry's known errors. Then the departures, and r. rad, s, px.
// Allocates. One thread.

#include <Eigen/Dense>
#include <vector>

#include "core/model/calibration.h"
#include "core/model/telemetry_error.h"
#include "edge_app/verify/departure_columns.h"
#include "edge_app/verify/model_check.h"
#include "edge_app/verify/pair_rows.h"
#include "edge_app/verify/seen_frame.h"

namespace alidade {

class PairEquations {
 public:
  // frames, pairs: borrowed. Else as check_model().
  PairEquations(const std::vector<SeenFrame>& frames, const std::vector<PairRows>& pairs,
                const Calibration& calibration, const TelemetryError& telemetry_error,
                double motion_inflation);

  [[nodiscard]] const std::vector<DepartureColumns>& departures() const { return departures_; }
  [[nodiscard]] double noise_ratio() const { return noise_ratio_; }

  // Each frame's likeliest errors if there are no departures. In place of sum().
  [[nodiscard]] std::vector<Vector4<double>> frame_errors();

  // Comes first. Sums the equations up, with the noise that residuals show.
  void sum();

  // `d` against the present unknowns.
  [[nodiscard]] DepartureTest test(std::size_t d);
  // All of them together, which must not be free.
  [[nodiscard]] DepartureTest test(const std::vector<std::size_t>& departures) const;

  // From now on these departures have any size, and no others. A noise has its likeliest size.
  void set_free(const std::vector<std::size_t>& departures);
  [[nodiscard]] bool is_noise(std::size_t d) const { return !departures_[d].noise.empty(); }

 private:
  [[nodiscard]] double claimed_sigma(std::size_t d) const;

  [[nodiscard]] std::vector<int> columns_at(const std::vector<std::size_t>& departures) const;

  [[nodiscard]] int unknowns() const {
    return kFrameErrors * static_cast<int>(frames_.size()) + shared();
  }
  [[nodiscard]] int shared() const { return kParameterCount + static_cast<int>(known_.size()); }
  [[nodiscard]] int last() const { return unknowns() + columns_; }

  // Errors of the frames' times may be the same in all of them.
  [[nodiscard]] double shared_time_variance() const;

  void add_known(const DepartureColumns& departure, const TelemetryError& error);

  [[nodiscard]] static Vector2<double> by(const FrameColumn& column, const PairRows& pair,
                                          const PlaceRow& place);

  // Row pair of one place: errors of both frames (not whitened), what is shared, departures, r.
  [[nodiscard]] Eigen::Matrix<double, 2, Eigen::Dynamic> row(const PairRows& pair,
                                                             const PlaceRow& place) const;

  [[nodiscard]] std::vector<int> places_of(const PairRows& pair) const;

  void add_up_pairs();

  // The sums of all pairs, and the solution with the noise that residuals show.
  void sum_with_noise();

  // The frames' claimed covariances, with the noises as they are taken to be.
  void set_roots();

  // From columns of whitened errors of the pair's frames to columns of the errors.
  void unwhiten(const PairRows& pair, Eigen::MatrixXd* rows) const;

  // picture_variance: factor of the pictures' noise.
  void add_up(double picture_variance = 1);

  [[nodiscard]] Eigen::MatrixXd columns_of(const std::vector<int>& columns, int row,
                                           int rows) const;

  // The normal equations with what is free, and their right side.
  void fill(Eigen::MatrixXd* N, Eigen::VectorXd* g) const;

  void solve();

  // With the noises as they are taken to be.
  void take_noise();

  // But for a constant. What is free counts as in restricted maximum likelihood. Errors that the
  // places of a pair share look like noise of its frames, so the pictures' noise is taken to be as
  // large as what pairs share.
  double log_likelihood(std::size_t d, double size);

  struct Likeliest {
    double size = 0, sigma = 0;
    double gain = 0;  // twice that of log likelihood over a size of 0
  };
  Likeliest likeliest(std::size_t d);

  // Variance of the mean residual of a pair's places, over that of independent places, where frames
  // may err at will. Infinite: too few pairs tell it.
  [[nodiscard]] double pair_scatter();

  // Leaves the size of `d` and the sums as they were.
  DepartureTest test_noise(std::size_t d);

  // By the solution; not whitened.
  [[nodiscard]] Vector4<double> error_of_frame(std::size_t frame) const;

  // What the solution leaves of the residuals of a pair, place by place.
  [[nodiscard]] std::vector<Vector2<double>> left_of(const PairRows& pair) const;

  // Sum over the pairs of chi-square of a shift that is common to all places of a pair.
  [[nodiscard]] double square_of_shared() const;

  void measure_noise();

  // By how much the variance of s exceeds V, as the places of a pair have errors in common. Only
  // the part by the pictures' noise is judged: Z~^T W (r - X x) pair by pair, Z~ = Z - X explained.
  [[nodiscard]] double scatter_of(const std::vector<int>& at, const Eigen::MatrixXd& explained,
                                  const Eigen::MatrixXd& V) const;

  static void judge(const Eigen::VectorXd& scale, const Eigen::VectorXd& s,
                    const Eigen::MatrixXd& V, double scatter, DepartureTest* out);

  const std::vector<SeenFrame>& frames_;
  const std::vector<PairRows>& pairs_;
  std::vector<DepartureColumns> departures_;
  std::vector<int> first_column_;
  int columns_ = 0;
  std::vector<FrameColumn> known_;
  std::vector<Matrix4<double>> claimed_;  // covariances of the frames' errors
  std::vector<double> noise_size_;        // of each departure; 0: none, or not a noise
  std::vector<Matrix4<double>> frame_roots_;
  Eigen::Matrix<double, kParameterCount, kParameterCount> parameter_root_;
  std::vector<double> weights_;  // of each place, in order; empty: 1
  double noise_ratio_ = 1;
  double pair_scatter_ = 1;
  std::vector<int> free_;
  Eigen::MatrixXd sums_;
  std::vector<Eigen::MatrixXd> of_pair_;  // with errors of the frames that are not whitened
  Eigen::LDLT<Eigen::MatrixXd> information_;
  Eigen::VectorXd solution_;
};

}  // namespace alidade
