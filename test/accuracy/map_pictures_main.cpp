// alidade_map_pictures: how accurate and how honest a map is that is built of pictures, and how surely and fast it tells where another
// picture looks (map_pictures.h).
//   alidade_map_pictures --views 500
// Exit status: 0 all figures are as they should be, 1 some are not (listed last), 2 wrong usage.

#include <CLI/CLI.hpp>
#include <iostream>

#include "test/accuracy/map_pictures.h"

int main(int argc, char** argv) {
  CLI::App app("Accuracy of a scene map that is built of pictures of the virtual camera");
  alidade::test::MapPicturesOptions options;
  app.add_option("--seed", options.seed, "of scene, lens and noise");
  app.add_option("--views", options.views, "that are localized")->check(CLI::NonNegativeNumber);
  app.add_option("--columns", options.columns, "of the map's views at each of five focal lengths")
      ->check(CLI::Range(5, 8));
  app.add_option("--more", options.more,
                 "of the random views, that are in the map, too; with --views 0")
      ->check(CLI::Range(0, 500));
  app.add_option("--features", options.features, "of each of the map's pictures, at most")
      ->check(CLI::PositiveNumber);
  app.add_option("--cache", options.cache, "folder that keeps what was rendered");
  app.add_flag("!--no-telemetry", options.telemetry, "the map's pictures have none");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  const std::vector<std::string> missed = alidade::test::run_map_pictures(options, std::cout);
  for (const std::string& what : missed) std::cout << "MISSED: " << what << "\n";
  return missed.empty() ? 0 : 1;
}
