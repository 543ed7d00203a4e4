// `alidade calibrate-shutter`: finds line delay and lens from a video of a known pattern. A lens
// that is not good enough is not written, so that it cannot replace a good one.

#include "edge_app/commands/calibrate_shutter.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstddef>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/pattern/calibrate_pattern.h"
#include "core/pattern/circle_images.h"
#include "core/pattern/pattern_drawing.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/live_pattern.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/commands/pattern_video.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/output/lens_table.h"
#include "edge_app/output/pattern_report.h"
#include "edge_app/storage/lens_file.h"

namespace alidade {
namespace {

constexpr double kUsualFilm_s = 60;

PatternVideo find_visibly(const CalibrateShutterOptions& options, const KnownPattern& pattern) {
  StopSignals signals;
  const bool show = is_terminal(STDERR_FILENO);
  PatternVideo video = find_pattern(options.video, pattern, [&](int images, int found) {
    if (show)
      fmt::print(stderr, "\r\033[K{}: {} images, the pattern in {}", options.video, images, found);
    return signals.wait(-1, 0) != StopSignals::Event::kSignal;
  });
  if (show) fmt::print(stderr, "\r\033[K");
  return video;
}

VideoConfig require_live_video(const CalibrateShutterOptions& options) {
  VideoConfig config = require_video_config(options.config);
  if (config.type == VideoConfig::Type::kRecording) {
    throw CommandError(kExitUsage,
                       fmt::format("{}: video.type: a recording is not live video; give its "
                                   "directory instead: alidade calibrate-shutter {}",
                                   options.config, config.directory));
  }
  return config;
}

PatternVideo find_live(const VideoConfig& config, const CalibrateShutterOptions& options,
                       const KnownPattern& pattern) {
  PatternVideo video = film_pattern(config, pattern, options.duration_s.value_or(kUsualFilm_s));
  spdlog::info("{}: calibrating, the pattern is in {} of {} images; Ctrl-C ends it at once",
               video.name, video.found, video.images);
  return video;
}

void check_usage(const CalibrateShutterOptions& options) {
  if (options.video.empty() && options.config.empty()) {
    throw CommandError(kExitUsage,
                       "calibrate-shutter: no video; give a recording's directory or a video file, "
                       "-c camera.yaml for a live one, or --print PAPER");
  }
  if (!options.video.empty() && !options.config.empty()) {
    throw CommandError(kExitUsage, fmt::format("calibrate-shutter: both {} and -c name a video; "
                                               "give a recording or a file, or -c for a live one",
                                               options.video));
  }
  if (options.config.empty() && options.duration_s) {
    throw CommandError(kExitUsage,
                       "calibrate-shutter: --duration is for a live video, with -c; a recording or "
                       "a file is read to its end");
  }
}

std::string text_of(const PatternCalibration& calibration, const PatternVideo& video) {
  std::string text = fmt::format(
      "{} of {} images show the pattern, {} points used, {} left out; a detection's sigma {:.3f} "
      "px\n",
      video.found, video.images, calibration.observations, calibration.left_out,
      calibration.sigma_px);
  for (const LensTableRow& row : lens_table(calibration)) {
    const std::string sigma = (row.sigma == "exact" ? "" : "± ") + row.sigma;
    text += fmt::format("  {:<17}{:>14} {} {}\n", row.name, row.value, sigma, row.unit);
  }
  if (calibration.has_global_shutter())
    text += "the line delay is 0 within 3 sigmas: a global shutter, or rows too fast to tell\n";
  return text;
}

std::string json_of(const PatternCalibration& calibration, const PatternVideo& video) {
  nlohmann::ordered_json json;
  for (int i = 0; i < kLensParameterCount; ++i) {
    json[kLensParameterNames[static_cast<std::size_t>(i)]] = {
        {"value", calibration.lens[i]},
        {"sigma", calibration.sigma(static_cast<LensParameter>(i))}};
  }
  json["global_shutter"] = calibration.has_global_shutter();
  json["images"] = video.images;
  json["found"] = video.found;
  json["repeated"] = video.repeated;
  json["skipped"] = video.skipped;
  json["lost"] = video.lost;
  json["observations"] = calibration.observations;
  json["left_out"] = calibration.left_out;
  json["detection_sigma_px"] = calibration.sigma_px;
  json["segments"] = calibration.curve.segments();
  return json.dump() + "\n";
}

// The usual mistakes with this kind of pattern.
std::string hint_for(PatternStatus status, const KnownPattern& pattern) {
  if (status != PatternStatus::kNoPattern) return "";
  switch (pattern.kind) {
    case PatternKind::kChessboard:
      return fmt::format(" {}x{} are inner corners, of a board of {}x{} squares", pattern.columns,
                         pattern.rows, pattern.columns + 1, pattern.rows + 1);
    case PatternKind::kAsymmetricCircles:
      return fmt::format(" {}x{} are {} rows of {} circles, every second row moved by half",
                         pattern.columns, pattern.rows, pattern.rows, pattern.columns);
    case PatternKind::kSymmetricCircles:
      return fmt::format(" {}x{} are {} rows of {} circles", pattern.columns, pattern.rows,
                         pattern.rows, pattern.columns);
    case PatternKind::kAprilGrid:
      return " The tags are of family 36h11, numbered from 0 on from the lower left, their black "
             "border one cell wide or two";
    case PatternKind::kCharuco:
      return fmt::format(
          " {}x{} are squares, every second one with a marker of {}; without markers it is a "
          "chessboard:{}x{}, with gaps between its tags an aprilgrid",
          pattern.columns, pattern.rows,
          kMarkerDictionaries[static_cast<std::size_t>(pattern.dictionary)].name,
          pattern.columns - 1, pattern.rows - 1);
  }
  return "";
}

void print(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
}

}  // namespace

int calibrate_shutter(const CalibrateShutterOptions& options) {
  std::string error;
  const std::optional<KnownPattern> pattern = parse_pattern(options.pattern, &error);
  if (!pattern) throw CommandError(kExitUsage, "--pattern " + error);
  if (!options.paper.empty()) {
    const std::optional<std::string> drawing = draw_pattern(*pattern, options.paper, &error);
    if (!drawing) throw CommandError(kExitUsage, "--print: " + error);
    print(*drawing);
    return kExitOk;
  }
  check_usage(options);
  std::optional<VideoConfig> live;
  if (!options.config.empty()) live = require_live_video(options);
  const OutputLock lock(output_path(options.directory, options.video) + "/lens.yaml");
  const PatternVideo video =
      live ? find_live(*live, options, *pattern) : find_visibly(options, *pattern);
  const auto warn = [&](const std::vector<std::string>& remarks) {
    for (const std::string& remark : remarks) spdlog::warn("{}: {}", video.name, remark);
  };
  warn(video.remarks);
  if (!video.doubt.empty()) {
    // For an AprilGrid the doubt itself says what would be right.
    const bool is_whole = pattern->kind == PatternKind::kAprilGrid;
    throw CommandError(kExitFailed,
                       video.name + ": " + video.doubt +
                           (is_whole ? "" : "." + hint_for(PatternStatus::kNoPattern, *pattern)));
  }
  const PatternCalibration calibration = calibrate_pattern(video.data);
  std::vector<std::string> remarks = video.remarks;
  remarks.insert(remarks.end(), calibration.remarks.begin(), calibration.remarks.end());
  warn(calibration.remarks);
  if (calibration.status != PatternStatus::kOk) {
    throw CommandError(kExitFailed, video.name + ": " + calibration.message +
                                        hint_for(calibration.status, *pattern));
  }

  OutputDirectory directory(options.directory, options.video);
  const LensNotes notes{options.pattern, video.data.width, video.data.height};
  directory.add(
      "report", "report.html",
      pattern_report({video.name, options.pattern,
                      recentred(video.data, calibration.lens, calibration.curve), calibration,
                      video.images, video.found, remarks, ALIDADE_VERSION,
                      fmt::format("{:%Y-%m-%d %H:%M} UTC", fmt::gmtime(std::time(nullptr)))}));
  directory.add("trajectory", "trajectory.csv", format_trajectory(calibration, video.data));
  directory.add("camera_info", "camera_info.yaml", format_camera_info(calibration, notes));
  directory.add("lens", "lens.yaml", format_lens(calibration, notes));
  for (const auto& [kind, path] : directory.files()) spdlog::info("{}: {}", kind, path);
  print(options.json ? json_of(calibration, video) : text_of(calibration, video));
  return kExitOk;
}

}  // namespace alidade
