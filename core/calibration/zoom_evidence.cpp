#include "core/calibration/zoom_evidence.h"

#include <algorithm>
#include <cstddef>

#include "core/calibration/partial_inverse.h"

namespace alidade::internal {
namespace {

// All rows except those of one node, for a curve of `nodes` nodes.
std::vector<int> rows_but(int node, int nodes) {
  std::vector<int> rows;
  for (int i = 0; i < kZoomQuantityCount * nodes + kSharedCount; ++i) {
    if (i / kZoomQuantityCount != node || i >= kZoomQuantityCount * nodes) rows.push_back(i);
  }
  return rows;
}

// Sets information and weighted of a quantity: H with all other rows eliminated.
bool set_information(int quantity, const Eigen::MatrixXd& H, const std::vector<int>& rows,
                     ZoomEvidence* evidence) {
  const int nodes = evidence->nodes();
  std::vector<int> others;
  for (const int row : rows) {
    if (row >= kZoomQuantityCount * nodes || row % kZoomQuantityCount != quantity)
      others.push_back(row);
  }
  std::vector<int> own(static_cast<std::size_t>(nodes));
  for (int i = 0; i < nodes; ++i) own[static_cast<std::size_t>(i)] = evidence->row(i, quantity);
  const Eigen::MatrixXd inverse = scaled_inverse(H(others, others));
  if (inverse.size() == 0) return false;
  const Eigen::MatrixXd H_of = H(own, others);
  const Eigen::MatrixXd share = H_of * inverse;
  const Eigen::MatrixXd information = evidence->H(own, own) - share * H_of.transpose();
  const Eigen::VectorXd weighted = evidence->g(own, 0) - share * evidence->g(others, 0);
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
  const ZoomCurve::Content& content = curve.content();
  *evidence = no_zoom_evidence({content.reading.begin(), content.reading.begin() + content.nodes});
  evidence->is_between.assign(content.is_between.begin(),
                              content.is_between.begin() + content.nodes);
  evidence->level = content.level;
  Eigen::MatrixXd covariance = content.covariance;
  const std::vector<int> rows = evidence->rows(parts.places);
  const int clock = evidence->row(0, zoom_place_of(Parameter::kClockOffset));
  take_common_clock_error(rows, clock, parts.common_clock_sigma_s, &covariance);
  if (parts.clock_is_another) covariance(clock, clock) += kAnyConnection_s * kAnyConnection_s;
  evidence->H = inverse_over(covariance, rows);
  if (evidence->H.size() == 0) return false;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(covariance.rows());
  mean.head(content.value.rows()) = content.value;
  // The smoothness is about zero, so it adds nothing to g: all of g comes from the calibrations.
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
  const Eigen::Map<const Eigen::ArrayXi> at(rows.data(), static_cast<Eigen::Index>(rows.size()));
  larger.H(at, at) = evidence->H;
  larger.g(at, 0) = evidence->g;
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
    constexpr double kAnyLogF = 1;  // log f between dwells, while another quantity is marginalised
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
  rest.covariance = content.covariance(rows, rows);
  const std::vector<int> of_nodes(rows.begin(), rows.end() - kSharedCount);
  rest.value = content.value(of_nodes, 0);
  return rest;
}

}  // namespace alidade::internal
