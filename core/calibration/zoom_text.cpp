#include "core/calibration/zoom_text.h"

#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "core/calibration/number_text.h"
#include "core/calibration/zoom_fit.h"

namespace alidade::internal {

namespace {

static_assert(kDistortionCount == 1, "a name and a limit for each quantity");
constexpr std::array<const char*, kZoomQuantityCount> kQuantityNames = {
    "log_focal_length", "corner_distortion", "centre_u", "centre_v"};
// A value beyond these is in another unit.
constexpr std::array<double, kZoomQuantityCount> kLargest = {20, 10, 1e4, 1e4};
constexpr double kLargestSigma = 1e4;

EstimateRows covariance_rows(int nodes) {
  EstimateRows rows;
  for (int i = 0; i < nodes; ++i) {
    for (const char* name : kQuantityNames) {
      rows.names.push_back(std::string(name) + "@" + std::to_string(i));
    }
  }
  for (const Parameter p : kSharedParameters) rows.names.emplace_back(to_string(p));
  rows.largest_sigma.assign(rows.names.size(), kLargestSigma);
  rows.known = "log_focal_length@0, corner_distortion@0, ..., clock_offset";
  rows.unit = "the unit of the value (axes: radians)";
  return rows;
}

double bounded(const EstimateReader& file, const YAML::Node& map, const char* key,
               const std::string& prefix, double least, double most) {
  const YAML::Node node = file.required(map, key, prefix);
  const double value = file.number(node, prefix + key);
  if (value < least || value > most) {
    file.fail(node, prefix + key + " is " + node.Scalar() + "; from " + short_text(least) + " to " +
                        short_text(most) + " is plausible");
  }
  return value;
}

void read_smoothness(const EstimateReader& file, const YAML::Node& node,
                     ZoomCurve::Content* content) {
  const std::string prefix = "zoom_curve.smoothness.";
  file.check_keys(node, {kQuantityNames.begin(), kQuantityNames.end()}, prefix);
  for (std::size_t q = 0; q < kQuantityNames.size(); ++q) {
    const YAML::Node entry = file.required(node, kQuantityNames[q], prefix);
    const std::string of_entry = prefix + kQuantityNames[q] + ".";
    file.check_keys(entry, {"level_sigma", "slope_sigma", "roughness"}, of_entry);
    constexpr double kMost = 1e6;
    content->smoothness[q] = {bounded(file, entry, "level_sigma", of_entry, 0, kMost),
                              bounded(file, entry, "slope_sigma", of_entry, 0, kMost),
                              bounded(file, entry, "roughness", of_entry, 0, kMost)};
  }
}

void read_nodes(const EstimateReader& file, const YAML::Node& nodes, ZoomCurve::Content* content) {
  const std::string name = "zoom_curve.nodes";
  if (!nodes.IsSequence() || nodes.size() < 2 || nodes.size() > ZoomCurve::kMaxNodes) {
    file.fail(nodes, name + " is not a list of 2 to " + std::to_string(ZoomCurve::kMaxNodes) +
                         " nodes; write [{reading: ..., ...}, ...]");
  }
  content->nodes = static_cast<int>(nodes.size());
  content->value.resize(kZoomQuantityCount * content->nodes, 1);
  const std::string prefix = name + ".";
  for (int i = 0; i < content->nodes; ++i) {
    const YAML::Node node = nodes[static_cast<std::size_t>(i)];
    std::vector<std::string> known{"reading", "between_dwells"};
    known.insert(known.end(), kQuantityNames.begin(), kQuantityNames.end());
    file.check_keys(node, known, prefix);
    const double reading = bounded(file, node, "reading", prefix, -1e12, 1e12);
    if (i > 0 && reading < content->reading[static_cast<std::size_t>(i - 1)]) {
      file.fail(node, prefix + "reading " + short_text(reading) +
                          " is less than the one before; give them in increasing order");
    }
    content->reading[static_cast<std::size_t>(i)] = reading;
    if (const YAML::Node between = node["between_dwells"]) {
      bool value = false;
      if (!YAML::convert<bool>::decode(between, value)) {
        file.fail(between,
                  prefix + "between_dwells is " + between.Scalar() + "; true or false is expected");
      }
      content->is_between[static_cast<std::size_t>(i)] = value;
    }
    for (std::size_t q = 0; q < kQuantityNames.size(); ++q) {
      content->value(kZoomQuantityCount * i + static_cast<int>(q), 0) =
          bounded(file, node, kQuantityNames[q], prefix, -kLargest[q], kLargest[q]);
    }
  }
  if (content->reading[0] == content->reading[static_cast<std::size_t>(content->nodes - 1)]) {
    file.fail(nodes, name + " are all at reading " + short_text(content->reading[0]) +
                         "; two readings or more are needed");
  }
}

}  // namespace

ZoomCurve read_zoom_curve(const EstimateReader& file, const YAML::Node& node,
                          const Calibration& shared) {
  const std::string prefix = "zoom_curve.";
  file.check_keys(node, {"repeatability", "smoothness", "nodes", "covariance"}, prefix);
  ZoomCurve::Content content;
  content.repeatability = bounded(file, node, "repeatability", prefix, 0, 1);
  read_smoothness(file, file.required(node, "smoothness", prefix), &content);
  read_nodes(file, file.required(node, "nodes", prefix), &content);
  for (int i = 0; i < content.nodes; ++i) {
    content.level[0] += content.value(kZoomQuantityCount * i, 0) / content.nodes;
  }
  for (int i = 0; i < content.nodes; ++i) {
    content.value(kZoomQuantityCount * i, 0) -= content.level[0];
  }
  const EstimateRows rows = covariance_rows(content.nodes);
  const auto size = static_cast<Eigen::Index>(rows.names.size());
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(size, size);
  file.read_covariance(file.required(node, "covariance", prefix), rows, covariance);
  content.covariance = covariance;
  content.shared = shared;
  content.shared.covariance.setZero();
  if (!set_inverses(&content)) {
    file.fail(node, "zoom_curve has nodes too close for its smoothness; calibrate again");
  }
  return ZoomCurve(content);
}

void write_zoom_curve(const ZoomCurve& curve, YAML::Emitter* out) {
  const ZoomCurve::Content& content = curve.content();
  YAML::Emitter& o = *out;
  const auto number = [&o](const char* name, double value) {
    o << YAML::Key << name << YAML::Value << exact_text(value);
  };
  o << YAML::BeginMap;
  number("repeatability", content.repeatability);
  o << YAML::Comment("sigma of log f after a movement of the zoom");
  o << YAML::Key << "smoothness" << YAML::Value << YAML::BeginMap;
  for (std::size_t q = 0; q < kQuantityNames.size(); ++q) {
    o << YAML::Key << kQuantityNames[q] << YAML::Value << YAML::Flow << YAML::BeginMap;
    number("level_sigma", content.smoothness[q].level_sigma);
    number("slope_sigma", content.smoothness[q].slope_sigma);
    number("roughness", content.smoothness[q].roughness);
    o << YAML::EndMap;
  }
  o << YAML::EndMap << YAML::Key << "nodes" << YAML::Value << YAML::BeginSeq;
  for (int i = 0; i < content.nodes; ++i) {
    o << YAML::Flow << YAML::BeginMap;
    number("reading", content.reading[static_cast<std::size_t>(i)]);
    for (int q = 0; q < kZoomQuantityCount; ++q) {
      const auto of = static_cast<std::size_t>(q);
      number(kQuantityNames[of], content.level[of] + content.value(kZoomQuantityCount * i + q, 0));
    }
    if (content.is_between[static_cast<std::size_t>(i)]) {
      o << YAML::Key << "between_dwells" << YAML::Value << true;
    }
    const int row = kZoomQuantityCount * i;
    const double f = std::exp(content.level[0] + content.value(row, 0));
    o << YAML::EndMap
      << YAML::Comment("focal length " +
                       estimate_text(f, f * std::sqrt(content.covariance(row, row)), "px"));
  }
  o << YAML::EndSeq << YAML::Key << "covariance" << YAML::Value << YAML::BeginMap << YAML::Key
    << "names" << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const std::string& name : covariance_rows(content.nodes).names) o << name;
  o << YAML::EndSeq << YAML::Key << "matrix" << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index i = 0; i < content.covariance.rows(); ++i) {
    o << YAML::Flow << YAML::BeginSeq;
    for (Eigen::Index j = 0; j < content.covariance.cols(); ++j) {
      o << exact_text(content.covariance(i, j));
    }
    o << YAML::EndSeq;
  }
  o << YAML::EndSeq << YAML::EndMap << YAML::EndMap;
}

}  // namespace alidade::internal
