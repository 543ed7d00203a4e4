#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "core/calibration/calibration_text.h"
#include "core/calibration/number_text.h"
#include "core/calibration/strict_yaml.h"

namespace alidade {

namespace {

struct Range {
  double least;
  double most;
  const char* hint;
};

// The range of a plausible value in the right unit. A value outside is more likely in another unit.
Range plausible_range(Parameter parameter) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return {1, 1e7, "pixels, more than 0"};
    case Parameter::kAspect:
      return {0.5, 2, "a ratio near 1"};
    case Parameter::kLineDelay:
      return {-1e-3, 1e-3, "seconds a row; 14 microseconds are 14e-6"};
    case Parameter::kPanScale:
    case Parameter::kTiltScale:
      return {0.5, 2, "measured angle / true angle, near 1"};
    case Parameter::kClockOffset:
      return {-10, 10, "seconds; 84 milliseconds are 84e-3"};
    default:
      return {-1e12, 1e12, "a plain number"};
  }
}

// Of one standard deviation, in the unit of the value.
double largest_sigma(Parameter parameter) {
  switch (parameter) {
    case Parameter::kPanAxis0:
    case Parameter::kPanAxis1:
    case Parameter::kTiltAxis0:
    case Parameter::kTiltAxis1:
      return 1;
    default: {
      const Range range = plausible_range(parameter);
      return range.most - range.least;
    }
  }
}

class Reader {
 public:
  Reader(YAML::Node root, std::string name) : root_(std::move(root)), name_(std::move(name)) {}

  Calibration read() {
    if (!root_.IsMap()) fail(root_, "not a calibration; start with `format: 1`");
    check_keys(root_,
               {"format", "image", "focal_length", "aspect", "radial_distortion", "line_delay",
                "pan_axis", "tilt_axis", "pan_scale", "tilt_scale", "clock_offset", "zoom",
                "covariance", "quality", "landmarks"},
               "");
    const YAML::Node format = required(root_, "format", "");
    if (number(format, "format") != 1) {
      fail(format, "format " + format.Scalar() + " is not known; this version reads format 1");
    }
    const YAML::Node image = required(root_, "image", "");
    check_keys(image, {"width", "height"}, "image.");
    calibration_.camera.width = pixels(image, "width");
    calibration_.camera.height = pixels(image, "height");

    calibration_.camera.focal_length = scalar(Parameter::kFocalLength);
    if (calibration_.camera.focal_length < 0.1 * calibration_.camera.width) {
      fail(root_["focal_length"]["value"],
           "focal_length " + short_text(calibration_.camera.focal_length) +
               " sees more than 157 degrees across the image; give pixels, not millimetres");
    }
    if (root_["aspect"]) calibration_.camera.aspect = scalar(Parameter::kAspect);
    calibration_.camera.radial_distortion = scalar(Parameter::kRadialDistortion);
    calibration_.line_delay = scalar(Parameter::kLineDelay);
    calibration_.mechanics.pan_axis =
        axis("pan_axis", calibration_.mechanics.pan_axis, Parameter::kPanAxis0);
    calibration_.mechanics.tilt_axis =
        axis("tilt_axis", calibration_.mechanics.tilt_axis, Parameter::kTiltAxis0);
    calibration_.mechanics.pan_scale = scalar(Parameter::kPanScale);
    calibration_.mechanics.tilt_scale = scalar(Parameter::kTiltScale);
    calibration_.clock_offset = scalar(Parameter::kClockOffset);
    if (root_["zoom"]) calibration_.zoom = number(root_["zoom"], "zoom");
    if (root_["quality"] && !root_["quality"].IsMap()) {
      fail(root_["quality"], "quality is not a map; write `quality: {name: value, ...}`");
    }
    if (root_["landmarks"] && !root_["landmarks"].IsScalar()) {
      fail(root_["landmarks"], "landmarks is not a file name; write `landmarks: map.bin`");
    }
    covariance();
    return calibration_;
  }

 private:
  [[noreturn]] void fail(const YAML::Node& node, const std::string& text) const {
    throw YamlError(name_ + ":" + std::to_string(line_of(node).value_or(1)) + ": " + text);
  }

  void check_keys(const YAML::Node& map, const std::vector<std::string>& known,
                  const std::string& prefix) const {
    const auto found = find_faulty_key(map, known);
    if (!found) return;
    switch (found->fault) {
      case KeyFault::kNoWord:
        fail(found->key, "a key is not a word; write `name: value`");
      case KeyFault::kDoubled:
        fail(found->key, prefix + found->key.Scalar() + " stands here a second time; keep one");
      case KeyFault::kUnknown:
        fail(found->key,
             "unknown key " + prefix + found->key.Scalar() + "; known are " + join(known));
    }
  }

