#include "core/calibration/estimate_reader.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/calibration/number_text.h"

namespace alidade {

EstimateReader::EstimateReader(const YAML::Node& root, std::string file)
    : root_(root), file_(std::move(file)) {}

void EstimateReader::fail(const YAML::Node& node, const std::string& text) const {
  throw YamlError(file_ + ":" + std::to_string(line_of(node).value_or(1)) + ": " + text);
}

void EstimateReader::check_top(const std::string& kind,
                               const std::vector<std::string>& known) const {
  if (!root_.IsMap()) fail(root_, "not " + kind + "; start with `format: 1`");
  check_keys(root_, known, "");
  const YAML::Node format = required(root_, "format", "");
  if (number(format, "format") != 1) {
    fail(format, "format " + format.Scalar() + " is not known; this version reads format 1");
  }
}

void EstimateReader::check_keys(const YAML::Node& map, const std::vector<std::string>& known,
                                const std::string& prefix) const {
  const auto found = find_faulty_key(map, known);
  if (!found) return;
  switch (found->fault) {
    case KeyFault::kNoWord:
      fail(found->key, "a key is not a word; write `name: value`");
    case KeyFault::kDoubled:
      fail(found->key, prefix + found->key.Scalar() + " is given twice; keep one");
    case KeyFault::kUnknown:
      fail(found->key,
           "unknown key " + prefix + found->key.Scalar() + "; known are " + join(known));
  }
}

YAML::Node EstimateReader::required(const YAML::Node& map, const char* key,
                                    const std::string& prefix) const {
  if (!map.IsMap()) {
    fail(map, prefix.substr(0, prefix.size() - 1) + " is not a map; write {" + key + ": ...}");
  }
  const YAML::Node node = map[key];
  if (!node) fail(map, prefix + key + " is missing; add it");
  return node;
}

double EstimateReader::number(const YAML::Node& node, const std::string& name) const {
  if (node.IsScalar()) {
    const std::optional<double> value = number_of(node.Scalar());
    if (value) return *value;
    fail(node, name + " is \"" + node.Scalar() + "\"; a finite number is needed");
  }
  fail(node, name + " is not a single value; a finite number is needed");
}

std::vector<double> EstimateReader::numbers(const YAML::Node& node, const std::string& name,
                                            std::size_t count) const {
  if (!node.IsSequence() || node.size() != count) {
    fail(node, name + " is not a list of " + std::to_string(count) + " numbers; write [x, ...]");
  }
  std::vector<double> values;
  for (const YAML::Node& item : node) values.push_back(number(item, name));
  return values;
}

int EstimateReader::pixels(const YAML::Node& image, const char* key) const {
  const std::string name = std::string("image.") + key;
  const YAML::Node node = required(image, key, "image.");
  const double value = number(node, name);
  if (value < 1 || value > 1e5 || value != std::floor(value)) {
    fail(node, name + " is " + node.Scalar() + "; a whole number of pixels from 1 to 100000");
  }
  return static_cast<int>(value);
}

void EstimateReader::read_image(int* width, int* height) const {
  const YAML::Node image = required(root_, "image", "");
  check_keys(image, {"width", "height"}, "image.");
  *width = pixels(image, "width");
  *height = pixels(image, "height");
}

YAML::Node EstimateReader::entry(const std::string& name,
                                 const std::vector<std::string>& keys) const {
  const YAML::Node entry = required(root_, name.c_str(), "");
  if (!entry.IsMap())
    fail(entry, name + " is not a map; write {" + keys[0] + ": ..., " + keys[1] + ": ...}");
  check_keys(entry, keys, name + ".");
  return entry;
}

double EstimateReader::value(const YAML::Node& entry, const std::string& name,
                             const EstimateRange& range) const {
  const YAML::Node node = required(entry, "value", name + ".");
  const double value = number(node, name);
  if (value < range.least || value > range.most) {
    fail(node, name + " is " + node.Scalar() + "; give " + range.hint);
  }
  return value;
}

std::vector<int> EstimateReader::rows_of(const YAML::Node& names, const EstimateRows& rows) const {
  if (!names.IsSequence()) fail(names, "covariance.names is not a list; write [name, ...]");
  std::vector<int> found;
  for (const YAML::Node& name : names) {
    const auto at = name.IsScalar() ? std::find(rows.names.begin(), rows.names.end(), name.Scalar())
                                    : rows.names.end();
    if (at == rows.names.end()) {
      fail(name, "covariance.names has an unknown name; known are " + rows.known);
    }
    const auto row = static_cast<int>(at - rows.names.begin());
    if (std::find(found.begin(), found.end(), row) != found.end()) {
      fail(name, "covariance.names has " + name.Scalar() + " twice; keep one");
    }
    found.push_back(row);
  }
  return found;
}

void EstimateReader::read_covariance(const YAML::Node& entry, const EstimateRows& rows,
                                     Eigen::Ref<Eigen::MatrixXd> covariance) const {
  if (!entry.IsMap()) fail(entry, "covariance is not a map; write {names: ..., matrix: ...}");
  check_keys(entry, {"names", "matrix"}, "covariance.");
  const std::vector<int> found = rows_of(required(entry, "names", "covariance."), rows);
  const YAML::Node matrix = required(entry, "matrix", "covariance.");
  if (!matrix.IsSequence() || matrix.size() != found.size()) {
    fail(matrix, "covariance.matrix is not square; give a row for each of the " +
                     std::to_string(found.size()) + " names");
  }
  for (std::size_t i = 0; i < found.size(); ++i) {
    const std::vector<double> values = numbers(matrix[i], "covariance.matrix", found.size());
    for (std::size_t j = 0; j < found.size(); ++j) covariance(found[i], found[j]) = values[j];
  }
  for (const int i : found) {
    const std::string& name = rows.names[static_cast<std::size_t>(i)];
    if (covariance(i, i) < 0) {
      fail(matrix, "covariance.matrix has the negative variance " + short_text(covariance(i, i)) +
                       " of " + name + "; 0 means exact");
    }
    const double sigma = std::sqrt(covariance(i, i));
    if (sigma > rows.largest_sigma[static_cast<std::size_t>(i)]) {
      fail(matrix, "by covariance.matrix the sigma of " + name + " is " + short_text(sigma) +
                       "; the square of one standard deviation, in " + rows.unit + ", is needed");
    }
  }
  check_positive(matrix, rows, covariance);
}

// Checks the correlations: the variances of f and of the line delay are 17 orders apart.
void EstimateReader::check_positive(const YAML::Node& matrix, const EstimateRows& rows,
                                    const Eigen::MatrixXd& covariance) const {
  Eigen::MatrixXd correlation = covariance;
  for (int i = 0; i < correlation.rows(); ++i) {
    for (int j = 0; j < correlation.cols(); ++j) {
      const double scale = std::sqrt(covariance(i, i)) * std::sqrt(covariance(j, j));
      if (scale > 0) {
        correlation(i, j) /= scale;
      } else if (correlation(i, j) != 0) {
        fail(matrix, "covariance.matrix ties " + rows.names[static_cast<std::size_t>(i)] + " to " +
                         rows.names[static_cast<std::size_t>(j)] +
                         ", one of which has no variance; give 0 here or a variance there");
      }
    }
  }
  if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > 1e-9) {
    fail(matrix, "covariance.matrix is not symmetric; give both halves");
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(correlation, Eigen::EigenvaluesOnly);
  if (solver.eigenvalues().minCoeff() < -1e-9) {
    fail(matrix, "covariance.matrix is not positive semidefinite; no data has such a covariance");
  }
}

void EstimateReader::check_sigma(const YAML::Node& node, const std::string& name, double sigma,
                                 double variance) const {
  const double expected = std::sqrt(variance);
  if (std::abs(sigma - expected) <= 1e-3 * expected) return;
  fail(node, "sigma of " + name + " is " + short_text(sigma) + ", but by its covariance it is " +
                 short_text(expected) + "; make them agree, or leave one out");
}

}  // namespace alidade
