// alidade_zoom_sweep: OE mode while the lens zooms, against truth: 1280x720, 20x from 1200 to 24,000 px, line delay -14.2 us, noise of
// 2 grey levels, JPEG of quality 85, telemetry of 50 urad; at rest, a sweep, at rest, back.
//   alidade_zoom_sweep [--seed N] [--factor 10] [--sweep 5] [--stop-every FACTOR] [--from 1200] [--fault none|stuck|late|coarse] [--cache DIR]
//                      [--exact-curve] [--details] [--compare N]
// Exit status: 0 no frame is beyond 5 sigmas, 1 some are, 2 wrong usage.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <string>

#include "core/realtime/oe_mode/oe_mode.h"
#include "test/accuracy/kept_frames.h"
#include "test/accuracy/photos_of_all_scales.h"
#include "test/accuracy/rendered_recording.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/zoom_comparison.h"
#include "test/simulator/parallel.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {
namespace {

constexpr double kRepeatability = 2e-3;
constexpr double kStop_s = 0.2;      // on the way
constexpr double kStopping_s = 0.5;  // that the motor takes more for each
constexpr int kSettling = 5;         // frames
// Of what is compared: calibrations from end to end of the zoom, and frames from a keyframe to the next.
constexpr int kNodes = 5;
constexpr int kFramesBetweenKeyframes = 25;

struct Options {
  std::uint64_t seed = 1;
  double from = 1200;
  double factor = 10;
  double sweep_s = 5;
  double stop_every = 0;  // a factor of the focal length; 0: none
  double rest_s = 2;
  double fields = 0.5;  // of view a second
  std::string fault = "none";
  bool exact_curve = false;
  bool details = false;
  int compare = 0;    // each so many frames; 0: not
  std::string cache;  // folder
};

simulator::Config camera_of(const Options& options) {
  simulator::Config config;
  config.seed = options.seed;
  config.image = {1280, 720, 25};
  config.camera.line_delay = -14.2e-6;
  config.camera.pan_axis_offset = {-12e-3, 0};
  config.camera.tilt_axis_offset = {0, 14e-3};
  config.scene.background = 0.6;
  add_photos_of_all_scales(&config);
  config.sensor.exposure = 1e-3;
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 1.3;  // 2 with the shots
  simulator::ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {1200, 24000};
  zoom.distortion = {-0.04, 0.01};
  zoom.centre = {4, -3};
  zoom.centre_wander = 12;
  zoom.sigma_rep = kRepeatability;
  zoom.backlash = 1e-3;
  const double distance = std::log(options.factor);
  zoom.acceleration = 3;
  zoom.speed = distance / (options.sweep_s - 0.5);
  zoom.path.type = simulator::ZoomPathConfig::Type::kDwell;
  zoom.path.stops = {{std::nullopt, options.from, options.rest_s}};
  double stopped_s = 0;
  const auto stop_at = [&](double factor) {
    zoom.path.stops.push_back({std::nullopt, options.from * factor, kStop_s});
    stopped_s += kStop_s + kStopping_s;
  };
  std::vector<double> on_the_way;
  if (options.stop_every > 1) {
    for (double factor = options.stop_every; factor < 0.99 * options.factor;
         factor *= options.stop_every) {
      on_the_way.push_back(factor);
    }
  }
  for (const double factor : on_the_way) stop_at(factor);
  zoom.path.stops.push_back({std::nullopt, options.from * options.factor, options.rest_s});
  std::reverse(on_the_way.begin(), on_the_way.end());
  for (const double factor : on_the_way) stop_at(factor);
  config.duration = 2 * (options.sweep_s + options.rest_s) + stopped_s;
  return config;
}

// What the reading tells: the truth's, or one that went wrong at the first movement.
FrameLens lens_of(const ZoomingCamera& camera, const Options& options, int k) {
  const double t = camera.middle_s(k);
  if (options.fault == "stuck") {
    FrameLens lens = camera.lens_at(0, kRepeatability);
    lens.moves = false;
    lens.rate = 0;
    return lens;
  }
  if (options.fault == "late") return camera.lens_at(std::max(t - 1, 0.0), kRepeatability);
  if (options.fault != "coarse") return camera.lens(k, kRepeatability);
  constexpr double kQuantum = 200;  // of 9998
  return camera.coarse_lens(k, kQuantum, kRepeatability);
}

double cpu_s() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// As they come out of the camera's coder and a decoder.
std::vector<cv::Mat> film_of(const ZoomingCamera& camera, const simulator::Config& config,
                             const Options& options) {
  std::ostringstream key;
  key << image_key(config) << options.fields << ' ' << config.sensor.shot_noise << ' '
      << config.sensor.read_noise;
  const KeptFrames kept("zoom_sweep", key.str(), options.cache);
  std::vector<cv::Mat> film(static_cast<std::size_t>(camera.frames()));
  simulator::parallel_for(film.size(), [&](std::size_t i) {
    const auto k = static_cast<int>(i);
    const cv::Mat image = kept.frame(k, [&] {
      std::vector<std::uint8_t> pixels = camera.image(k);
      return cv::Mat(config.image.height, config.image.width, CV_8U, pixels.data()).clone();
    });
    std::vector<std::uint8_t> coded;
    cv::imencode(".jpg", image, coded, {cv::IMWRITE_JPEG_QUALITY, 85});
    film[i] = cv::imdecode(coded, cv::IMREAD_GRAYSCALE);
  });
  return film;
}

struct Part {
  std::vector<double> rms_px, log_errors, sigmas, log_sigmas, cpu_ms, settled_px;
  int frames = 0;
  int oe = 0;
  void print(const char* name) const {
    const double common = mean(log_errors);
    std::vector<double> about = log_errors;
    for (double& error : about) error -= common;
    std::printf(
        "%-9s %4d frames, OE %5.1f %%, rms %.3f px (worst %.3f), log f %.1e rms (%.1e common to "
        "all, %.1e about it), worst %.2f sigmas, f %.2f "
        "sigmas, rms of sigmas %.2f, f %.2f; process() %.2f ms (median)\n",
        name, frames, 100.0 * oe / std::max(frames, 1), root_mean_square(rms_px), largest(rms_px),
        root_mean_square(log_errors), common, root_mean_square(about), largest(sigmas),
        largest(log_sigmas), root_mean_square(sigmas), root_mean_square(log_sigmas),
        median(cpu_ms));
    if (!settled_px.empty()) {
      std::printf("          from the frame after the fifth on: rms %.3f px (worst %.3f)\n",
                  root_mean_square(settled_px), largest(settled_px));
    }
  }
};

// Of one way to answer, on the frames that are compared.
struct Answers {
  std::vector<double> log_errors, rotations_rad, px;
  int frames = 0;
  void add(const ZoomingCamera& camera, int k, const std::optional<ZoomAnswer>& answer) {
    ++frames;
    if (!answer) return;
    const ZoomAnswerErrors e = errors_of(camera, k, *answer);
    log_errors.push_back(e.log_focal_length);
    rotations_rad.push_back(e.rotation_rad);
    px.push_back(e.px);
  }
  void print(const char* name) const {
    if (px.empty()) {
      std::printf("%-32s none of %d\n", name, frames);
      return;
    }
    std::vector<double> sizes = log_errors;
    for (double& size : sizes) size = std::abs(size);
    std::printf(
        "%-32s %3zu of %3d frames, log f %.1e rms (median %.1e), rotation %.1e rad rms (median "
        "%.1e), pixels' directions %.2f px rms (median %.2f, worst %.2f)\n",
        name, px.size(), frames, root_mean_square(log_errors), median(sizes),
        root_mean_square(rotations_rad), median(rotations_rad), root_mean_square(px), median(px),
        largest(px));
  }
};

int run(const Options& options) {
  const simulator::Config config = camera_of(options);
  ZoomingCamera camera(config, std::make_unique<ZoomedPath>(config, options.fields, 4),
                       options.exact_curve ? 0 : 1);
  const std::vector<cv::Mat> film = film_of(camera, config, options);
  OeOptions oe_options;
  oe_options.max_width = config.image.width;
  oe_options.max_height = config.image.height;
  oe_options.maker.cell_size_px = config.image.width / 24.0;  // as the program has it
  OeMode oe(oe_options);
  Calibration calibration = camera.lens_at(0, kRepeatability).calibration;
  calibration.mechanics.pan_axis += Vector3<double>(-12e-3, 0, 0);
  calibration.mechanics.tilt_axis += Vector3<double>(0, 0, 14e-3);
  calibration.mechanics.pan_axis.normalize();
  calibration.mechanics.tilt_axis.normalize();
  oe.reset(calibration, FocalLength::kLearnt);
  std::unique_ptr<KeyframeHomographies> keyframes;
  std::unique_ptr<NearestNodes> nodes;
  if (options.compare > 0) {
    keyframes = std::make_unique<KeyframeHomographies>(camera, film, kFramesBetweenKeyframes);
    nodes = std::make_unique<NearestNodes>(camera, 1200, 24000, kNodes, calibration.mechanics);
  }
  Answers ours, nearest_node, nearest_keyframe;
  Part rest, moving, after;
  int since_movement = 1000;
  double worst = 0;
  double excluded = 0;  // px, the focal length found where it excludes the reading
  int contradictions = 0;
  // The middle row of the very first frames is exposed before the path begins.
  for (int k = 2; k < camera.frames(); ++k) {
    const ImageView view = view_of(film[static_cast<std::size_t>(k)]);
    const InterpolatedPanTilt telemetry = camera.telemetry(k, 5e-5, 1e-3);
    FrameLens lens = lens_of(camera, options, k);
    // As the program does: where images exclude the reading, the curve's lens at what they found.
    const int of_f = index(Parameter::kFocalLength);
    const double told = lens.calibration.camera.focal_length;
    const double told_sigma = std::sqrt(lens.calibration.covariance(of_f, of_f)) / told;
    if (excluded > 0) lens = camera.lens_of_focal_length(excluded, kRepeatability);
    lens.calibration.mechanics = calibration.mechanics;
    FrameOrientation frame;
    const double begin = cpu_s();
    const OeStatus status = oe.process(view, camera.time_s(k), &telemetry, &lens, &frame);
    const double cpu_ms = 1e3 * (cpu_s() - begin);
    const double found = frame.calibration.camera.focal_length;
    excluded =
        frame.mode == OrientationMode::kOe && std::abs(std::log(found / told)) > 5 * told_sigma
            ? found * std::exp(frame.zoom_rate * camera.time_s(1))
            : 0;
    contradictions += excluded > 0 ? 1 : 0;
    const bool moves = camera.lens(k, 0).moves;
    since_movement = moves ? 0 : since_movement + 1;
    const FrameErrors e = errors_of(camera, k, frame);
    const OeStatistics s = oe.statistics();
    if (options.details) {
      std::printf(
          "%3d f %7.1f moves %d status %d own %d visible %3d found %3d inliers %3d rms %.3f sigmas "
          "%.2f log f %8.1e "
          "sigmas %.2f reading %.1f map %d\n",
          k, frame.calibration.camera.focal_length, moves, static_cast<int>(status), s.own_lens,
          s.fine_visible, s.found, s.inliers, e.rms_px, e.sigmas, camera.log_error(k, frame),
          e.log_sigmas, s.reading_sigmas, oe.map().size());
    }
    oe.maintain();
    worst = std::max({worst, e.sigmas, e.log_sigmas});
    Part& part = moves ? moving : since_movement <= 25 ? after : rest;
    ++part.frames;
    if (options.compare > 0 && moves && k % options.compare == 0 && !keyframes->is_keyframe(k)) {
      ours.add(camera, k, answer_of(frame));
      nearest_node.add(camera, k, nodes->answer(k, telemetry));
      nearest_keyframe.add(camera, k, keyframes->answer(k));
    }
    if (frame.mode != OrientationMode::kOe) continue;
    ++part.oe;
    part.rms_px.push_back(e.rms_px);
    if (&part == &after && since_movement > kSettling) part.settled_px.push_back(e.rms_px);
    part.log_errors.push_back(camera.log_error(k, frame));
    part.sigmas.push_back(e.sigmas);
    part.log_sigmas.push_back(e.log_sigmas);
    part.cpu_ms.push_back(cpu_ms);
  }
  std::printf("seed %d, %g to %g px in %g s, fault %s\n", static_cast<int>(options.seed),
              options.from, options.from * options.factor, options.sweep_s, options.fault.c_str());
  std::printf("%d frames exclude the reading\n", contradictions);
  rest.print("at rest");
  moving.print("moving");
  after.print("1 s after");
  if (options.compare > 0) {
    std::printf("moving, compared:\n");
    ours.print("OE mode");
    nearest_node.print("nearest calibration, telemetry");
    nearest_keyframe.print("homography to nearest keyframe");
  }
  return worst > 5 ? 1 : 0;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  CLI::App app("OE mode while the lens zooms, against truth");
  alidade::test::Options options;
  app.add_option("--seed", options.seed, "of everything that is drawn");
  app.add_option("--from", options.from, "px, focal length of the first rest")
      ->check(CLI::Range(1200.0, 24000.0));
  app.add_option("--factor", options.factor, "of the focal length")->check(CLI::Range(1.01, 20.0));
  app.add_option("--sweep", options.sweep_s, "s, of a movement")->check(CLI::Range(1.0, 60.0));
  app.add_option("--stop-every", options.stop_every,
                 "factor of the focal length after which a movement stops for 0.2 s")
      ->check(CLI::Range(1.5, 20.0));
  app.add_option("--rest", options.rest_s, "s, between movements")->check(CLI::Range(1.0, 60.0));
  app.add_option("--fields", options.fields, "of view a second, the fastest turn")
      ->check(CLI::Range(0.0, 2.0));
  app.add_option("--fault", options.fault, "of the zoom reading")
      ->check(CLI::IsMember({"none", "stuck", "late", "coarse"}));
  app.add_option("--cache", options.cache, "folder where the rendered film is kept");
  app.add_flag("--exact-curve", options.exact_curve,
               "distortion and optical centre are told as they are");
  app.add_option("--compare", options.compare,
                 "each so many frames, others' ways beside OE mode: a calibration at each of five "
                 "zooms, and the homography to the nearest keyframe")
      ->check(CLI::Range(1, 1000));
  app.add_flag("--details", options.details, "a line a frame");
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  return alidade::test::run(options);
}
