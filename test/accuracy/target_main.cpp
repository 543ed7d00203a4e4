// alidade_target_tracking: how well targets are tracked on simulated detections (target_tracking.h).
//   alidade_target_tracking --only spaces
// Exit status: 0 all figures are as they should be, 1 some are not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <iostream>

#include "test/accuracy/target_tracking.h"

int main(int argc, char** argv) {
  CLI::App app("Tracking of simulated people on a plane by a camera that turns and zooms");
  alidade::test::TargetTrackingOptions options;
  app.add_option("--runs", options.runs, "minutes for each row")->check(CLI::PositiveNumber);
  app.add_option("--seed", options.first_seed, "of the first; the others follow");
  app.add_option("--recall", options.recall, "of the detector");
  app.add_option("--false-alarms", options.false_alarms, "a frame");
  app.add_option("--noise", options.noise_px, "of a detection's coordinates, px");
  app.add_option("--only", options.only, "one table")
      ->check(CLI::IsMember({"spaces", "associations", "errors", "sky", "times"}));
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const std::vector<std::string> missed = alidade::test::run_target_tracking(options, std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
