#include "core/calibration/zoom_evidence.h"

#include <algorithm>
#include <cstddef>

namespace alidade::internal {
namespace {

// Rows and columns of matrix or vector at places of a larger one, zero elsewhere.
Eigen::MatrixXd spread(const Eigen::MatrixXd& matrix, const std::vector<int>& rows,
                       const std::vector<int>& columns, Eigen::Index size_rows,
                       Eigen::Index size_columns) {
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(size_rows, size_columns);
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < columns.size(); ++j) {
      result(rows[i], columns[j]) =
          matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
    }
  }
  return result;
}

// All rows but those of one node, of a curve with so many.
std::vector<int> rows_but(int node, int nodes) {
  std::vector<int> rows;
  for (int i = 0; i < kZoomQuantityCount * nodes + kSharedCount; ++i) {
    if (i / kZoomQuantityCount != node || i >= kZoomQuantityCount * nodes) rows.push_back(i);
  }
  return rows;
}

// information and weighted of a quantity: H with all other rows eliminated.
bool set_information(int quantity, const Eigen::MatrixXd& H, const std::vector<int>& rows,
                     ZoomEvidence* evidence) {
  const int nodes = evidence->nodes();
  std::vector<int> others;
  for (const int row : rows) {
    if (row >= kZoomQuantityCount * nodes || row % kZoomQuantityCount != quantity)
      others.push_back(row);
  }
  const Eigen::MatrixXd inverse = scaled_inverse(part_of(H, others));
  if (inverse.size() == 0) return false;
  const auto count = static_cast<Eigen::Index>(others.size());
  Eigen::MatrixXd H_of(nodes, count);
  Eigen::VectorXd g_others(count);
  Eigen::MatrixXd information(nodes, nodes);
  Eigen::VectorXd weighted(nodes);
  for (int i = 0; i < nodes; ++i) {
    const int row = evidence->row(i, quantity);
    weighted[i] = evidence->g[row];
    for (int j = 0; j < nodes; ++j) {
      information(i, j) = evidence->H(row, evidence->row(j, quantity));
    }
    for (Eigen::Index j = 0; j < count; ++j)
      H_of(i, j) = H(row, others[static_cast<std::size_t>(j)]);
  }
  for (Eigen::Index j = 0; j < count; ++j)
    g_others[j] = evidence->g[others[static_cast<std::size_t>(j)]];
  const Eigen::MatrixXd share = H_of * inverse;
  information -= share * H_of.transpose();
  weighted -= share * g_others;
  evidence->information[static_cast<std::size_t>(quantity)] = information;
  evidence->weighted[static_cast<std::size_t>(quantity)] = weighted;
  return true;
}

}  // namespace

std::vector<int> ZoomEvidence::rows(const std::vector<int>& places) const {
  std::vector<int> rows;
  for (int i = 0; i < nodes(); ++i) {
    for (const int place : places) {
      if (i == 0 || place < kZoomQuantityCount) rows.push_back(row(i, place));
    }
  }
  std::sort(rows.begin(), rows.end());
  return rows;
}

ZoomEvidence no_zoom_evidence(const std::vector<double>& readings) {
  ZoomEvidence evidence;
  evidence.reading = readings;
  evidence.is_between.assign(readings.size(), false);
  const int size = kZoomQuantityCount * evidence.nodes() + kSharedCount;
  evidence.H.setZero(size, size);
  evidence.g.setZero(size);
  return evidence;
}

void add_zoom_sample(const ZoomSample& sample, int node, bool with_shared_priors,
                     ZoomEvidence* evidence) {
  ZoomSampleVector value = sample.value;
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    value[q] -= evidence->level[static_cast<std::size_t>(q)];
  }
  const ZoomSampleVector weighted = sample.information * value;
  for (int a = 0; a < kZoomSampleSize; ++a) {
    const double share = a < kZoomQuantityCount || !with_shared_priors ? 1 : 0;
    const int row = evidence->row(node, a);
    evidence->g[row] += weighted[a] - share * sample.prior_weighted[a];
    evidence->H(row, row) -= share * sample.prior_information[a];
    for (int b = 0; b < kZoomSampleSize; ++b) {
      evidence->H(row, evidence->row(node, b)) += sample.information(a, b);
    }
  }
}

