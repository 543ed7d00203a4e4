#pragma once
// ZoomCurve: a calibration for any zoom reading z of a lens, interpolated between calibrations at
// some readings, its nodes.
//   y(z): the quantities of zoom_law.h;   x = (z - z_first) / (z_last - z_first)
//   y_j(z) = level_j + Gaussian process in x with the covariance of ZoomSmoothness
// Line delay, axes, scales, aspect and clock offset are the same at all readings
// (kSharedParameters). A lens does not return exactly: each movement offsets log f by eps ~ N(0,
// repeatability^2). A dwell's node has its eps in its value; at() has repeatability^2 in its
// covariance. A node between dwells (is_between) was seen while the lens moved: no eps.
// Made by core/calibration/zoom_fit.h. Fixed memory; no allocation.

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/model/calibration.h"
#include "core/model/lens/zoom_law.h"

namespace alidade {

// The parameters that do not depend on the reading, in the order of the covariance.
inline constexpr std::array<Parameter, 9> kSharedParameters = {
    Parameter::kAspect,   Parameter::kLineDelay, Parameter::kPanAxis0,
    Parameter::kPanAxis1, Parameter::kTiltAxis0, Parameter::kTiltAxis1,
    Parameter::kPanScale, Parameter::kTiltScale, Parameter::kClockOffset};
inline constexpr int kSharedCount = static_cast<int>(kSharedParameters.size());

// Covariance of the process y_j. L = level_sigma, S = slope_sigma, q = roughness, in the unit of
// the quantity; x is 0 to 1 over the nodes:
//   K(x, x') = L^2 + S^2 (x - 1/2)(x' - 1/2) + q^2 W(x + 1, x' + 1),   W(s, t) = m^2 (3 M - m) / 6,
//   m, M = min, max(s, t)
// W is the covariance of a twice integrated random walk (Wahba 1978). The mean of y_j is a cubic
// spline; its variance grows with the cube of the distance from the nodes, between and beyond them.
struct ZoomSmoothness {
  double level_sigma = 0;
  double slope_sigma = 0;
  double roughness = 0;

  // K at two x of at least -1.
  [[nodiscard]] double covariance(double x, double other) const {
    const double low = std::min(x, other) + 1;
    const double high = std::max(x, other) + 1;
    return level_sigma * level_sigma + slope_sigma * slope_sigma * (x - 0.5) * (other - 0.5) +
           roughness * roughness * low * low * (3 * high - low) / 6;
  }
};

class ZoomCurve {
 public:
  static constexpr int kMaxNodes = 24;
  static constexpr int kMaxSize = kZoomQuantityCount * kMaxNodes + kSharedCount;
  template <int max_rows, int max_columns>
  using Bounded = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, max_rows, max_columns>;

  // All that at() needs. Matrices have the size of the actual nodes.
  struct Content {
    int nodes = 0;
    std::array<double, kMaxNodes> reading{};   // not decreasing; first and last differ
    std::array<bool, kMaxNodes> is_between{};  // seen in a movement: the value has no eps
    std::array<double, kZoomQuantityCount> level{};
    std::array<ZoomSmoothness, kZoomQuantityCount> smoothness;
    double repeatability = 0;  // sigma of log f after a movement
    Calibration shared;        // its image size and shared parameters count
    // Node by node the quantities minus their level; of a dwell's node with the dwell's eps.
    Bounded<kZoomQuantityCount * kMaxNodes, 1> value;
    Bounded<kMaxSize, kMaxSize> covariance;  // of value, then the shared parameters
    // For each quantity: inverse covariance of the process at the nodes, with repeatability at
    // dwells.
    std::array<Bounded<kMaxNodes, kMaxNodes>, kZoomQuantityCount> inverse;
  };

  ZoomCurve() = default;
  explicit ZoomCurve(const Content& content) : c_(content) {}

  [[nodiscard]] bool empty() const { return c_.nodes == 0; }
  [[nodiscard]] const Content& content() const { return c_; }
  // Number of nodes that are not between dwells.
  [[nodiscard]] int visits() const {
    const auto begin = c_.is_between.begin();
    return static_cast<int>(std::count(begin, begin + c_.nodes, false));
  }
  // Device units. The curve must not be empty.
  [[nodiscard]] double first_reading() const { return c_.reading[0]; }
  [[nodiscard]] double last_reading() const {
    return c_.reading[static_cast<std::size_t>(c_.nodes - 1)];
  }

