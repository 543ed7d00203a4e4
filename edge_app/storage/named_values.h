#pragma once
// NamedValues: what lens.yaml and plane.yaml have in common: values with names, a sigma for each,
// and one covariance of them all.
//   NAME: {value: ..., sigma: ...}
//   covariance: {names: [...], matrix: [[...]]}
// Read strictly (estimate_reader.h), so that errors are thrown as YamlError. Allocates.

#include <yaml-cpp/yaml.h>

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "core/calibration/estimate_reader.h"
#include "core/calibration/number_text.h"
#include "core/model/linear_algebra.h"

namespace alidade {

template <int kCount>
struct NamedValues {
  Matrix<double, kCount, 1> value = Matrix<double, kCount, 1>::Zero();
  Matrix<double, kCount, kCount> covariance = Matrix<double, kCount, kCount>::Zero();
};

template <std::size_t kCount>
using NamedValuesOf = NamedValues<static_cast<int>(kCount)>;

// range_of(i): of the plausible values. check(value) may refuse the values; it is called before the
// covariance is read, so that a wrong unit is named first. unit: of the values, in errors. what:
// completes "some of the ...".
template <std::size_t kCount, class RangeOf, class Check>
[[nodiscard]] NamedValuesOf<kCount> read_named_values(const EstimateReader& file,
                                                      const std::array<const char*, kCount>& names,
                                                      const RangeOf& range_of, const Check& check,
                                                      const std::string& unit,
                                                      const std::string& what) {
  NamedValuesOf<kCount> out;
  EstimateRows rows;
  rows.names.assign(names.begin(), names.end());
  rows.known = join(rows.names);
  rows.unit = unit;
  std::vector<double> sigmas;
  for (std::size_t i = 0; i < kCount; ++i) {
    const EstimateRange range = range_of(i);
    const YAML::Node entry = file.entry(names[i]);
    out.value[static_cast<Eigen::Index>(i)] = file.value(entry, names[i], range);
    rows.largest_sigma.push_back(range.most - range.least);
    const YAML::Node sigma = file.required(entry, "sigma", rows.names[i] + ".");
    sigmas.push_back(file.number(sigma, rows.names[i] + ".sigma"));
    if (sigmas.back() < 0 || sigmas.back() > rows.largest_sigma.back()) {
      file.fail(sigma, rows.names[i] + ".sigma is " + short_text(sigmas.back()) +
                           "; one standard deviation, in the unit of the value, is needed");
    }
  }
  check(out.value);
  const YAML::Node covariance = file.required(file.root(), "covariance", "");
  file.read_covariance(covariance, rows, out.covariance);
  if (covariance["names"].size() != kCount) {
    file.fail(covariance["names"],
              "covariance.names lacks some of the " + what + "; name all of " + rows.known);
  }
  for (std::size_t i = 0; i < kCount; ++i) {
    const auto at = static_cast<Eigen::Index>(i);
    file.check_sigma(file.root()[names[i]]["sigma"], rows.names[i], sigmas[i],
                     out.covariance(at, at));
  }
  return out;
}

// The key covariance with its map.
template <std::size_t kCount, class Covariance>
void write_covariance(const std::array<const char*, kCount>& names, const Covariance& covariance,
                      YAML::Emitter* out) {
  *out << YAML::Key << "covariance" << YAML::Value << YAML::BeginMap << YAML::Key << "names"
       << YAML::Value << YAML::Flow << YAML::BeginSeq;
  for (const char* name : names) *out << name;
  *out << YAML::EndSeq << YAML::Key << "matrix" << YAML::Value << YAML::BeginSeq;
  for (Eigen::Index i = 0; i < covariance.rows(); ++i) {
    *out << YAML::Flow << YAML::BeginSeq;
    for (Eigen::Index j = 0; j < covariance.cols(); ++j) *out << exact_text(covariance(i, j));
    *out << YAML::EndSeq;
  }
  *out << YAML::EndSeq << YAML::EndMap;
}

}  // namespace alidade
