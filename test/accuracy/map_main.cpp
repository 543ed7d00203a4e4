// alidade_map_stills: how accurate and how honest the bundle adjustment of a map is on simulated stills (map_stills.h).
//   alidade_map_stills --runs 5
// Exit status: 0 all figures are as they should be, 1 some are not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <iostream>

#include "test/accuracy/map_stills.h"

int main(int argc, char** argv) {
  CLI::App app("Accuracy of a map's bundle adjustment on simulated stills at all zooms");
  alidade::test::MapStillsOptions options;
  app.add_option("--runs", options.runs, "how many scenes")->check(CLI::PositiveNumber);
  app.add_option("--seed", options.first_seed, "of the first; the others follow");
  app.add_option("--directions", options.directions, "that are drawn in each picture")
      ->check(CLI::PositiveNumber);
  app.add_option("--noise", options.nearest_px, "of the smallest features, px");
  app.add_option("--wrong", options.wrong_share, "share of wrong observations");
  app.add_option("--repeatability", options.repeatability, "sigma of log f after a movement");
  app.add_option("--hold", options.hold,
                 "what the lens keeps that rests off its curve: 1 its corner's distortion, 0 k");
  app.add_option("--angle-noise", options.angle_noise, "of telemetry, rad");
  app.add_option("--backlash", options.backlash, "of telemetry, rad, to one side or the other");
  app.add_flag("--alone", options.alone, "only as a map is built");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const std::vector<std::string> missed = alidade::test::run_map_stills(options, std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