  YAML::Node required(const YAML::Node& map, const char* key, const std::string& prefix) const {
    if (!map.IsMap()) {
      fail(map, prefix.substr(0, prefix.size() - 1) + " is not a map; write {" + key + ": ...}");
    }
    const YAML::Node node = map[key];
    if (!node) fail(map, prefix + key + " is missing; add it");
    return node;
  }

  double number(const YAML::Node& node, const std::string& name) const {
    if (node.IsScalar()) {
      const std::optional<double> value = number_of(node.Scalar());
      if (value) return *value;
      fail(node, name + " is \"" + node.Scalar() + "\"; a finite number is needed");
    }
    fail(node, name + " is not a single value; a finite number is needed");
  }

  int pixels(const YAML::Node& image, const char* key) const {
    const std::string name = std::string("image.") + key;
    const YAML::Node node = required(image, key, "image.");
    const double value = number(node, name);
    if (value < 1 || value > 1e5 || value != std::floor(value)) {
      fail(node, name + " is " + node.Scalar() + "; a whole number of pixels from 1 to 100000");
    }
    return static_cast<int>(value);
  }

  std::vector<double> numbers(const YAML::Node& node, const std::string& name,
                              std::size_t count) const {
    if (!node.IsSequence() || node.size() != count) {
      fail(node, name + " is not a list of " + std::to_string(count) + " numbers; write [x, ...]");
    }
    std::vector<double> values;
    for (const YAML::Node& item : node) values.push_back(number(item, name));
    return values;
  }

  void set_sigma(const YAML::Node& node, const std::string& name, double sigma,
                 Parameter parameter) {
    if (sigma < 0 || sigma > largest_sigma(parameter)) {
      fail(node,
           name + ".sigma is " + short_text(sigma) +
               "; one standard deviation, in the unit of the value (axes: radians), is needed");
    }
    sigmas_.push_back({parameter, sigma, node});
    calibration_.covariance(index(parameter), index(parameter)) = sigma * sigma;
  }

  double scalar(Parameter parameter) {
    const std::string name = to_string(parameter);
    const YAML::Node entry = required(root_, name.c_str(), "");
    check_entry(entry, name);
    const YAML::Node node = required(entry, "value", name + ".");
    const double value = number(node, name);
    const Range range = plausible_range(parameter);
    if (value < range.least || value > range.most) {
      fail(node, name + " is " + node.Scalar() + "; give " + range.hint);
    }
    if (entry["sigma"]) {
      set_sigma(entry["sigma"], name, number(entry["sigma"], name + ".sigma"), parameter);
    }
    return value;
  }

  Vector3<double> axis(const std::string& name, const Vector3<double>& nominal, Parameter first) {
    const YAML::Node entry = required(root_, name.c_str(), "");
    check_entry(entry, name);
    const YAML::Node node = required(entry, "value", name + ".");
    const std::vector<double> values = numbers(node, name, 3);
    Vector3<double> axis(values[0], values[1], values[2]);
    const double norm = axis.norm();
    if (std::abs(norm - 1) > 1e-6) {
      fail(node, name + " has length " + short_text(norm) + "; a unit vector is needed");
    }
    if (axis.dot(nominal) < 0.5 * norm) {
      fail(node, name + " is more than 60 degrees from its nominal [" + short_text(nominal.x()) +
                     ", " + short_text(nominal.y()) + ", " + short_text(nominal.z()) +
                     "]; base axes are forward, right, down");
    }
    // What a person rounded is made a unit vector; what a program wrote stays as it is, bit by bit.
    if (std::abs(norm - 1) > 1e-15) axis /= norm;
    if (entry["sigma"]) {
      const YAML::Node sigma = entry["sigma"];
      const std::vector<double> pair = numbers(sigma, name + ".sigma", 2);
      for (int i = 0; i < 2; ++i) {
        set_sigma(sigma, name, pair[static_cast<std::size_t>(i)],
                  static_cast<Parameter>(index(first) + i));
      }
    }
    return axis;
  }

  void check_entry(const YAML::Node& entry, const std::string& name) const {
    if (!entry.IsMap()) fail(entry, name + " is not a map; write {value: ..., sigma: ...}");
    check_keys(entry, {"value", "sigma"}, name + ".");
  }