  // The calibration after a movement to this reading (device units), with its zoom set. False for
  // an empty curve, and for a reading that is not finite or farther beyond an end than the two ends
  // are apart; *calibration is then unchanged.
  [[nodiscard]] bool at(double reading, Calibration* calibration) const {
    if (empty() || !std::isfinite(reading)) return false;
    const double x = position(reading);
    if (!(x >= -1 && x <= 2)) return false;
    std::array<Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNodes, 1>, kZoomQuantityCount>
        weight;
    ZoomQuantities<double> y;
    ZoomQuantityMatrix<double> covariance = ZoomQuantityMatrix<double>::Zero();
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      const auto q = static_cast<std::size_t>(j);
      const ZoomSmoothness& smooth = c_.smoothness[q];
      Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMaxNodes, 1> k(c_.nodes);
      for (int i = 0; i < c_.nodes; ++i) k[i] = smooth.covariance(x, node_position(i));
      weight[q].noalias() = c_.inverse[q].lazyProduct(k);
      y[j] = c_.level[q];
      for (int i = 0; i < c_.nodes; ++i) y[j] += weight[q][i] * c_.value(row(i, j), 0);
      covariance(j, j) = std::max(0.0, smooth.covariance(x, x) - k.dot(weight[q]));
    }
    covariance(0, 0) += c_.repeatability * c_.repeatability;
    // Columns: covariance of each quantity with all that is in c_.covariance.
    Eigen::Matrix<double, Eigen::Dynamic, kZoomQuantityCount, 0, kMaxSize, kZoomQuantityCount>
        of_all(c_.covariance.rows(), kZoomQuantityCount);
    of_all.setZero();
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      for (int i = 0; i < c_.nodes; ++i) {
        of_all.col(j) += weight[static_cast<std::size_t>(j)][i] * c_.covariance.col(row(i, j));
      }
    }
    for (int j = 0; j < kZoomQuantityCount; ++j) {
      for (int i = 0; i < c_.nodes; ++i) {
        covariance.row(j) += weight[static_cast<std::size_t>(j)][i] * of_all.row(row(i, j));
      }
    }
    assemble(y, covariance, of_all.bottomRows<kSharedCount>(), calibration);
    calibration->zoom = reading;
    return true;
  }

  // The calibration of a node, 0 to content().nodes - 1, as it was in its dwell. A node between
  // dwells has no eps.
  [[nodiscard]] Calibration node(int i) const {
    Calibration calibration;
    const int first = row(i, 0);
    ZoomQuantities<double> y = c_.value.middleRows<kZoomQuantityCount>(first);
    for (int j = 0; j < kZoomQuantityCount; ++j) y[j] += c_.level[static_cast<std::size_t>(j)];
    assemble(y, c_.covariance.block<kZoomQuantityCount, kZoomQuantityCount>(first, first),
             c_.covariance.block<kSharedCount, kZoomQuantityCount>(row(c_.nodes, 0), first),
             &calibration);
    calibration.zoom = c_.reading[static_cast<std::size_t>(i)];
    return calibration;
  }

 private:
  [[nodiscard]] double position(double reading) const {
    return (reading - first_reading()) / (last_reading() - first_reading());
  }
  [[nodiscard]] double node_position(int node) const {
    return position(c_.reading[static_cast<std::size_t>(node)]);
  }
  [[nodiscard]] static int row(int node, int quantity) {
    return kZoomQuantityCount * node + quantity;
  }

  void assemble(const ZoomQuantities<double>& y, const ZoomQuantityMatrix<double>& cov_y,
                const Matrix<double, kSharedCount, kZoomQuantityCount>& cov_shared_y,
                Calibration* out) const {
    *out = c_.shared;
    set_zoom_quantities(y, &out->camera);
    const ZoomQuantityMatrix<double> J = by_zoom_quantities(out->camera);
    const ZoomQuantityMatrix<double> cov_lens = J * cov_y * J.transpose();
    const Matrix<double, kSharedCount, kZoomQuantityCount> cov_shared_lens =
        cov_shared_y * J.transpose();
    const int shared_row = kZoomQuantityCount * c_.nodes;
    for (int i = 0; i < kZoomQuantityCount; ++i) {
      const int a = index(kParameterOfQuantity[static_cast<std::size_t>(i)]);
      for (int j = 0; j < kZoomQuantityCount; ++j) {
        out->covariance(a, index(kParameterOfQuantity[static_cast<std::size_t>(j)])) =
            cov_lens(i, j);
      }
      for (int j = 0; j < kSharedCount; ++j) {
        const int b = index(kSharedParameters[static_cast<std::size_t>(j)]);
        out->covariance(a, b) = out->covariance(b, a) = cov_shared_lens(j, i);
      }
    }
    for (int i = 0; i < kSharedCount; ++i) {
      for (int j = 0; j < kSharedCount; ++j) {
        out->covariance(index(kSharedParameters[static_cast<std::size_t>(i)]),
                        index(kSharedParameters[static_cast<std::size_t>(j)])) =
            c_.covariance(shared_row + i, shared_row + j);
      }
    }
  }

  Content c_;
};

}  // namespace alidade