bool take_apart(const ZoomCurve& curve, const ZoomCurveParts& parts, ZoomEvidence* evidence) {
  constexpr double kAnyClock_s = 0.1;  // as far as two connections' delays may differ
  const ZoomCurve::Content& content = curve.content();
  *evidence = no_zoom_evidence({content.reading.begin(), content.reading.begin() + content.nodes});
  evidence->is_between.assign(content.is_between.begin(),
                              content.is_between.begin() + content.nodes);
  evidence->level = content.level;
  Eigen::MatrixXd covariance = content.covariance;
  const std::vector<int> rows = evidence->rows(parts.places);
  const int clock = evidence->row(0, zoom_place_of(Parameter::kClockOffset));
  take_common_clock_error(rows, clock, parts.common_clock_sigma_s, &covariance);
  if (parts.clock_is_another) covariance(clock, clock) += kAnyClock_s * kAnyClock_s;
  const Eigen::MatrixXd information = scaled_inverse(part_of(covariance, rows));
  if (information.size() == 0) return false;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(covariance.rows());
  mean.head(content.value.rows()) = content.value;
  evidence->H = spread(information, rows, rows, covariance.rows(), covariance.rows());
  // The curves are about their levels: all of this is of the calibrations.
  evidence->g = evidence->H * mean;
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    const auto& inverse = content.inverse[static_cast<std::size_t>(q)];
    for (int i = 0; i < content.nodes; ++i) {
      for (int j = 0; j < content.nodes; ++j) {
        evidence->H(evidence->row(i, q), evidence->row(j, q)) -= inverse(i, j);
      }
    }
  }
  return true;
}

int insert_node(double reading, ZoomEvidence* evidence) {
  const auto place = std::upper_bound(evidence->reading.begin(), evidence->reading.end(), reading);
  const auto node = static_cast<int>(place - evidence->reading.begin());
  std::vector<double> readings = evidence->reading;
  readings.insert(readings.begin() + node, reading);
  ZoomEvidence larger = no_zoom_evidence(readings);
  larger.is_between = evidence->is_between;
  larger.is_between.insert(larger.is_between.begin() + node, false);
  const std::vector<int> rows = rows_but(node, larger.nodes());
  larger.level = evidence->level;
  larger.H = spread(evidence->H, rows, rows, larger.H.rows(), larger.H.cols());
  larger.g = spread(evidence->g, rows, {0}, larger.g.rows(), 1);
  *evidence = larger;
  return node;
}

bool set_marginals(const std::vector<int>& places, double centre_sigma_px, ZoomEvidence* evidence) {
  Eigen::MatrixXd H = evidence->H;
  if (centre_sigma_px > 0) {
    for (int i = 0; i < evidence->nodes(); ++i) {
      for (const Parameter p : {Parameter::kCentreU, Parameter::kCentreV}) {
        const int row = evidence->row(i, zoom_place_of(p));
        H(row, row) += 1 / (centre_sigma_px * centre_sigma_px);
      }
    }
  }
  const std::vector<int> rows = evidence->rows(places);
  for (int i = 0; i < evidence->nodes(); ++i) {
    constexpr double kAnyLogF = 1;  // of what movements leave open, where another quantity is asked
    if (evidence->is_between[static_cast<std::size_t>(i)])
      H(evidence->row(i, 0), evidence->row(i, 0)) += 1 / (kAnyLogF * kAnyLogF);
  }
  for (int q = 0; q < kZoomQuantityCount; ++q) {
    if (!set_information(q, H, rows, evidence)) return false;
  }
  return true;
}

ZoomCurve::Content without_a_node(const ZoomCurve::Content& content) {
  const auto reading = [&](int i) { return content.reading[static_cast<std::size_t>(i)]; };
  int crowded = 1;
  for (int i = 2; i + 1 < content.nodes; ++i) {
    if (reading(i + 1) - reading(i - 1) < reading(crowded + 1) - reading(crowded - 1)) crowded = i;
  }
  ZoomCurve::Content rest = content;
  --rest.nodes;
  for (int i = crowded; i < rest.nodes; ++i) {
    rest.reading[static_cast<std::size_t>(i)] = reading(i + 1);
    rest.is_between[static_cast<std::size_t>(i)] =
        content.is_between[static_cast<std::size_t>(i + 1)];
  }
  const std::vector<int> rows = rows_but(crowded, content.nodes);
  rest.covariance = part_of(content.covariance, rows);
  rest.value.resize(kZoomQuantityCount * rest.nodes, 1);
  for (Eigen::Index i = 0; i < rest.value.rows(); ++i) {
    rest.value(i, 0) = content.value(rows[static_cast<std::size_t>(i)], 0);
  }
  return rest;
}

}  // namespace alidade::internal
