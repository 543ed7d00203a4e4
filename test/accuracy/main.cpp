// alidade_accuracy: how accurate and how honest the batch calibration is, by Monte Carlo.
//   alidade_accuracy --experiment base --runs 300       (README.md lists all it can do)
// Exit status: 0 all statistics lie where they should, 1 some do not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>

#include "test/accuracy/backend.h"
#include "test/accuracy/comparison.h"
#include "test/accuracy/disturbances.h"
#include "test/accuracy/narrow.h"
#include "test/accuracy/scaling.h"

int main(int argc, char** argv) {
  using alidade::test::Report;
  using alidade::test::Scales;

  CLI::App app("Monte-Carlo accuracy of the batch calibration");
  std::string experiment;
  bool disturbances = false;
  bool scaling = false;
  alidade::test::NarrowOptions narrow;
  std::string data;
  std::string json;
  int runs = 20;
  std::uint64_t seed = 1;
  app.add_option("--experiment", experiment, "base, soft or narrow")
      ->check(CLI::IsMember({"base", "soft", "narrow"}));
  app.add_option("--data", data, "a folder with recordings of known truth, to be compared");
  app.add_flag("--disturbances", disturbances, "base recordings with one thing wrong at a time");
  app.add_flag("--scaling", scaling, "CPU time for recordings of 10 to 320 s");
  app.add_option("--fields", narrow.fields_deg,
                 "of view, degrees, each a whole multiple of the next")
      ->delimiter(',');
  app.add_flag("!--no-baselines", narrow.baselines, "narrow: ours alone");
  app.add_option("--runs", runs, "how many, of each row or field of view")
      ->check(CLI::PositiveNumber);
  app.add_option("--seed", seed, "of the first run; the others follow");
  app.add_option("--json", json, "also write tables and runs to this file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  Report report(std::cout);
  if (experiment == "base") run_backend(Scales::kBase, runs, seed, &report);
  if (experiment == "soft") run_backend(Scales::kSoft, runs, seed, &report);
  if (experiment == "narrow") run_narrow(narrow, runs, seed, &report);
  if (disturbances) run_disturbances(runs, seed, &report);
  if (scaling) run_scaling(runs, seed, &report);
  std::string error;
  if (!data.empty() && !alidade::test::compare_recordings(data, &report, &error)) {
    std::cerr << "alidade_accuracy: " << error << "\n";
    return 2;
  }

  if (!json.empty()) {
    std::ofstream file(json);
    file << report.to_json().dump(1) << "\n";
    if (!file.flush()) {
      std::cerr << "alidade_accuracy: cannot write " << json << "\n";
      return 2;
    }
  }
  for (const std::string& what : report.missed()) std::cout << "MISSED: " << what << "\n";
  return report.missed().empty() ? 0 : 1;
}