  void covariance() {
    const YAML::Node entry = root_["covariance"];
    if (!entry) return;
    if (!entry.IsMap()) fail(entry, "covariance is not a map; write {names: ..., matrix: ...}");
    check_keys(entry, {"names", "matrix"}, "covariance.");
    const std::vector<int> rows = covariance_rows(required(entry, "names", "covariance."));
    const YAML::Node matrix = required(entry, "matrix", "covariance.");
    if (!matrix.IsSequence() || matrix.size() != rows.size()) {
      fail(matrix, "covariance.matrix is not square; give a row for each of the " +
                       std::to_string(rows.size()) + " names");
    }
    ParameterCovariance<double>& cov = calibration_.covariance;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      const std::vector<double> values = numbers(matrix[i], "covariance.matrix", rows.size());
      for (std::size_t j = 0; j < rows.size(); ++j) cov(rows[i], rows[j]) = values[j];
    }
    for (const int i : rows) {
      if (cov(i, i) < 0) {
        fail(matrix, std::string("covariance.matrix has the negative variance ") +
                         short_text(cov(i, i)) + " of " + to_string(static_cast<Parameter>(i)) +
                         "; 0 stands for exact");
      }
      const auto parameter = static_cast<Parameter>(i);
      if (std::sqrt(cov(i, i)) > largest_sigma(parameter)) {
        fail(matrix, std::string("covariance.matrix says that sigma of ") + to_string(parameter) +
                         " is " + short_text(std::sqrt(cov(i, i))) +
                         "; the square of one standard deviation, in the unit of the value (axes: "
                         "radians), is needed");
      }
    }
    check_positive(matrix);
    for (const Sigma& sigma : sigmas_) {
      const double expected = std::sqrt(cov(index(sigma.parameter), index(sigma.parameter)));
      if (std::abs(sigma.value - expected) > 1e-3 * expected) {
        fail(sigma.node, std::string("sigma of ") + to_string(sigma.parameter) + " is " +
                             short_text(sigma.value) + ", its covariance says " +
                             short_text(expected) + "; make them agree, or leave one out");
      }
    }
  }

  std::vector<int> covariance_rows(const YAML::Node& names) const {
    if (!names.IsSequence()) fail(names, "covariance.names is not a list; write [name, ...]");
    std::vector<int> rows;
    for (const YAML::Node& name : names) {
      int row = 0;
      while (row < kParameterCount &&
             !(name.IsScalar() && name.Scalar() == to_string(static_cast<Parameter>(row)))) {
        ++row;
      }
      if (row == kParameterCount) {
        fail(name,
             "covariance.names has an unknown name; known are focal_length, aspect, ..., "
             "pan_axis_0, pan_axis_1, ..., clock_offset");
      }
      for (const int other : rows) {
        if (other == row) fail(name, "covariance.names has " + name.Scalar() + " twice; keep one");
      }
      rows.push_back(row);
    }
    return rows;
  }

  // Judged on the correlations: the variances of f and of the line delay are 17 orders apart.
  void check_positive(const YAML::Node& matrix) {
    ParameterCovariance<double> correlation = calibration_.covariance;
    for (int i = 0; i < kParameterCount; ++i) {
      for (int j = 0; j < kParameterCount; ++j) {
        const double scale =
            std::sqrt(calibration_.covariance(i, i)) * std::sqrt(calibration_.covariance(j, j));
        if (scale > 0) {
          correlation(i, j) /= scale;
        } else if (correlation(i, j) != 0) {
          fail(matrix, std::string("covariance.matrix ties ") +
                           to_string(static_cast<Parameter>(i)) + " to " +
                           to_string(static_cast<Parameter>(j)) +
                           ", one of which has no variance; give 0 here or a variance there");
        }
      }
    }
    if ((correlation - correlation.transpose()).cwiseAbs().maxCoeff() > 1e-9) {
      fail(matrix, "covariance.matrix is not symmetric; give both halves");
    }
    const Eigen::SelfAdjointEigenSolver<ParameterCovariance<double>> solver(correlation,
                                                                            Eigen::EigenvaluesOnly);
    if (solver.eigenvalues().minCoeff() < -1e-9) {
      fail(matrix, "covariance.matrix is not positive semidefinite; no data has such a covariance");
    }
  }

  struct Sigma {
    Parameter parameter;
    double value;
    YAML::Node node;
  };

  const YAML::Node root_;
  const std::string name_;
  Calibration calibration_;
  std::vector<Sigma> sigmas_;
};

}  // namespace

bool parse_calibration(const std::string& text, const std::string& name, Calibration* calibration,
                       std::string* error) {
  return read_yaml(
      text, name, {"", "; valid YAML is needed"},
      [&](const YAML::Node& root) { *calibration = Reader(root, name).read(); }, error);
}

}  // namespace alidade
