#include "edge_app/verify/model_check.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <optional>

#include "core/calibration/chance.h"
#include "edge_app/verify/pair_equations.h"
#include "edge_app/verify/pair_rows.h"

namespace alidade {
namespace {

constexpr std::size_t kMostFound = 4;

std::vector<std::size_t> without(const std::vector<std::size_t>& all, std::size_t one) {
  std::vector<std::size_t> out;
  std::copy_if(all.begin(), all.end(), std::back_inserter(out),
               [one](std::size_t each) { return each != one; });
  return out;
}

// The chi-square that is exceeded with the chance of log_limit.
double chi_square_limit(int freedom, double log_limit) {
  double low = 0;
  double high = 1000;
  for (int step = 0; step < 60; ++step) {
    const double middle = (low + high) / 2;
    (internal::log_chance(middle, freedom) > log_limit ? low : high) = middle;
  }
  return high;
}

// As if places erred on their own: what a departure does to all places of a pair alike scatters,
// too, and would count against the departure itself where departures are compared.
double full_chi_square(const DepartureTest& test) { return test.chi_square * test.scatter; }

bool contains(const std::vector<Departure>& all, Departure one) {
  return std::find(all.begin(), all.end(), one) != all.end();
}

// One after the other, each the least probable beside those before.
std::vector<std::size_t> found_in_turn(double log_limit, const std::vector<Departure>& not_judged,
                                       PairEquations* equations) {
  std::vector<std::size_t> found;
  while (found.size() < kMostFound) {
    std::optional<std::size_t> worst;
    double least = 0;
    for (std::size_t d = 0; d < equations->departures().size(); ++d) {
      if (std::find(found.begin(), found.end(), d) != found.end()) continue;
      if (contains(not_judged, equations->departures()[d].departure)) continue;
      const DepartureTest test = equations->test(d);
      if (!(test.log_chance < log_limit)) continue;
      const double log_chance = internal::log_chance(full_chi_square(test), test.freedom);
      if (!(log_chance < least)) continue;
      least = log_chance;
      worst = d;
    }
    if (!worst) break;
    found.push_back(*worst);
    equations->set_free(found);
  }
  return found;
}

// Of those, the ones that explain most for their number: what was found first may have stood for
// what came later. Each has to explain as much as would be improbable if it were not there.
std::vector<std::size_t> best_of(const std::vector<std::size_t>& found, double log_limit,
                                 PairEquations* equations) {
  equations->set_free({});
  std::vector<double> price;
  price.reserve(found.size());
  for (const std::size_t d : found)
    price.push_back(chi_square_limit(std::max(1, equations->test(d).freedom), log_limit));
  std::vector<std::size_t> best = found;
  double most = -std::numeric_limits<double>::infinity();
  for (unsigned subset = 1; subset < 1U << found.size(); ++subset) {
    std::vector<std::size_t> chosen;
    double gain = 0;
    for (std::size_t k = 0; k < found.size(); ++k) {
      if ((subset >> k & 1U) == 0) continue;
      chosen.push_back(found[k]);
      gain -= price[k];
    }
    gain += full_chi_square(equations->test(chosen));
    if (gain <= most) continue;
    most = gain;
    best = chosen;
  }
  return best;
}

// Those that remain improbable beside the others. As jitter and noise may have any size, they can
// explain some of what was found before them.
std::vector<std::size_t> still_found(std::vector<std::size_t> found, double log_limit,
                                     PairEquations* equations) {
  while (!found.empty()) {
    std::optional<std::size_t> weakest;
    double most = log_limit;
    for (const std::size_t d : found) {
      equations->set_free(without(found, d));
      const double log_chance = equations->test(d).log_chance;
      if (log_chance < most) continue;
      most = log_chance;
      weakest = d;
    }
    if (!weakest) break;
    found = without(found, *weakest);
  }
  return found;
}

}  // namespace

ModelCheckResult check_model(const std::vector<SeenFrame>& frames,
                             const std::vector<PlacePair>& pairs, const Calibration& calibration,
                             const TelemetryError& telemetry_error, double motion_inflation,
                             double log_limit, const std::vector<Departure>& not_judged) {
  ModelCheckResult out;
  std::vector<PairRows> rows = pair_rows(frames, pairs, OrientationFrom::kAllSamples);
  if (rows.empty()) return out;
  rows = pair_rows_at(
      PairEquations(frames, rows, calibration, telemetry_error, motion_inflation).frame_errors(),
      frames, pairs);
  PairEquations equations(frames, rows, calibration, telemetry_error, motion_inflation);
  equations.sum();
  out.pairs = static_cast<int>(rows.size());
  for (const PairRows& pair : rows) out.places += static_cast<int>(pair.places.size());
  out.noise_ratio = equations.noise_ratio();
  for (std::size_t d = 0; d < equations.departures().size(); ++d) {
    out.tests.push_back(equations.test(d));
    if (contains(not_judged, out.tests.back().departure)) out.tests.back().freedom = 0;
  }
  std::vector<std::size_t> found = found_in_turn(log_limit, not_judged, &equations);
  const bool has_noise =
      std::any_of(found.begin(), found.end(), [&](std::size_t d) { return equations.is_noise(d); });
  if (found.size() > 1)
    found = has_noise ? still_found(found, log_limit, &equations)
                      : best_of(found, log_limit, &equations);
  for (const std::size_t d : found) {
    equations.set_free(without(found, d));
    out.found.push_back(equations.test(d));
  }
  return out;
}

}  // namespace alidade
