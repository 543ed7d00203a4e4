// alidade_compare: what `alidade calibrate` made of many recordings, held against what is known of them.
//   alidade_compare [--calibration FILE] DIR...       FILE: of each DIR (default: alidade/calibration.yaml)
// Shows each recording's estimate beside truth.yaml, peer.yaml (another program's) and limit.yaml (the best possible
// standard deviations), where DIR holds them, then the statistics of all. A recording without a calibration is listed.
// Exit status: 0 each has one, 1 some have none, 2 wrong usage.

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "edge_app/storage/calibration_file.h"
#include "test/accuracy/calibration_comparison.h"

int main(int argc, char** argv) {
  CLI::App app("Calibrations of many recordings against their truth");
  std::vector<std::string> recordings;
  std::string file = "alidade/calibration.yaml";
  app.add_option("recording", recordings, "Folders of the recordings")->required();
  app.add_option("--calibration", file, "File in each of them")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  alidade::test::CalibrationComparison comparison;
  for (const std::string& recording : recordings) {
    alidade::test::ComparedRun known;
    alidade::Calibration estimate;
    std::string error;
    const std::string path = (std::filesystem::path(recording) / file).string();
    if (!alidade::test::load_known_values(recording, &known, &error) ||
        !alidade::load_calibration(path, &estimate, &error)) {
      comparison.add_failure(error);
      fmt::print("{}\n\n", error);
      continue;
    }
    fmt::print("{}", comparison.add(known, estimate));
  }
  fmt::print("{}", comparison.statistics());
  std::fflush(stdout);
  return comparison.failures() == 0 ? 0 : 1;
}
