#include "core/realtime/start_up/start_up_tracker.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>

#include "core/realtime/image/image_noise.h"
#include "core/realtime/image/patch_alignment.h"

namespace alidade {
namespace {

constexpr int kMinWidth = 64;              // px
constexpr int kMinHeight = 32;             // px
constexpr int kSmallestOctave = 64;        // px, its longer side at most
constexpr int kDetailRadius = 2;           // px of that octave; coarser brightness is removed
constexpr double kLargestShift = 1.0 / 3;  // of the image
constexpr double kLeastLikeness = 0.1;     // correlation of two frames at the best shift

// Noise alone shows gradients of 0.5 sigma. A new point needs four times that.
constexpr double kContrastOfNoise = 2;
constexpr double kLeastContrast = 3;  // grey levels / px
constexpr double kStepContrast = 2;   // grey levels / px, of a patch of the previous frame
constexpr double kLeastCorrelation = 0.9;
constexpr double kMaxDeformation = 0.7;  // Frobenius norm of the warp minus identity
constexpr int kMaxMisses = 2;
constexpr double kFlowSigma = 0.05;  // px of the octave at hand
// Limits of the distance from the smooth motion, in sigmas of all residuals and of the point's own.
constexpr double kMaxDeviations = 5;
constexpr double kMaxOwnDeviations = 4;
constexpr double kMemory = 0.9;  // of former distances, from frame to frame
constexpr int kMinBelieved = 4;
constexpr int kMinMedian = 10;     // values
constexpr double kSpacing = 0.75;  // of a cell, between an old point and a new one

int octaves_for(int width, int height) {
  int octaves = 2;
  while (std::max(width, height) >> (octaves - 1) > kSmallestOctave &&
         octaves < Pyramid::kMaxOctaves) {
    ++octaves;
  }
  return octaves;
}

int cell_size_for(const StartUpOptions& options) {
  const double area = static_cast<double>(options.width) * options.height;
  return std::max(16, static_cast<int>(std::sqrt(area / std::max(options.max_points, 1))));
}

}  // namespace

StartUpTracker::Frame::Frame(int width, int height, int octaves)
    : pyramid(width, height, octaves),
      detail(static_cast<std::size_t>(std::max(width >> (octaves - 1), 0)) *
             static_cast<std::size_t>(std::max(height >> (octaves - 1), 0))) {}

StartUpTracker::StartUpTracker(const StartUpOptions& options)
    : options_(options),
      octaves_(octaves_for(options.width, options.height)),
      frames_{Frame(options.width, options.height, octaves_),
              Frame(options.width, options.height, octaves_)},
      flow_(options.width, options.height, options.max_points),
      points_(static_cast<std::size_t>(std::max(options.max_points, 0))),
      samples_(points_.size()),
      spacing_(kSpacing * cell_size_for(options)),
      corners_of_octave_{
          FastGrid(options.width, options.height, cell_size_for(options)),
          FastGrid(options.width / 2, options.height / 2, cell_size_for(options) / 2)},
      corners_(static_cast<std::size_t>(
          std::max(corners_of_octave_[0].max_cells(), corners_of_octave_[1].max_cells()))),
      scratch_(std::max<std::size_t>(4096, points_.size())),
      observations_(points_.size()) {}

std::size_t StartUpTracker::memory_bytes() const {
  return sizeof(*this) + frames_[0].pyramid.memory_bytes() + frames_[1].pyramid.memory_bytes() +
         2 * frames_[0].detail.size() * sizeof(std::int16_t) + points_.size() * sizeof(Point) +
         samples_.size() * (sizeof(FlowSample) + 2 * sizeof(double)) +
         corners_.size() * sizeof(FastCorner) * 2 + scratch_.size() * sizeof(float) +
         observations_.size() * sizeof(TrackObservation);
}

StartUpStatus StartUpTracker::process(const ImageView& image) {
  statistics_ = {};
  observation_count_ = 0;
  Frame& now = frames_[static_cast<std::size_t>(current_)];
  const Frame& before = frames_[static_cast<std::size_t>(1 - current_)];
  if (!image.valid() || image.width != options_.width || image.height != options_.height ||
      image.width < kMinWidth || image.height < kMinHeight ||
      now.pyramid.build(image, octaves_) != PyramidStatus::kOk) {
    return statistics_.status = StartUpStatus::kBadImage;
  }
  make_detail(&now);

  const bool had_points = point_count_ > 0;
  if (have_before_ && had_points) {
    if (follow(before, now)) {
      lost_frames_ = 0;
    } else if (++lost_frames_ < kMaxMisses) {
      return statistics_.status = StartUpStatus::kLost;
    } else {
      statistics_.ended += point_count_;
      point_count_ = 0;
      lost_frames_ = 0;
    }
  }
  const bool followed = point_count_ > 0;
  estimate_noise(now);
  end_points();
  begin_points(now);
  current_ = 1 - current_;
  have_before_ = true;
  return statistics_.status = followed           ? StartUpStatus::kOk
                              : point_count_ > 0 ? StartUpStatus::kBegun
                                                 : StartUpStatus::kBlank;
}

// Without this, vignetting and a bright sky would decide which shift fits best.
void StartUpTracker::make_detail(Frame* frame) const {
  const ImageView& image = frame->pyramid.octave(frame->pyramid.octaves() - 1);
  for (int v = 0; v < image.height; ++v) {
    const int top = std::max(v - kDetailRadius, 0);
    const int bottom = std::min(v + kDetailRadius, image.height - 1);
    for (int u = 0; u < image.width; ++u) {
      const int left = std::max(u - kDetailRadius, 0);
      const int right = std::min(u + kDetailRadius, image.width - 1);
      int sum = 0;
      for (int j = top; j <= bottom; ++j) {
        for (int i = left; i <= right; ++i) sum += image.row(j)[i];
      }
      const int area = (bottom - top + 1) * (right - left + 1);
      frame->detail[static_cast<std::size_t>(v * image.width + u)] =
          static_cast<std::int16_t>(image.row(v)[u] - sum / area);
    }
  }
}

bool StartUpTracker::find_shift(const Frame& before, const Frame& now,
                                Vector2<double>* shift) const {
  const int octave = octaves_ - 1;
  const int width = now.pyramid.octave(octave).width;
  const int height = now.pyramid.octave(octave).height;
  const int max_u = static_cast<int>(kLargestShift * width);
  const int max_v = static_cast<int>(kLargestShift * height);
  double best = kLeastLikeness;
  bool any = false;
  for (int dv = -max_v; dv <= max_v; ++dv) {
    for (int du = -max_u; du <= max_u; ++du) {
      const int columns = width - std::abs(du);
      std::int64_t product = 0;
      std::int64_t square_before = 0;
      std::int64_t square_now = 0;
      for (int v = std::max(0, -dv); v < height - std::max(0, dv); ++v) {
        const std::int16_t* a = before.detail.data() + v * width + std::max(0, -du);
        const std::int16_t* b = now.detail.data() + (v + dv) * width + std::max(0, du);
        int row_product = 0;
        int row_before = 0;
        int row_now = 0;
        for (int i = 0; i < columns; ++i) {
          row_product += a[i] * b[i];
          row_before += a[i] * a[i];
          row_now += b[i] * b[i];
        }
        product += row_product;
        square_before += row_before;
        square_now += row_now;
      }
      const double energy =
          std::sqrt(static_cast<double>(square_before) * static_cast<double>(square_now));
      if (!(static_cast<double>(product) > best * energy)) continue;
      best = static_cast<double>(product) / energy;
      *shift = std::ldexp(1.0, octave) * Vector2<double>(du, dv);
      any = true;
    }
  }
  return any;
}

bool StartUpTracker::follow(const Frame& before, const Frame& now) {
  Vector2<double> shift;
  if (!find_shift(before, now, &shift)) return false;
  flow_.set_uniform(shift);
  AlignmentLimits limits;
  limits.max_move = 3;
  limits.converged_step = 0.02;
  ReferencePatch reference;
  Alignment alignment;
  for (int octave = octaves_ - 1; octave >= 1; --octave) {
    const double scale = std::ldexp(1.0, octave);
    int count = 0;
    for (int i = 0; i < point_count_; ++i) {
      const Point& point = points_[static_cast<std::size_t>(i)];
      if (prepare(before.pyramid.octave(octave), point.u / scale, Matrix2<double>::Identity(),
                  kStepContrast, &reference) != PrepareStatus::kOk ||
          align(reference, now.pyramid.octave(octave), (point.u + flow_.at(point.u)) / scale,
                limits, &alignment) != AlignmentStatus::kConverged) {
        continue;
      }
      samples_[static_cast<std::size_t>(count++)] = {point.u, scale * alignment.position - point.u};
    }
    (void)flow_.fit(samples_.data(), count, scale * kFlowSigma);
  }
  statistics_.shift = flow_.at({0.5 * options_.width, 0.5 * options_.height});
  align_with_first(now);
  return statistics_.believed >= kMinBelieved && 4 * statistics_.believed >= statistics_.looked_for;
}

void StartUpTracker::align_with_first(const Frame& now) {
  AlignmentLimits limits;
  limits.max_move = 3;
  limits.min_correlation = kLeastCorrelation;
  ReferencePatch reference;
  Alignment alignment;
  int count = 0;
  for (int i = 0; i < point_count_; ++i) {
    Point& point = points_[static_cast<std::size_t>(i)];
    const double scale = std::ldexp(1.0, point.octave);
    const ImageView& image = now.pyramid.octave(point.octave);
    const ImageView first = view_of(point.pixels);
    point.predicted = point.u + flow_.at(point.u);
    point.is_found = false;
    const Matrix2<double> J =
        (Matrix2<double>::Identity() + flow_.gradient(point.u)) * point.J_now_first;
    if (!((J - Matrix2<double>::Identity()).norm() < kMaxDeformation)) {
      point.misses = kMaxMisses;
      continue;
    }
    ++statistics_.looked_for;
    if (prepare(first, {kReferenceCentre, kReferenceCentre}, J.inverse(), 0.5 * kLeastContrast,
                &reference) != PrepareStatus::kOk) {
      continue;
    }
    const AlignmentStatus status =
        align(reference, image, point.predicted / scale, limits, &alignment);
    if (status == AlignmentStatus::kOutOfImage) {
      point.misses = kMaxMisses;
      --statistics_.looked_for;
    }
    if (status != AlignmentStatus::kConverged) continue;
    point.is_found = true;
    point.found = scale * alignment.position;
    // The alignment's covariance contains the noise of both images. Keep that of this frame.
    const double own = 1 / (1 + alignment.gain * alignment.gain);
    point.covariance = own * scale * scale * alignment.covariance;
    point.noise = static_cast<float>(std::sqrt(own) * alignment.noise_sigma);
    samples_[static_cast<std::size_t>(count++)] = {point.u, point.found - point.u};
  }
  statistics_.found = count;
  const double left_over = flow_.fit(samples_.data(), count, kFlowSigma);
  for (int i = 0; i < point_count_; ++i) {
    Point& point = points_[static_cast<std::size_t>(i)];
    point.predicted = point.u + flow_.at(point.u);
    if (!point.is_found) continue;
    const double limit =
        kMaxDeviations * left_over + kMaxOwnDeviations * std::sqrt(0.5 * point.covariance.trace());
    const Vector2<double> deviation = point.found - point.predicted;
    point.deviation = kMemory * point.deviation + deviation;
    point.is_found = std::isfinite(left_over) && deviation.norm() < limit;
    // An object that moves by itself, slowly.
    if (!(point.deviation.norm() < 2 * limit)) {
      point.is_found = false;
      point.misses = kMaxMisses;
    }
    statistics_.believed += point.is_found;
  }
}

// From alignment residuals if there are enough points, else from the image.
void StartUpTracker::estimate_noise(const Frame& now) {
  for (int octave = 0; octave < kReferenceOctaves; ++octave) {
    std::ptrdiff_t count = 0;
    for (int i = 0; i < point_count_; ++i) {
      const Point& point = points_[static_cast<std::size_t>(i)];
      if (point.is_found && point.octave == octave)
        scratch_[static_cast<std::size_t>(count++)] = point.noise;
    }
    double& noise = noise_[static_cast<std::size_t>(octave)];
    if (count >= kMinMedian) {
      const auto middle = scratch_.begin() + count / 2;
      std::nth_element(scratch_.begin(), middle, scratch_.begin() + count);
      noise = *middle;
    } else {
      noise = image_noise(now.pyramid.octave(octave), scratch_.data(),
                          static_cast<int>(scratch_.size()));
    }
  }
  statistics_.noise = noise_[0];
}

// Moves the points to this frame and drops those that ended.
void StartUpTracker::end_points() {
  int kept = 0;
  for (int i = 0; i < point_count_; ++i) {
    Point& point = points_[static_cast<std::size_t>(i)];
    point.misses = point.is_found ? 0 : point.misses + 1;
    if (point.misses >= kMaxMisses) {
      ++statistics_.ended;
      continue;
    }
    point.J_now_first = (Matrix2<double>::Identity() + flow_.gradient(point.u)) * point.J_now_first;
    point.u = point.is_found ? point.found : point.predicted;
    if (point.is_found) observe(point, point.covariance);
    if (kept != i) points_[static_cast<std::size_t>(kept)] = point;
    ++kept;
  }
  point_count_ = kept;
}

void StartUpTracker::begin_points(const Frame& now) {
  constexpr int kHalf = kReferencePixels / 2;
  ReferencePatch reference;
  for (int octave = 0; octave < kReferenceOctaves; ++octave) {
    const ImageView& image = now.pyramid.octave(octave);
    const double noise = noise_[static_cast<std::size_t>(octave)];
    const double contrast = std::max(kLeastContrast, kContrastOfNoise * noise);
    const double threshold =
        std::clamp(3 * noise, static_cast<double>(options_.corner_threshold), 255.0);
    const FastResult result = corners_of_octave_[static_cast<std::size_t>(octave)].detect(
        image, static_cast<std::uint8_t>(threshold), corners_.data(),
        static_cast<int>(corners_.size()));
    const double scale = std::ldexp(1.0, octave);
    for (int i = 0; i < result.count; ++i) {
      if (point_count_ == static_cast<int>(points_.size())) return;
      const FastCorner& corner = corners_[static_cast<std::size_t>(i)];
      const Vector2<double> centre(corner.u + 0.5, corner.v + 0.5);
      const Vector2<double> u = scale * centre;
      const bool crowded = std::any_of(
          points_.begin(), points_.begin() + point_count_,
          [&](const Point& point) { return (point.u - u).squaredNorm() < spacing_ * spacing_; });
      if (crowded || corner.u < kHalf || corner.v < kHalf || corner.u + kHalf > image.width ||
          corner.v + kHalf > image.height ||
          prepare(image, centre, Matrix2<double>::Identity(), contrast, &reference) !=
              PrepareStatus::kOk) {
        continue;
      }
      Point& point = points_[static_cast<std::size_t>(point_count_++)];
      point.landmark = next_landmark_++;
      point.octave = octave;
      point.misses = 0;
      point.u = u;
      point.J_now_first.setIdentity();
      point.deviation.setZero();
      for (int row = 0; row < kReferencePixels; ++row) {
        std::memcpy(point.pixels.data() + row * kReferencePixels,
                    image.row(corner.v - kHalf + row) + corner.u - kHalf, kReferencePixels);
      }
      ++statistics_.begun;
      observe(point, noise * noise * scale * scale * reference.unit_covariance.cast<double>());
    }
  }
}

void StartUpTracker::observe(const Point& point, const Matrix2<double>& covariance) {
  observations_[static_cast<std::size_t>(observation_count_++)] = {
      point.landmark, point.u, covariance, std::sqrt(0.5 * covariance.trace())};
}

}  // namespace alidade
