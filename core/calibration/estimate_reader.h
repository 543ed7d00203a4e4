#pragma once
// EstimateReader: strict reader (strict_yaml.h) for what all files of estimates (calibration.yaml,
// lens.yaml, plane.yaml) have in common (plane.yaml has no image):
//   format: 1
//   image: {width: 1920, height: 1080}
//   NAME: {value: ..., sigma: ...}
//   covariance: {names: [...], matrix: [[...]]}
// Errors are thrown as YamlError with one line, `file:line: what; what would be right`. Allocates.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "core/calibration/strict_yaml.h"

namespace alidade {

// Plausible values in the right unit. A value outside of them is probably in another unit.
struct EstimateRange {
  double least;
  double most;
  const char* hint;  // completes "give ..."
};

// The rows of a covariance, and texts for errors.
struct EstimateRows {
  std::vector<std::string> names;
  std::vector<double> largest_sigma;  // as long as names; in the row's unit
  std::string known;                  // says which names are known
  std::string unit;                   // says which unit a sigma has
};

class EstimateReader {
 public:
  // file: its name in errors.
  EstimateReader(const YAML::Node& root, std::string file);

  [[noreturn]] void fail(const YAML::Node& node, const std::string& text) const;
  [[nodiscard]] const YAML::Node& root() const { return root_; }

  // Requires a map that has `format: 1` and only keys that are in `known`. `known` must contain
  // "format". kind completes "not ...".
  void check_top(const std::string& kind, const std::vector<std::string>& known) const;
  // Requires that `map`, which must be a map, has only keys of `known`, each once. prefix, here
  // and below: the path of the map in errors, with a dot at its end; empty for the root.
  void check_keys(const YAML::Node& map, const std::vector<std::string>& known,
                  const std::string& prefix) const;
  // The value of a key. Fails if `map` is no map or has no such key.
  [[nodiscard]] YAML::Node required(const YAML::Node& map, const char* key,
                                    const std::string& prefix) const;
  // name: the path in errors. Fails unless the node is a finite number (a list of `count` of them).
  [[nodiscard]] double number(const YAML::Node& node, const std::string& name) const;
  [[nodiscard]] std::vector<double> numbers(const YAML::Node& node, const std::string& name,
                                            std::size_t count) const;

  // px; whole numbers from 1 to 100000.
  void read_image(int* width, int* height) const;
  // The map {value, sigma} of this name.
  // keys: those that it may have.
  [[nodiscard]] YAML::Node entry(const std::string& name,
                                 const std::vector<std::string>& keys = {"value", "sigma"}) const;
  // The value of an entry, checked against the range.
  [[nodiscard]] double value(const YAML::Node& entry, const std::string& name,
                             const EstimateRange& range) const;

  // Fills the rows and columns that the file names; the others keep their values. covariance: as
  // many rows as `rows`. Requires a symmetric, positive semidefinite matrix and no sigma above its
  // largest_sigma.
  void read_covariance(const YAML::Node& entry, const EstimateRows& rows,
                       Eigen::Ref<Eigen::MatrixXd> covariance) const;
  // Requires that sigma agrees, to 0.1 %, with the variance in the covariance of the same file.
  void check_sigma(const YAML::Node& node, const std::string& name, double sigma,
                   double variance) const;

 private:
  [[nodiscard]] int pixels(const YAML::Node& image, const char* key) const;
  [[nodiscard]] std::vector<int> rows_of(const YAML::Node& names, const EstimateRows& rows) const;
  void check_positive(const YAML::Node& matrix, const EstimateRows& rows,
                      const Eigen::MatrixXd& covariance) const;

  const YAML::Node root_;
  const std::string file_;
};

}  // namespace alidade
