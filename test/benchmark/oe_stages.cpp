#include "test/benchmark/oe_stages.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/realtime/oe_mode/view_projection.h"

namespace alidade::benchmarks {

OeOptions measured_options(const Camera<double>& camera, int points) {
  OeOptions options;
  options.max_width = camera.width;
  options.max_height = camera.height;
  options.search.choice.max_chosen = points;
  options.maker.cell_size_px = std::sqrt(camera.width * camera.height / (2.5 * points));
  return options;
}

OeStages::OeStages(const Calibration& calibration, const OeMode* mode, int points, Measure measure)
    : calibration_(calibration),
      mode_(*mode),
      measure_(std::move(measure)),
      options_(measured_options(calibration.camera, points)),
      octaves_(options_.octaves),
      pyramid_(calibration.camera.width, calibration.camera.height, Pyramid::kMaxOctaves),
      prediction_(options_.prediction),
      search_(options_.search, mode->map().capacity()) {
  octaves_.reset(calibration.camera.height);
  octaves_.set_noise(options_.noise.expected);  // of the frames that are measured
  prediction_.reset(calibration);
  search_.reset(calibration);
}

int OeStages::run(const ImageView& image, const InterpolatedPanTilt& telemetry) {
  const Camera<double>& camera = calibration_.camera;
  measure_("pyramid", [&] {
    if (pyramid_.build(image, octaves_.count()) != PyramidStatus::kOk) std::abort();
  });
  const OeStatistics& statistics = mode_.statistics();
  const MapOffset offset{statistics.map_offset.vector(), statistics.map_offset_covariance,
                         Sensitivity<2>::Zero()};
  const PredictedMotion predicted = prediction_.by_telemetry(calibration_, telemetry, offset, 1);
  const SearchedFrame frame{calibration_, mode_.map(), pyramid_, octaves_};
  FrameMotion<double> motion = predicted.motion;
  {
    const ViewProjection view(calibration_, motion);
    measure_("project", [&] { search_.find_visible(frame, view); });
    const double sigma_px =
        camera.focal_length * std::sqrt(predicted.angle_covariance.diagonal().maxCoeff());
    measure_("coarse", [&] {
      search_.prepare_coarse(frame, view);
      Vector2<double> angle;
      if (!search_.fit_coarse(frame, sigma_px, &angle)) return;
      motion.angle = {motion.angle.pan + angle.x(), motion.angle.tilt + angle.y()};
    });
  }
  const ViewProjection view(calibration_, motion);
  search_.find_visible(frame, view);
  measure_("align", [&] {
    search_.choose_fine(frame);
    search_.fit_fine(frame, view);
  });
  MotionPrior prior = predicted.prior;
  prior.telemetry.head<2>() = predicted.motion.angle.vector() - motion.angle.vector();
  prior.offset_covariance = offset.covariance;
  SolvedMotion solved;
  SolveStatus status = SolveStatus::kTooFew;
  measure_("solve", [&] {
    status = solve_orientation(search_.found().data(), static_cast<int>(search_.found().size()),
                               prior, {}, camera.width, camera.height,
                               0.5 * camera.height * calibration_.line_delay, &solved);
  });
  return status == SolveStatus::kOk ? solved.inliers : 0;
}

}  // namespace alidade::benchmarks
