#include "test/accuracy/calibration_comparison.h"

#include <fmt/format.h>

#include <boost/math/distributions/chi_squared.hpp>
#include <cmath>
#include <filesystem>
#include <optional>

#include "core/model/direction.h"

namespace alidade::test {
namespace {

struct Scalar {
  Parameter parameter;
  std::optional<StatedValue> CalibrationValues::*member;
  double unit;
  const char* unit_name;
};
// Shown by the two components that are zero in a nominal axis.
struct Axis {
  Parameter first;
  std::optional<Vector3<double>> CalibrationValues::*member;
  const char* name;
  std::array<int, 2> shown;
};

// The focal length's errors are relative, in units of 1e-6.
constexpr double kPartsPerMillion = 1e-6;
constexpr std::array<Scalar, 7> kScalars = {
    {{Parameter::kFocalLength, &CalibrationValues::focal_length, 1, "px"},
     {Parameter::kAspect, &CalibrationValues::aspect, 1, "1"},
     {Parameter::kRadialDistortion, &CalibrationValues::radial_distortion, 1, "1"},
     {Parameter::kLineDelay, &CalibrationValues::line_delay, 1e-9, "ns/row"},
     {Parameter::kClockOffset, &CalibrationValues::clock_offset, 1e-3, "ms"},
     {Parameter::kPanScale, &CalibrationValues::pan_scale, 1, "1"},
     {Parameter::kTiltScale, &CalibrationValues::tilt_scale, 1, "1"}}};
constexpr std::array<Axis, 2> kAxes = {
    {{Parameter::kPanAxis0, &CalibrationValues::pan_axis, "pan_axis", {{0, 1}}},
     {Parameter::kTiltAxis0, &CalibrationValues::tilt_axis, "tilt_axis", {{0, 2}}}}};
static_assert(kScalars.size() + kAxes.size() == CalibrationComparison::kQuantities);

std::optional<double> limit_of(const CalibrationLimits& limits, Parameter parameter, double truth) {
  switch (parameter) {
    case Parameter::kFocalLength:
      return limits.focal_length_rel ? std::optional<double>(*limits.focal_length_rel * truth)
                                     : std::nullopt;
    case Parameter::kRadialDistortion:
      return limits.radial_distortion;
    case Parameter::kLineDelay:
      return limits.line_delay_s;
    case Parameter::kClockOffset:
      return limits.clock_offset_s;
    default:
      return std::nullopt;
  }
}

std::string number(const std::optional<double>& value, const char* format = "{:.7g}") {
  return value ? fmt::format(fmt::runtime(format), *value) : "-";
}

double mean(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum / static_cast<double>(values.size());
}

double mean_square(const std::vector<double>& values) {
  double sum = 0;
  for (const double value : values) sum += value * value;
  return sum / static_cast<double>(values.size());
}

// 95 % of chi^2_n / n.
std::pair<double, double> chance_interval(double n) {
  const boost::math::chi_squared distribution(n);
  return {boost::math::quantile(distribution, 0.025) / n,
          boost::math::quantile(distribution, 0.975) / n};
}

// "1.02 [0.72, 1.28]", marked if outside; '-' without values.
std::string judged(const std::vector<double>& values, double statistic, double degrees, bool root) {
  if (values.empty()) return "-";
  auto [low, high] = chance_interval(degrees * static_cast<double>(values.size()));
  if (root) {
    low = std::sqrt(low);
    high = std::sqrt(high);
  }
  return fmt::format("{:.3g} [{:.2f}, {:.2f}]{}", statistic, low, high,
                     statistic < low    ? " below"
                     : statistic > high ? " ABOVE"
                                        : "");
}

}  // namespace

bool load_known_values(const std::string& directory, ComparedRun* run, std::string* error) {
  const std::filesystem::path path(directory);
  run->name = directory;
  return load_values((path / "truth.yaml").string(), &run->truth, error) &&
         load_values((path / "peer.yaml").string(), &run->peer, error) &&
         load_limits((path / "limit.yaml").string(), &run->limits, error);
}

std::string CalibrationComparison::add(const ComparedRun& known, const Calibration& c) {
  ++runs_;
  std::string text =
      fmt::format("{}\n  {:<18}{:>16}{:>11}{:>16}{:>16}{:>11}{:>11}{:>11}{:>11}\n", known.name, "",
                  "estimate", "sigma", "truth", "peer", "sigma", "error", "peer's", "limit");
  for (std::size_t i = 0; i < kScalars.size(); ++i) {
    const Scalar& scalar = kScalars[i];
    const double variance = c.covariance(index(scalar.parameter), index(scalar.parameter));
    const double estimate = parameter_value(c, scalar.parameter);
    const std::optional<StatedValue>& truth = known.truth.*scalar.member;
    const std::optional<StatedValue>& peer = known.peer.*scalar.member;
    std::optional<double> limit;
    std::optional<double> error;
    std::optional<double> peer_error;
    if (truth) {
      limit = limit_of(known.limits, scalar.parameter, truth->value);
      const double shown = scalar.parameter == Parameter::kFocalLength
                               ? truth->value * kPartsPerMillion
                               : scalar.unit;
      const auto tally = [&](double e, double square_sigma, Tally* to) {
        to->errors.push_back(std::abs(e) / shown);
        if (limit) to->ratios.push_back(e / *limit);
        if (square_sigma > 0) to->nees.push_back(e * e / square_sigma);
      };
      error = estimate - truth->value;
      // An exact parameter was not estimated.
      if (variance > 0) tally(*error, variance, &tallies_[i].ours);
      if (peer) {
        peer_error = peer->value - truth->value;
        tally(*peer_error, peer->sigma ? *peer->sigma * *peer->sigma : 0, &tallies_[i].peer);
      }
    }
    const auto in_unit = [&scalar](const std::optional<double>& value, const char* format) {
      return number(value ? std::optional<double>(*value / scalar.unit) : std::nullopt, format);
    };
    const auto value = [](const std::optional<StatedValue>& stated) {
      return stated ? std::optional<double>(stated->value) : std::nullopt;
    };
    text +=
        fmt::format("  {:<18}{:>16}{:>11}{:>16}{:>16}{:>11}{:>11}{:>11}{:>11}  {}\n",
                    to_string(scalar.parameter), in_unit(estimate, "{:.7g}"),
                    variance > 0 ? in_unit(std::sqrt(variance), "{:.2g}") : "exact",
                    in_unit(value(truth), "{:.7g}"), in_unit(value(peer), "{:.7g}"),
                    in_unit(peer ? peer->sigma : std::nullopt, "{:.2g}"), in_unit(error, "{:.2g}"),
                    in_unit(peer_error, "{:.2g}"), in_unit(limit, "{:.2g}"), scalar.unit_name);
  }
  for (std::size_t i = 0; i < kAxes.size(); ++i) {
    const Axis& axis = kAxes[i];
    const Vector3<double>& estimate =
        axis.first == Parameter::kPanAxis0 ? c.mechanics.pan_axis : c.mechanics.tilt_axis;
    const Matrix2<double> cov = c.covariance.block<2, 2>(index(axis.first), index(axis.first));
    const std::optional<Vector3<double>>& truth = known.truth.*axis.member;
    const std::optional<Vector3<double>>& peer = known.peer.*axis.member;
    Pair& tally = tallies_[kScalars.size() + i];
    std::optional<double> error;
    std::optional<double> peer_error;
    if (truth) {
      const Vector2<double> e = direction_minus<double>(*truth, estimate);
      error = 1e3 * e.norm();
      tally.ours.errors.push_back(*error);
      const double determinant = cov.determinant();
      if (determinant > 0) tally.ours.nees.push_back(e.dot(cov.inverse() * e) / 2);
      if (peer) {
        peer_error = 1e3 * direction_minus<double>(*truth, *peer).norm();
        tally.peer.errors.push_back(*peer_error);
      }
    }
    const auto shown = [&axis](const Vector3<double>& d) {
      return fmt::format("{:.2f}, {:.2f}", 1e3 * d[axis.shown[0]], 1e3 * d[axis.shown[1]]);
    };
    text +=
        fmt::format("  {:<18}{:>16}{:>11}{:>16}{:>16}{:>11}{:>11}{:>11}{:>11}  mrad\n", axis.name,
                    shown(estimate), fmt::format("{:.2g}", 1e3 * std::sqrt(cov.trace())),
                    truth ? shown(*truth) : "-", peer ? shown(*peer) : "-", "-",
                    number(error, "{:.2g}"), number(peer_error, "{:.2g}"), "-");
  }
  return text + "\n";
}

std::string CalibrationComparison::statistics() const {
  std::string text = fmt::format("{} recordings: {} calibrated, {} failed\n",
                                 runs_ + failures_.size(), runs_, failures_.size());
  for (const std::string& failure : failures_) text += "  failed: " + failure + "\n";
  if (runs_ == 0) return text;
  text += fmt::format("\n{:<26}{:<6}{:>5}{:>14}  {:<26}{}\n", "", "", "runs", "mean |error|",
                      "RMS error / limit (95 %)", "ANEES (95 %)");
  for (std::size_t i = 0; i < kQuantities; ++i) {
    const bool is_axis = i >= kScalars.size();
    const double degrees = is_axis ? 2 : 1;
    const std::string name =
        is_axis ? kAxes[i - kScalars.size()].name : to_string(kScalars[i].parameter);
    const std::string unit = is_axis ? "mrad"
                             : kScalars[i].parameter == Parameter::kFocalLength
                                 ? "1e-6 of it"
                                 : kScalars[i].unit_name;
    for (const auto& [who, tally] :
         {std::pair("ours", &tallies_[i].ours), std::pair("peer", &tallies_[i].peer)}) {
      if (tally->errors.empty()) continue;
      text += fmt::format(
          "{:<26}{:<6}{:>5}{:>14}  {:<26}{}\n", name + ", " + unit, who, tally->errors.size(),
          number(mean(tally->errors), "{:.3g}"),
          judged(tally->ratios, tally->ratios.empty() ? 0 : std::sqrt(mean_square(tally->ratios)),
                 1, true),
          judged(tally->nees, tally->nees.empty() ? 0 : mean(tally->nees), degrees, false));
    }
  }
  return text;
}

}  // namespace alidade::test
