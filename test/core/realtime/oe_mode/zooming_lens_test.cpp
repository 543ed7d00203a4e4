// OE mode behind a lens that zooms: at rest after a movement, and while it moves.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <memory>
#include <vector>

#include "core/model/trigonometry.h"
#include "core/realtime/oe_mode/oe_mode.h"
#include "test/support/zooming_camera.h"

namespace alidade::test {
namespace {

constexpr double kRepeatability = 2e-3;

simulator::Config zooming(double wide, double tele, std::uint64_t seed) {
  simulator::Config config;
  config.seed = seed;
  config.image = {480, 270, 25};
  config.camera.line_delay = -40e-6;
  config.duration = 5;
  for (const auto& [name, azimuth, elevation, width] :
       {std::tuple{"life_by_Aitzol_Berasategi.jpg", -0.5, 0.0, 7.0},
        std::tuple{"picosdeeuropa_by_Aitzol_Berasategi.jpg", 0.0, 0.0, 60.0}}) {
    simulator::PatchConfig photo;
    photo.file = std::string(ALIDADE_TEST_DATA "/") + name;
    photo.azimuth = azimuth * kPi / 180;
    photo.elevation = elevation * kPi / 180;
    photo.width = width * kPi / 180;
    config.scene.photos.push_back(photo);
  }
  config.sensor.exposure = 1e-3;
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 0.7;
  simulator::ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {wide, tele};
  zoom.sigma_rep = kRepeatability;
  zoom.distortion = {-0.02, 0.01};
  zoom.centre = {2, -1};
  zoom.centre_wander = 3;
  return config;
}

TEST(ZoomingLens, Explore) {
  simulator::Config config = zooming(1000, 8000, 1);
  config.zoom->path.type = simulator::ZoomPathConfig::Type::kSweep;
  config.zoom->path.factor = 6;
  config.zoom->path.duration = 4;
  config.zoom->path.stop = 1;
  config.duration = 12;
  // At rest first.
  config.zoom->path.type = simulator::ZoomPathConfig::Type::kDwell;
  config.zoom->speed = 0.5;
  config.zoom->path.stops = {{std::nullopt, 1000, 3}, {std::nullopt, 6000, 3}};
  ZoomingCamera camera(config, std::make_unique<ZoomedPath>(config, 0.4, 3));
  OeOptions options;
  options.max_width = 480;
  options.max_height = 270;
  options.max_landmarks = 2000;
  options.maker.cell_size_px = 24;
  OeMode oe(options);
  oe.reset(camera.lens(0, kRepeatability).calibration, FocalLength::kLearnt);
  for (int k = 0; k < camera.frames(); ++k) {
    const auto pixels = camera.image(k);
    const InterpolatedPanTilt telemetry = camera.telemetry(k, 5e-5, 5e-4);
    const FrameLens lens = camera.lens(k, kRepeatability);
    FrameOrientation frame;
    const OeStatus status = oe.process(camera.view(pixels), camera.time_s(k), &telemetry, &lens, &frame);
    const FrameErrors e = errors_of(camera, k, frame);
    const OeStatistics& s = oe.statistics();
    std::printf("%3d f %7.1f mv %d st %d own %d vis %3d ch %3d fo %3d in %3d rms %.3f sig %.2f flog %.1e fsig %.2f rs %.1f  map %d\n",
                k, frame.calibration.camera.focal_length, lens.moves, static_cast<int>(status), s.own_lens, s.fine_visible, s.chosen, s.found, s.inliers,
                e.rms_px, e.sigmas, camera.log_error(k, frame), e.log_sigmas, s.reading_sigmas, oe.map().size());
    oe.maintain();
  }
}

}  // namespace
}  // namespace alidade::test
