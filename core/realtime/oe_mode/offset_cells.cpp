#include "core/realtime/oe_mode/offset_cells.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"

namespace alidade {
namespace {

constexpr double kUsualLength = 0.04;  // rad; where neighbours do not tell it
// sqrt(2 pi), the width of exp(-d^2 / (2 L^2)) in L.
constexpr double kWidthOfLength = 2.5066;

// Chi-square of so many degrees of freedom that chance exceeds about once in 10^4.
double gate_of_scatter(double freedom) { return freedom + 4 * std::sqrt(2 * freedom) + 8; }

double middle_of(int cell) { return (cell + 0.5) * OffsetAxisCells::kCell_rad - kPi; }

}  // namespace

int OffsetAxisCells::cell_of(double angle) {
  const int cell = static_cast<int>((wrap_angle(angle) + kPi) / kCell_rad);
  return std::clamp(cell, 0, kCells - 1);
}

void OffsetAxisCells::clear() { cells_.fill({}); }

void OffsetAxisCells::add(const Seen& seen, double drift) {
  const int index = cell_of(seen.angle);
  Cell& cell = cells_[static_cast<std::size_t>(index)];
  if (cell.information > 0) {
    const double elapsed_s = std::abs(seen.time_s - cell.time_s);
    cell.information = 1 / (1 / cell.information + drift * drift * elapsed_s);
  }
  const double added = 1 / seen.variance;
  const double share = added / (cell.information + added);
  cell.information += added;
  cell.angle += share * (wrap_angle(seen.angle - middle_of(index)) - cell.angle);
  cell.mean += share * (seen.offset - cell.mean);
  cell.told_variance += share * (seen.told_variance - cell.told_variance);
  cell.calibration_variance += share * (seen.calibration_variance - cell.calibration_variance);
  cell.used += seen.used;
  cell.time_s = seen.time_s;
}

void OffsetAxisCells::move(double by) {
  for (Cell& cell : cells_) cell.mean += by;
}

// The correlation exp(-d / l) has the same independent lengths as exp(-d^2 / (2 L^2)) if 2 l =
// sqrt(2 pi) L; with it the nearest cell says what all say.
OffsetAxisCells::Expected OffsetAxisCells::expected(double angle, double variance,
                                                    double length_rad) const {
  constexpr double kFarthest = 2;  // lengths
  const double learnt = error_.length > 0 ? error_.length : kUsualLength;
  const double length = 0.5 * kWidthOfLength * (length_rad > 0 ? length_rad : learnt);
  const int reach = std::min(static_cast<int>(kFarthest * length / kCell_rad) + 1, kCells / 2 - 1);
  const int here = cell_of(angle);
  const auto angle_of = [this](int index) {
    return middle_of(index) + cells_[static_cast<std::size_t>(index)].angle;
  };
  const bool been = cells_[static_cast<std::size_t>(here)].information > 0;
  const double from = been ? angle_of(here) : angle;
  Expected out;
  out.variance = variance;
  for (int i = here - reach; i <= here + reach; ++i) {
    const int index = (i + kCells) % kCells;
    const Cell& cell = cells_[static_cast<std::size_t>(index)];
    if (!(cell.information > 0)) continue;
    const double off = std::abs(wrap_angle(angle_of(index) - from));
    const double correlation = index == here ? 1 : std::exp(-off / length);
    const double known = variance * cell.information;
    const double weight = correlation * known / (1 + known);
    const double left = variance * (1 - correlation * weight);
    if (left < out.variance) out = {weight, cell.mean, left};
  }
  return out;
}

double OffsetAxisCells::share_of_error(double length_rad) const {
  const int width = static_cast<int>(
      std::clamp(std::round(kWidthOfLength * length_rad / kCell_rad), 1.0, 1.0 * kCells));
  double total = 0;
  double squares = 0;
  for (int first = 0; first < kCells; first += width) {
    double used = 0;
    for (int i = first; i < std::min(first + width, kCells); ++i) {
      used += cells_[static_cast<std::size_t>(i)].used;
    }
    total += used;
    squares += used * used;
  }
  return total > 0 ? squares / (total * total) : 1;
}

// From the differences of neighbours: their mean square is 2 A^2 (1 - rho), rho = exp(-d^2 / 2L^2).
double OffsetAxisCells::scatter_length(double variance) const {
  constexpr int kLeastPairs = 3;
  int pairs = 0;
  double square = 0;
  for (int i = 0; i < kCells; ++i) {
    const Cell& a = cells_[static_cast<std::size_t>(i)];
    const Cell& b = cells_[static_cast<std::size_t>((i + 1) % kCells)];
    if (!(a.information > 0) || !(b.information > 0)) continue;
    ++pairs;
    square += (b.mean - a.mean) * (b.mean - a.mean) - 1 / a.information - 1 / b.information;
  }
  if (pairs < kLeastPairs) return kUsualLength;
  const double rho = std::clamp(1 - square / pairs / (2 * variance), 0.14, 0.99);
  return kCell_rad / std::sqrt(-2 * std::log(rho));
}

// Around a straight line: a slope is the calibration's (a scale, a focal length), not a gear's.
OffsetAxisCells::Scatter OffsetAxisCells::scatter() const {
  constexpr int kLeastCells = 4;
  double total = 0;
  double squares = 0;
  Vector2<double> mean = Vector2<double>::Zero();  // angle, offset
  int count = 0;
  int first = 0;
  const auto weight_of = [](const Cell& cell) {
    return 1 / (1 / cell.information + cell.told_variance + cell.calibration_variance);
  };
  const auto point_of = [&](int i) {
    const Cell& cell = cells_[static_cast<std::size_t>(i)];
    return Vector2<double>(wrap_angle(middle_of(i) + cell.angle - middle_of(first)), cell.mean);
  };
  for (int i = 0; i < kCells; ++i) {
    const Cell& cell = cells_[static_cast<std::size_t>(i)];
    if (!(cell.information > 0)) continue;
    if (count == 0) first = i;
    const double weight = weight_of(cell);
    total += weight;
    squares += weight * weight;
    mean += weight / total * (point_of(i) - mean);
    ++count;
  }
  Scatter out;
  if (count < kLeastCells) return out;
  Vector2<double> about = Vector2<double>::Zero();  // squares about the mean
  double product = 0;
  for (int i = first; i < kCells; ++i) {
    const Cell& cell = cells_[static_cast<std::size_t>(i)];
    if (!(cell.information > 0)) continue;
    const Vector2<double> off = point_of(i) - mean;
    about += weight_of(cell) * off.cwiseAbs2();
    product += weight_of(cell) * off[0] * off[1];
  }
  const double square = about[1] - product * product / about[0];
  out.freedom = count - 2;
  if (error_.variance == 0 && !(square > gate_of_scatter(out.freedom))) return out;
  // DerSimonian and Laird (1986); and few cells may all have come out alike.
  const double information = (total - squares / total) * out.freedom / (count - 1);
  const double estimate = (square - out.freedom) / information * (1 + 3.0 / out.freedom);
  out.variance = std::clamp(estimate, 0.0, kLargestError_rad * kLargestError_rad);
  if (out.variance > 0) out.length = scatter_length(out.variance);
  return out;
}

void OffsetAxisCells::take_error(const Scatter& error, double* offset_variance) {
  const double grown = error.variance - error_.variance;
  error_ = error;
  if (!(grown > 0) || !(*offset_variance > 0)) return;
  const double by = grown * share_of_error(error.length);
  // What the estimate took before counts for less beside what comes.
  for (Cell& cell : cells_) cell.used *= *offset_variance / (*offset_variance + by);
  *offset_variance += by;
}

}  // namespace alidade
