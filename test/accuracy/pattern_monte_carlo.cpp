#include "test/accuracy/pattern_monte_carlo.h"

#include <cmath>
#include <cstddef>
#include <iterator>

#include "test/accuracy/report.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

constexpr int kLineDelay = index(LensParameter::kLineDelay);
// What an estimator may lose against the bound.
constexpr double kLoss = 1.05;

// Another hand and another noise for each setting: their runs are put together.
std::uint64_t seed_of(std::uint64_t first_seed, std::size_t setting, std::size_t run) {
  return first_seed + 1000 * setting + run;
}

std::string within(double value, const Interval& interval) {
  return number(value) + " (" + number(interval.low) + " to " + number(interval.high) + ")";
}

struct Squares {
  std::vector<double> over_bound;  // e^T C^-1 e of a group
  std::vector<double> over_stated;
};

Squares squares_of(const std::vector<PatternRun>& runs, const LensGroup& group) {
  Squares squares;
  for (const PatternRun& run : runs) {
    if (run.status != PatternStatus::kOk) continue;
    squares.over_bound.push_back(squared_distance(run.error, run.bound, group));
    squares.over_stated.push_back(squared_distance(run.error, run.covariance, group));
  }
  return squares;
}

std::vector<double> line_delay_us(const std::vector<PatternRun>& runs,
                                  double (*of)(const PatternRun&)) {
  std::vector<double> values;
  for (const PatternRun& run : runs)
    if (run.status == PatternStatus::kOk) values.push_back(1e6 * of(run));
  return values;
}

}  // namespace

std::vector<PatternRuns> run_settings(const std::vector<PatternSetting>& settings, int runs,
                                      std::uint64_t first_seed, std::ostream& progress) {
  std::vector<PatternRuns> all;
  for (const PatternSetting& setting : settings) all.push_back({setting, {}});
  // By turns: whoever looks early sees something of every setting.
  for (int i = 0; i < runs; ++i) {
    for (std::size_t k = 0; k < all.size(); ++k) {
      auto& [setting, of_setting] = all[k];
      PatternScene scene = setting.scene;
      scene.seed = seed_of(first_seed, k, static_cast<std::size_t>(i));
      of_setting.push_back(run_pattern(scene, true));
      const PatternRun& run = of_setting.back();
      progress << setting.name << ", seed " << scene.seed << ": ";
      if (run.status == PatternStatus::kOk) {
        progress << number(1e6 * run.error[kLineDelay]) << " us, stated "
                 << number(1e6 * std::sqrt(run.covariance(kLineDelay, kLineDelay))) << ", possible "
                 << number(1e6 * std::sqrt(run.bound(kLineDelay, kLineDelay)));
      } else {
        progress << "refused: " << run.message;
      }
      progress << ", " << number(run.cpu_s) << " s" << std::endl;
    }
  }
  return all;
}

void judge_pattern_runs(const std::vector<PatternRuns>& all, std::ostream& out,
                        std::vector<std::string>* missed) {
  Table delays;
  delays.title =
      "line delay, us: root mean square of its errors, of the least and of the stated sigma";
  delays.header = {"setting",  "frames/s", "true",          "runs", "error",
                   "possible", "stated",   "knots a frame", "CPU s"};
  Table table;
  table.title =
      "root mean square of error / bound, and ANEES (where chance leaves them in 95 % of cases)";
  table.header = {"setting", "parameters", "error / bound", "ANEES"};
  const double each = std::pow(kVerdictProbability, 1.0 / (2.0 * std::size(kLensGroups) *
                                                           (static_cast<double>(all.size()) + 1)));
  const auto judge = [&](const std::string& name, const LensGroup& group, const Squares& squares) {
    const auto count = static_cast<int>(squares.over_bound.size()) * group.size;
    const double over_bound = std::sqrt(mean(squares.over_bound) / group.size);
    const double anees = mean(squares.over_stated) / group.size;
    table.rows.push_back({name, group.name,
                          within(over_bound, root_mean_square_interval(count, kPrintedProbability)),
                          within(anees, mean_square_interval(count, kPrintedProbability))});
    // Better than the bound nobody is but by chance.
    if (!(over_bound <= kLoss * root_mean_square_interval(count, each).high))
      missed->push_back(name + ", " + group.name + ": error / bound " + number(over_bound));
    if (!mean_square_interval(count, each).contains(anees))
      missed->push_back(name + ", " + group.name + ": ANEES " + number(anees));
  };
  std::vector<PatternRun> pooled;
  for (const auto& [setting, runs] : all) {
    for (const PatternRun& run : runs) {
      if (run.status != PatternStatus::kOk)
        missed->push_back(setting.name + ": refused: " + run.message);
    }
    std::vector<double> knots;
    for (const PatternRun& run : runs) knots.push_back(run.knots_per_frame);
    std::vector<double> cpu_s;
    for (const PatternRun& run : runs) cpu_s.push_back(run.cpu_s);
    const auto rms = [&runs = runs](double (*of)(const PatternRun&)) {
      return number(root_mean_square(line_delay_us(runs, of)));
    };
    delays.rows.push_back(
        {setting.name, number(setting.scene.rate_hz),
         number(1e6 * setting.scene.lens.line_delay_s, 5), std::to_string(runs.size()),
         rms([](const PatternRun& run) { return run.error[kLineDelay]; }),
         rms([](const PatternRun& run) { return std::sqrt(run.bound(kLineDelay, kLineDelay)); }),
         rms([](const PatternRun& run) {
           return std::sqrt(run.covariance(kLineDelay, kLineDelay));
         }),
         number(median(knots)), number(median(cpu_s))});
    for (const LensGroup& group : kLensGroups) judge(setting.name, group, squares_of(runs, group));
    pooled.insert(pooled.end(), runs.begin(), runs.end());
  }
  for (const LensGroup& group : kLensGroups) judge("all", group, squares_of(pooled, group));
  delays.print(out);
  table.print(out);
}

void write_pattern_runs(const std::vector<PatternRuns>& all, std::uint64_t first_seed,
                        std::ostream& csv) {
  csv << "setting,seed,status,cpu_s";
  for (const char* name : kLensParameterNames)
    csv << ',' << name << "_error," << name << "_sigma," << name << "_bound";
  csv << '\n';
  for (std::size_t k = 0; k < all.size(); ++k) {
    const auto& [setting, runs] = all[k];
    for (std::size_t i = 0; i < runs.size(); ++i) {
      csv << setting.name << ',' << seed_of(first_seed, k, i) << ','
          << static_cast<int>(runs[i].status) << ',' << runs[i].cpu_s;
      for (int p = 0; p < kLensParameterCount; ++p)
        csv << ',' << runs[i].error[p] << ',' << std::sqrt(runs[i].covariance(p, p)) << ','
            << std::sqrt(runs[i].bound(p, p));
      csv << '\n';
    }
  }
}

}  // namespace alidade::test
