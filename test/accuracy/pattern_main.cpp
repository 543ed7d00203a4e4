// alidade_pattern_accuracy: is the calibration by a known pattern as accurate as it can be, and as it says? (README.md)
//   alidade_pattern_accuracy [--runs N] [--seed N] [--only SETTING] [--csv FILE]      Monte Carlo; the paper's Tables 1 and 2
//   alidade_pattern_accuracy --figures DIR [--seed N] [--share S]                    its Table 3, Figures 4 and 5, standardisation
// Exit status: 0 it is, 1 not (the last lines say in what), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <fstream>
#include <iostream>
#include <stdexcept>

#include "test/accuracy/pattern_monte_carlo.h"
#include "test/accuracy/pattern_paper.h"

int main(int argc, char** argv) {
  using alidade::test::PatternRuns;
  using alidade::test::PatternSetting;

  CLI::App app("Calibrations by a known pattern against the truth of simulated detections");
  int runs = 40;
  std::uint64_t seed = 1;
  std::string only;
  std::string csv;
  std::string figures;
  double share = 1;
  std::vector<PatternSetting> settings = alidade::test::pattern_settings();
  std::vector<std::string> names;
  for (const PatternSetting& setting : settings) names.push_back(setting.name);
  app.add_option("--runs", runs, "of each setting")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  app.add_option("--seed", seed, "of the first run; the others follow")->capture_default_str();
  app.add_option("--only", only, "one setting")->check(CLI::IsMember(names));
  app.add_option("--csv", csv, "also write every run to this file");
  app.add_option("--figures", figures,
                 "the paper's Table 3, Figures 4 and 5, standardisation, into this folder, and no "
                 "Monte Carlo");
  app.add_option("--share", share, "of Table 3's recordings, and of 20 for the standardisation")
      ->check(CLI::Range(0.0, 1.0));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  if (!figures.empty()) {
    try {
      alidade::test::print_uniform_knots(seed, figures, std::cout);
      alidade::test::print_localization(seed, figures, std::cout);
      alidade::test::print_telephones(share, seed, std::cout);
      alidade::test::print_standardisation(std::max(2, static_cast<int>(20 * share)), seed,
                                           std::cout);
    } catch (const std::exception& error) {
      std::cerr << "alidade_pattern_accuracy: " << error.what() << "\n";
      return 1;
    }
    return 0;
  }
  if (!only.empty()) {
    settings.erase(std::remove_if(settings.begin(), settings.end(),
                                  [&](const auto& setting) { return setting.name != only; }),
                   settings.end());
  }
  std::vector<std::string> missed;
  const std::vector<PatternRuns> all = run_settings(settings, runs, seed, std::cout);
  judge_pattern_runs(all, std::cout, &missed);
  alidade::test::print_line_delays(all, seed, std::cout, &missed);
  if (!csv.empty()) {
    std::ofstream file(csv);
    write_pattern_runs(all, seed, file);
    if (!file.flush()) {
      std::cerr << "alidade_pattern_accuracy: cannot write " << csv << "\n";
      return 2;
    }
  }
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
