#include "test/benchmark/oe_stages.h"

#include <cmath>
#include <cstdlib>

#include "core/model/camera.h"

namespace alidade::benchmarks {
namespace {

constexpr int kOctaves = 6;
constexpr int kFirstCoarse = 2;
constexpr std::size_t kCoarse = 40;  // of each octave

}  // namespace

OeOptions measured_options(const Camera<double>& camera, int points) {
  OeOptions options;
  options.max_width = camera.width;
  options.max_height = camera.height;
  options.max_used = points;
  options.cell_size_px = std::sqrt(camera.width * camera.height / (2.5 * points));
  return options;
}

OeStages::OeStages(const Calibration& calibration, const OeMode* mode, int points, Measure measure)
    : calibration_(calibration),
      mode_(*mode),
      measure_(std::move(measure)),
      pyramid_(calibration.camera.width, calibration.camera.height, kOctaves),
      slots_(static_cast<std::size_t>(mode->map().capacity())),
      points_(static_cast<std::size_t>(points)) {
  seen_.reserve(slots_.size());
  patches_.reserve(slots_.size());
  coarse_.reserve(kOctaves * kCoarse);
  fine_.reserve(points_);
  found_.reserve(points_);
}

int OeStages::run(const ImageView& picture, const InterpolatedPanTilt& telemetry) {
  const Camera<double>& c = calibration_.camera;
  const PanTilt<double> offset = mode_.statistics().map_offset;
  FrameMotion<double> motion{telemetry.angle, telemetry.rate, 0.5 * c.height};
  motion.angle.pan -= offset.pan;
  motion.angle.tilt -= offset.tilt;

  measure_("pyramid", [&] {
    if (pyramid_.build(picture, kOctaves) != PyramidStatus::kOk) std::abort();
  });
  measure_("project", [&] { find_visible(ViewProjection(calibration_, motion)); });
  prepare_patches(ViewProjection(calibration_, motion));
  const PanTilt<double> predicted = motion.angle;
  measure_("coarse", [&] {
    CoarseAlignment aligned;
    if (align_coarsely(pyramid_, coarse_.data(), static_cast<int>(coarse_.size()), {}, &aligned))
      motion.angle = {predicted.pan + aligned.angle.x(), predicted.tilt + aligned.angle.y()};
  });
  measure_("align", [&] { align_landmarks(ViewProjection(calibration_, motion)); });
  MotionPrior prior;
  prior.has_telemetry = true;
  prior.telemetry.head<2>() = predicted.vector() - motion.angle.vector();
  prior.telemetry_covariance = telemetry.covariance;
  prior.motion_information.diagonal().tail<2>().setConstant(0.1);
  SolvedMotion solved;
  SolveStatus status = SolveStatus::kTooFew;
  measure_("solve", [&] {
    status = solve_orientation(found_.data(), static_cast<int>(found_.size()), prior, {}, c.width,
                               c.height, 0.5 * c.height * calibration_.line_delay, &solved);
  });
  return status == SolveStatus::kOk ? solved.inliers : 0;
}

void OeStages::find_visible(const ViewProjection& view) {
  const Camera<double>& c = calibration_.camera;
  const LandmarkMap& map = mode_.map();
  const double cosine =
      std::cos(1.3 * std::atan(std::hypot(c.width, c.height) / 2 / c.focal_length));
  seen_.clear();
  const int near = map.find(view.optical_axis(), cosine, slots_.data(), map.capacity());
  for (int i = 0; i < near; ++i) {
    const Landmark& landmark = map.at(slots_[static_cast<std::size_t>(i)]);
    const double border = std::ldexp(8, landmark.octave);
    Vector2<double> u;
    if (view.project(landmark.d, &u) && u.x() >= border && u.y() >= border &&
        u.x() <= c.width - border && u.y() <= c.height - border) {
      seen_.push_back({&landmark, u});
    }
  }
}

// Coarse ones from the coarsest octave down, up to kCoarse of each, and as many fine ones as asked for.
void OeStages::prepare_patches(const ViewProjection& view) {
  patches_.clear();
  coarse_.clear();
  fine_.clear();
  for (int octave = kOctaves - 1; octave >= 0; --octave) {
    std::size_t taken = 0;
    for (const Seen& seen : seen_) {
      const Landmark& landmark = *seen.landmark;
      SeenDirection direction;
      const bool enough = octave >= kFirstCoarse ? taken == kCoarse : fine_.size() == points_;
      if (landmark.octave != octave || enough || !view.project(landmark.d, &direction)) continue;
      const Matrix2<double> J = std::ldexp(1, -octave) * direction.J_d * tangent_basis(landmark.d);
      patches_.emplace_back();
      if (!is_usable(prepare(landmark.picture(), Vector2<double>::Constant(kReferenceCentre),
                             landmark.J_pixel_tangent * J.inverse(), 1, &patches_.back()))) {
        patches_.pop_back();
        continue;
      }
      ++taken;
      if (octave >= kFirstCoarse) {
        coarse_.push_back({&patches_.back(), octave, direction.u, direction.J_angle});
      } else {
        fine_.push_back({&landmark, &patches_.back()});
      }
    }
  }
}

void OeStages::align_landmarks(const ViewProjection& view) {
  found_.clear();
  for (const auto& [landmark, patch] : fine_) {
    SeenDirection seen;
    Alignment alignment;
    const double to_octave = std::ldexp(1, -landmark->octave);
    if (!view.project(landmark->d, &seen) ||
        align(*patch, pyramid_.octave(landmark->octave), to_octave * seen.u, {}, &alignment) !=
            AlignmentStatus::kConverged) {
      continue;
    }
    const Matrix2<double> J = seen.J_d * tangent_basis(landmark->d);
    FoundLandmark found;
    found.u = alignment.position / to_octave;
    found.residual = found.u - seen.u;
    found.J_angle = seen.J_angle;
    found.time_s = seen.time_s;
    found.covariance =
        alignment.covariance / (to_octave * to_octave) + J * landmark->covariance * J.transpose();
    found.shared_covariance = landmark->shared_covariance;
    found_.push_back(found);
  }
}

}  // namespace alidade::benchmarks
