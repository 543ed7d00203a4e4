#pragma once
// The experiments of alidade_oe_accuracy: which recordings, what is asked of them, and the tables.

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "test/accuracy/oe_evaluation.h"
#include "test/accuracy/report.h"

namespace alidade::test {

// What OE mode has to reach (error: length, root mean square over pixels and frames).
inline constexpr double kErrorBoundPx = 0.05;
inline constexpr double kCleanErrorBoundPx = 0.02;  // without noise and JPEG
inline constexpr double kLineDelayFactor = 3;       // worse, if the line delay is taken as 0
inline constexpr int kFramesToReturn = 3;

struct OeExperimentOptions {
  std::vector<Scene> scenes;
  RecordingSize size;
  double fields_per_second = 1;
  double telemetry_sigma_px = 1;  // of an image 1920 wide
  OeOptions oe;
  bool warm = false;
  bool details = false;
  std::string only;
  std::filesystem::path cache;
};

// The two photos that come with the repository.
[[nodiscard]] std::vector<Scene> repository_scenes();

void run_oe_accuracy(const OeExperimentOptions& options, Report* report, nlohmann::json* frames);
void run_oe_robustness(const OeExperimentOptions& options, Report* report, nlohmann::json* frames);

// A frame of the first recording, with its landmarks; empty if there is no such frame.
[[nodiscard]] cv::Mat image_of(const OeExperimentOptions& options, int frame);

}  // namespace alidade::test
