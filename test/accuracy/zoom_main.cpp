// alidade_zoom_accuracy: how accurate and how honest a zoom curve from a recording with dwells is (zoom_experiment.h).
//   alidade_zoom_accuracy --runs 10
// Exit status: 0 all statistics lie where they should, 1 some do not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <iostream>

#include "test/accuracy/zoom_experiment.h"

int main(int argc, char** argv) {
  CLI::App app("Accuracy of a zoom curve from one recording with dwells at some zooms");
  alidade::test::ZoomExperimentOptions options;
  app.add_option("--runs", options.runs, "how many recordings")->check(CLI::PositiveNumber);
  app.add_option("--seed", options.first_seed, "of the first; the others follow");
  app.add_option("--repeatability", options.scenario.sigma_rep, "sigma of log f after a movement");
  app.add_option("--pixel-sigma", options.scenario.pixel_sigma, "noise of the tracks, px");
  app.add_option("--rest", options.scenario.rest_s, "of each dwell, s");
  app.add_flag("!--no-movements", options.movements, "the dwells alone");
  app.add_option("--cycles", options.scenario.cycles, "2: back through the dwells, too");
  app.add_option("--late-sigma", options.zoom_late_sigma_s, "what the fit takes as possible, s");
  app.add_option("--late", options.scenario.late_s, "the zoom that is told is older, s");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const std::vector<std::string> missed = run_zoom_experiment(options, std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
