#include "core/calibration/movement_evidence.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/calibration/partial_inverse.h"

namespace alidade::internal {
namespace {

// Loose sigmas of what is not observed between dwells: corner distortion, and centre in px.
constexpr double kAnyDistortion = 10;
constexpr double kAnyCentre_px = 1e4;

// The node of the curve itself (without eps) at a reading.
std::optional<int> node_between(double reading, const ZoomEvidence& evidence) {
  for (int i = 0; i < evidence.nodes(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (evidence.is_between[at] && evidence.reading[at] == reading) return i;
  }
  return std::nullopt;
}

void insert_between(double reading, std::vector<int>* node_of, ZoomEvidence* evidence) {
  if (node_between(reading, *evidence) || evidence->nodes() >= ZoomCurve::kMaxNodes) return;
  const int node = insert_node(reading, evidence);
  evidence->is_between[static_cast<std::size_t>(node)] = true;
  for (int& other : *node_of) other += other >= node ? 1 : 0;
  static_assert(kDistortionCount == 1, "a loose sigma for each quantity");
  const std::array<double, kZoomQuantityCount> any = {0, kAnyDistortion, kAnyCentre_px,
                                                      kAnyCentre_px};
  for (int q = 1; q < kZoomQuantityCount; ++q) {
    const int row = evidence->row(node, q);
    evidence->H(row, row) += std::pow(any[static_cast<std::size_t>(q)], -2);
  }
}

// One movement's observations as rows over the nodes' log f.
struct MovementRows {
  std::vector<Eigen::VectorXd> row;  // of the unknowns
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;
  Eigen::VectorXd rate_per_s;
};

double tent(double a, double b) { return 1 - std::abs(a - b); }

MovementRows rows_of(const MovementObservation& movement, double repeatability,
                     const std::vector<int>& node_of, const ZoomEvidence& evidence) {
  struct End {
    double way;
    int visit;
    int curve;
    Eigen::Index place;  // in the observation
  };
  std::vector<End> ends;
  const auto add_end = [&](double way, const std::optional<std::size_t>& which) {
    if (!which || *which >= node_of.size()) return;
    const int visit = node_of[*which];
    const auto curve = node_between(evidence.reading[static_cast<std::size_t>(visit)], evidence);
    if (curve) ends.push_back({way, visit, *curve, way > 0 ? 1 : 0});
  };
  add_end(0, movement.from);
  add_end(1, movement.to);
  struct Passed {
    double way;
    int node;
    Eigen::Index place;
  };
  std::vector<Passed> passed;
  const Eigen::VectorXd& log_f = movement.log_focal_length;
  for (std::size_t i = 0; i < movement.reading.size(); ++i) {
    const auto node = node_between(movement.reading[i], evidence);
    const auto place = static_cast<Eigen::Index>(2 + i);
    const double way = (log_f[place] - log_f[0]) / (log_f[1] - log_f[0]);
    if (node) passed.push_back({std::clamp(way, 0.0, 1.0), *node, place});
  }

  MovementRows rows;
  const auto size = static_cast<Eigen::Index>(ends.size() + passed.size());
  rows.value.resize(size);
  rows.rate_per_s.setZero(size);
  rows.covariance.resize(size, size);
  std::vector<Eigen::Index> places;
  const auto unknowns = evidence.H.rows();
  for (const End& end : ends) {
    places.push_back(end.place);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns);
    row[evidence.row(end.visit, 0)] = 1;
    rows.row.push_back(row);
  }
  for (const Passed& at : passed) {
    places.push_back(at.place);
    Eigen::VectorXd row = Eigen::VectorXd::Zero(unknowns);
    row[evidence.row(at.node, 0)] += 1;
    for (const End& end : ends) {
      row[evidence.row(end.visit, 0)] += tent(at.way, end.way);
      row[evidence.row(end.curve, 0)] -= tent(at.way, end.way);
    }
    rows.row.push_back(row);
  }
  for (Eigen::Index i = 0; i < size; ++i) {
    const Eigen::Index a = places[static_cast<std::size_t>(i)];
    // eps has no level.
    rows.value[i] = log_f[a] - evidence.level[0];
    rows.rate_per_s[i] = movement.rate_per_s[a];
    for (Eigen::Index j = 0; j < size; ++j) {
      rows.covariance(i, j) = movement.covariance(a, places[static_cast<std::size_t>(j)]);
    }
  }
  const auto first = static_cast<Eigen::Index>(ends.size());
  for (std::size_t i = 0; i < passed.size(); ++i) {
    for (std::size_t j = 0; j < passed.size(); ++j) {
      double correlation = tent(passed[i].way, passed[j].way);
      for (const End& end : ends) {
        correlation -= tent(passed[i].way, end.way) * tent(passed[j].way, end.way);
      }
      rows.covariance(first + static_cast<Eigen::Index>(i), first + static_cast<Eigen::Index>(j)) +=
          repeatability * repeatability * correlation;
    }
  }
  return rows;
}

}  // namespace

bool add_movements(const std::vector<MovementObservation>& movements, const ZoomFitOptions& options,
                   double clock_sigma_s, std::vector<int>* node_of, ZoomEvidence* evidence) {
  for (const MovementObservation& movement : movements) {
    for (const auto& end : {movement.from, movement.to}) {
      if (!end || *end >= node_of->size()) continue;
      const auto visit = static_cast<std::size_t>((*node_of)[*end]);
      insert_between(evidence->reading[visit], node_of, evidence);
    }
  }
  for (const MovementObservation& movement : movements) {
    for (const double reading : movement.reading) insert_between(reading, node_of, evidence);
  }
  std::vector<MovementRows> all;
  Eigen::Index size = 0;
  for (const MovementObservation& movement : movements) {
    all.push_back(rows_of(movement, options.repeatability, *node_of, *evidence));
    size += all.back().value.size();
  }
  if (size == 0) return true;
  Eigen::MatrixXd S(size, evidence->H.rows());
  Eigen::VectorXd value(size);
  Eigen::VectorXd rate(size);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  Eigen::Index next = 0;
  for (const MovementRows& rows : all) {
    const Eigen::Index count = rows.value.size();
    for (Eigen::Index i = 0; i < count; ++i) {
      S.row(next + i) = rows.row[static_cast<std::size_t>(i)].transpose();
    }
    value.segment(next, count) = rows.value;
    rate.segment(next, count) = rows.rate_per_s;
    covariance.block(next, next, count, count) = rows.covariance;
    next += count;
  }
  covariance += (std::pow(options.zoom_late_sigma_s, 2) + std::pow(clock_sigma_s, 2)) * rate *
                rate.transpose();
  const Eigen::MatrixXd weight = scaled_inverse(covariance);
  if (weight.size() == 0) return false;
  evidence->H += S.transpose() * weight * S;
  evidence->g += S.transpose() * (weight * value);
  return true;
}

}  // namespace alidade::internal
