#include "core/calibration/calibration_file.h"

#include <yaml-cpp/yaml.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iomanip>
#include <locale>
#include <optional>
#include <set>
#include <sstream>
#include <vector>

#include "core/calibration/atomic_file.h"
#include "core/calibration/one_line.h"

namespace alidade {

namespace {

// What is wrong, and in which line, from 1. Never leaves this file.
struct Problem {
  int line;
  std::string text;
};

[[noreturn]] void fail(const YAML::Node& node, const std::string& text) {
  throw Problem{std::max(node.Mark().line, 0) + 1, text};
}

// Text and number are converted in the classic locale, whatever the program's.
std::string number_text(double value, int digits) {
  std::ostringstream stream;
  stream.imbue(std::locale::classic());
  stream << std::setprecision(digits) << value;
  return stream.str();
}

std::optional<double> number_of(const std::string& text) {
  std::istringstream stream(text);
  stream.imbue(std::locale::classic());
  double value = 0;
  if (stream >> value && stream.peek() == std::istringstream::traits_type::eof() &&
      std::isfinite(value)) {
    return value;
  }
  return std::nullopt;
}

// The shortest text that reads back as the same bits: 55.4 rather than 55.399999999999999.
std::string exact_text(double value) {
  for (int digits = 15; digits < 17; ++digits) {
    std::string text = number_text(value, digits);
    if (number_of(text) == value) return text;
  }
  return number_text(value, 17);
}

// For messages: as many digits as a person would write.
std::string short_text(double value) { return number_text(value, 6); }

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
  explicit Reader(const YAML::Node& root) : root_(root) {}

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
  static void check_keys(const YAML::Node& map, std::initializer_list<const char*> known,
                         const std::string& prefix) {
    std::set<std::string> seen;
    for (const auto& entry : map) {
      if (!entry.first.IsScalar()) fail(entry.first, "a key is not a word; write `name: value`");
      const std::string& key = entry.first.Scalar();
      if (!seen.insert(key).second) {
        fail(entry.first, prefix + key + " stands here a second time; keep one");
      }
      bool is_known = false;
      std::string names;
      for (const char* name : known) {
        is_known = is_known || key == name;
        if (!names.empty()) names += ", ";
        names += name;
      }
      if (!is_known) fail(entry.first, "unknown key " + prefix + key + "; known are " + names);
    }
  }

  static YAML::Node required(const YAML::Node& map, const char* key, const std::string& prefix) {
    if (!map.IsMap()) {
      fail(map, prefix.substr(0, prefix.size() - 1) + " is not a map; write {" + key + ": ...}");
    }
    const YAML::Node node = map[key];
    if (!node) fail(map, prefix + key + " is missing; add it");
    return node;
  }

  static double number(const YAML::Node& node, const std::string& name) {
    if (node.IsScalar()) {
      const std::optional<double> value = number_of(node.Scalar());
      if (value) return *value;
      fail(node, name + " is \"" + node.Scalar() + "\"; a finite number is needed");
    }
    fail(node, name + " is not a single value; a finite number is needed");
  }

  static int pixels(const YAML::Node& image, const char* key) {
    const std::string name = std::string("image.") + key;
    const YAML::Node node = required(image, key, "image.");
    const double value = number(node, name);
    if (value < 1 || value > 1e5 || value != std::floor(value)) {
      fail(node, name + " is " + node.Scalar() + "; a whole number of pixels from 1 to 100000");
    }
    return static_cast<int>(value);
  }

