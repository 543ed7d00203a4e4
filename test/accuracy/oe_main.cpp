// alidade_oe_accuracy: how accurate and how honest OE mode is, on rendered recordings with truth.
//   alidade_oe_accuracy --cache DIR [--photo FILE]      (README.md lists all it can do)
// Exit status: 0 all bounds hold, 1 some do not (listed last), 2 wrong usage, unreadable files.

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <opencv2/imgcodecs.hpp>

#include "test/accuracy/oe_experiments.h"
#include "test/accuracy/oe_image.h"

int main(int argc, char** argv) {
  using namespace alidade::test;

  CLI::App app("Accuracy of OE mode on rendered recordings");
  OeExperimentOptions options;
  bool robustness = false;
  bool small = false;
  std::filesystem::path photo;
  std::string json;
  std::pair<int, std::string> image{-1, ""};
  app.add_option("--cache", options.cache, "keep rendered frames in this folder");
  app.add_option("--photo", photo, "the third scene; generated if not given");
  app.add_option("--only", options.only, "recordings whose names contain this");
  app.add_option("--speed", options.fields_per_second, "peak, horizontal fields of view a second")
      ->check(CLI::PositiveNumber);
  app.add_option("--seconds", options.size.duration_s, "of a recording")
      ->check(CLI::Range(2.0, 60.0));
  app.add_option("--max-chosen", options.oe.search.choice.max_chosen,
                 "landmarks looked for in a frame")
      ->check(CLI::Range(alidade::LandmarkChoiceOptions::kLeastChosen,
                         alidade::LandmarkChoiceOptions::kMaxChosen));
  app.add_option("--telemetry-sigma", options.telemetry_sigma_px, "px of a picture 1920 wide")
      ->check(CLI::PositiveNumber);
  app.add_flag("--small", small, "480x270 pictures, in place of 1920x1080 (960x540: robustness)");
  app.add_flag("--warm", options.warm, "each recording twice in a row; the second time counts");
  app.add_flag("--details", options.details, "errors by octave, row, speed and acceleration");
  app.add_flag("--robustness", robustness,
               "what goes wrong in life, in place of the accuracy table");
  app.add_option("--picture", image, "FRAME FILE: of the first recording, with its landmarks");
  app.add_option("--json", json, "also write tables and every frame to this file");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }

  options.scenes = repository_scenes();
  options.scenes.push_back(photo.empty() ? Scene{"procedural", {}}
                                         : Scene{photo.stem().string(), photo});
  if (robustness) {
    options.size.width = 960;
    options.size.height = 540;
  }
  if (small) {
    options.size.width = 480;
    options.size.height = 270;
  }

  Report report(std::cout);
  nlohmann::json frames;
  try {
    if (image.first >= 0) {
      const cv::Mat drawn = image_of(options, image.first);
      if (drawn.empty() || !cv::imwrite(image.second, drawn)) {
        std::cerr << "alidade_oe_accuracy: no frame " << image.first << ", or " << image.second
                  << " cannot be written\n";
        return 2;
      }
      return 0;
    }
    if (robustness) {
      run_oe_robustness(options, &report, &frames);
    } else {
      run_oe_accuracy(options, &report, &frames);
    }
    if (!json.empty()) {
      nlohmann::json all = report.to_json();
      all["frames"] = frames;
      std::ofstream file(json);
      file << all.dump(1) << "\n";
      if (!file.flush()) throw std::runtime_error(json + ": cannot be written");
    }
  } catch (const std::exception& error) {
    std::cerr << "alidade_oe_accuracy: " << error.what() << "\n";
    return 2;
  }
  for (const std::string& what : report.missed()) std::cout << "MISSED: " << what << "\n";
  return report.missed().empty() ? 0 : 1;
}