  static std::vector<double> numbers(const YAML::Node& node, const std::string& name,
                                     std::size_t count) {
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

  static void check_entry(const YAML::Node& entry, const std::string& name) {
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

  static std::vector<int> covariance_rows(const YAML::Node& names) {
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
  Calibration calibration_;
  std::vector<Sigma> sigmas_;
};

}  // namespace

bool parse_calibration(const std::string& text, const std::string& name, Calibration* calibration,
                       std::string* error) {
  try {
    *calibration = Reader(YAML::Load(text)).read();
    return true;
  } catch (const Problem& problem) {
    *error = one_line(name + ":" + std::to_string(problem.line) + ": " + problem.text);
  } catch (const YAML::Exception& exception) {
    *error = one_line(name + ":" + std::to_string(std::max(exception.mark.line, 0) + 1) + ": " +
                      exception.msg + "; valid YAML is needed");
  }
  return false;
}

namespace {

void write_quality(const CalibrationNotes& notes, YAML::Emitter* out) {
  const CalibrationQuality& quality = *notes.quality;
  const auto number = [out](const char* name, double value, const char* comment) {
    *out << YAML::Key << name << YAML::Value << short_text(value) << YAML::Comment(comment);
  };
  const auto count = [out](const char* name, int value) {
    *out << YAML::Key << name << YAML::Value << value;
  };
  const auto texts = [out](const char* name, const std::vector<std::string>& lines) {
    if (lines.empty()) return;
    *out << YAML::Key << name << YAML::Value << YAML::BeginSeq;
    for (const std::string& line : lines) *out << YAML::DoubleQuoted << line;
    *out << YAML::EndSeq;
  };
  *out << YAML::Key << "quality" << YAML::Value << YAML::BeginMap;
  number("pixel_sigma_ratio", quality.pixel_sigma_ratio, "residuals / stated noise");
  number("repetition", quality.repetition, "observations of a landmark that count as one");
  number("telemetry_sigma_ratio", quality.telemetry_sigma_ratio, "residuals / assumed noise");
  number("mean_reprojection_error_px", quality.mean_reprojection_error_px, "px");
  number("motion_correlation", quality.motion_correlation, "image motion and telemetry");
  count("frames", quality.frames);
  count("observations", quality.observations);
  count("landmarks", quality.landmarks);
  count("telemetry", quality.telemetry);
  number("condition", quality.condition, "of the parameters' correlation matrix");
  *out << YAML::Key << "weakest_direction" << YAML::Value << YAML::DoubleQuoted
       << quality.weakest_direction;
  *out << YAML::Key << "priors" << YAML::Value << YAML::BeginMap;
  for (const auto& [name, prior] : notes.priors) {
    *out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
         << YAML::Value << exact_text(prior.value) << YAML::Key << "sigma" << YAML::Value
         << exact_text(prior.sigma) << YAML::EndMap;
  }
  *out << YAML::EndMap;
  texts("excluded", notes.excluded);
  texts("advice", quality.advice);
  *out << YAML::EndMap;
}

}  // namespace

std::string format_calibration(const Calibration& calibration, const CalibrationNotes& notes) {
  YAML::Emitter out;
  const auto& cov = calibration.covariance;
  const auto sigma = [&cov](Parameter parameter) {
    return exact_text(std::sqrt(cov(index(parameter), index(parameter))));
  };
  const auto write_scalar = [&](Parameter parameter, double value, const char* comment) {
    out << YAML::Key << to_string(parameter) << YAML::Value << YAML::Flow << YAML::BeginMap
        << YAML::Key << "value" << YAML::Value << exact_text(value) << YAML::Key << "sigma"
        << YAML::Value << sigma(parameter) << YAML::EndMap << YAML::Comment(comment);
  };
  const auto write_axis = [&](const char* name, const Vector3<double>& axis, Parameter first,
                              const char* comment) {
    out << YAML::Key << name << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "value"
        << YAML::Value << YAML::BeginSeq;
    for (int i = 0; i < 3; ++i) out << exact_text(axis[i]);
    out << YAML::EndSeq << YAML::Key << "sigma" << YAML::Value << YAML::BeginSeq << sigma(first)
        << sigma(static_cast<Parameter>(index(first) + 1)) << YAML::EndSeq << YAML::EndMap
        << YAML::Comment(comment);
  };

  out << YAML::BeginMap;
  out << YAML::Key << "format" << YAML::Value << 1;
  out << YAML::Key << "image" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << "width"
      << YAML::Value << std::to_string(calibration.camera.width) << YAML::Key << "height"
      << YAML::Value << std::to_string(calibration.camera.height) << YAML::EndMap;
  write_scalar(Parameter::kFocalLength, calibration.camera.focal_length, "px");
  write_scalar(Parameter::kAspect, calibration.camera.aspect, "f_v / f_u");
  write_scalar(Parameter::kRadialDistortion, calibration.camera.radial_distortion,
               "u = f x (1 + k |x|^2) + centre");
  write_scalar(Parameter::kLineDelay, calibration.line_delay, "s/row");
  write_axis("pan_axis", calibration.mechanics.pan_axis, Parameter::kPanAxis0,
             "unit vector in the base: forward, right, down; sigma in rad");
  write_axis("tilt_axis", calibration.mechanics.tilt_axis, Parameter::kTiltAxis0,
             "unit vector in the base; sigma in rad");
  write_scalar(Parameter::kPanScale, calibration.mechanics.pan_scale, "measured / true angle");
  write_scalar(Parameter::kTiltScale, calibration.mechanics.tilt_scale, "measured / true angle");
  write_scalar(Parameter::kClockOffset, calibration.clock_offset,
               "s; telemetry clock = image clock + clock_offset");
  if (calibration.zoom) out << YAML::Key << "zoom" << YAML::Value << exact_text(*calibration.zoom);
  if (!cov.isZero(0)) {
    out << YAML::Key << "covariance" << YAML::Value << YAML::BeginMap << YAML::Key << "names"
        << YAML::Value << YAML::Flow << YAML::BeginSeq;
    for (int i = 0; i < kParameterCount; ++i) out << to_string(static_cast<Parameter>(i));
    out << YAML::EndSeq << YAML::Key << "matrix" << YAML::Value << YAML::BeginSeq;
    for (int i = 0; i < kParameterCount; ++i) {
      out << YAML::Flow << YAML::BeginSeq;
      for (int j = 0; j < kParameterCount; ++j) out << exact_text(cov(i, j));
      out << YAML::EndSeq;
    }
    out << YAML::EndSeq << YAML::EndMap;
  }
  if (notes.quality) write_quality(notes, &out);
  if (!notes.landmarks.empty()) {
    out << YAML::Key << "landmarks" << YAML::Value << YAML::DoubleQuoted << notes.landmarks;
  }
  out << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

bool load_calibration(const std::string& path, Calibration* calibration, std::string* error) {
  std::string text;
  return read_file(path, &text, error) && parse_calibration(text, path, calibration, error);
}

bool save_calibration(const std::string& path, const Calibration& calibration, std::string* error) {
  return save_calibration(path, calibration, {}, error);
}

bool save_calibration(const std::string& path, const Calibration& calibration,
                      const CalibrationNotes& notes, std::string* error) {
  const std::string text = format_calibration(calibration, notes);
  Calibration as_read;
  if (!parse_calibration(text, "refused to write " + path, &as_read, error)) return false;
  return write_file_atomically(path, text, error);
}

}  // namespace alidade
