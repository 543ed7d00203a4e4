#include "core/detection/motion_detector.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/detection/spline_image.h"
#include "core/detection/target_pieces.h"
#include "core/detection/uncovered_places.h"

namespace alidade {
namespace {

// Variance of white noise smoothed by the B-spline, at pixel centres and, on average, between them.
constexpr double kSplineNoiseHere = 0.25;
constexpr double kSplineNoiseBetween = 0.23;
constexpr double kSplineNoise = kSplineNoiseHere + kSplineNoiseBetween;
// Least samples of a match.
constexpr int kLeastSamples = 50;
constexpr double kLeastGain = 0.5;
// Least |z| (in its units) of a row in a tile for which further pictures are compared. A region
// needs 2.3 sigmas on average.
constexpr float kLeastAsked = 2.5F * ChangeRegions::kUnit;
constexpr float kMostZ = 2000;
// Least |S| (sigmas) of a box against the recent picture, and the margin around a box.
constexpr double kLeastRecent = 4;
constexpr int kAboutBox_px = 2;

}  // namespace

const char* to_string(MotionStatus status) {
  switch (status) {
    case MotionStatus::kOk:
      return "ok";
    case MotionStatus::kWrongImage:
      return "no picture, or a picture of another size";
    case MotionStatus::kNoOrientation:
      return "no orientation";
    case MotionStatus::kNotNewer:
      return "the picture is not newer than the one before";
    case MotionStatus::kBlurred:
      return "the picture is blurred by the camera's motion";
    case MotionStatus::kTooLittleOverlap:
      return "too little of the picture was seen before";
    case MotionStatus::kNotExplained:
      return "the whole picture differs from what was seen before";
  }
  return "unknown status";
}

bool MotionOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(most_changed > 0 && most_changed <= 1))
    problem = "most_changed must be above 0 and at most 1";
  if (!(least_covered > 0 && least_covered <= 1)) {
    problem = "least_covered must be above 0 and at most 1";
  }
  if (!(most_spread >= 1)) problem = "most_spread must be at least 1";
  if (!(most_shift_px > 0)) problem = "most_shift_px must be positive";
  if (!(most_zoom >= 0 && most_zoom <= 0.3)) problem = "most_zoom must be 0 to 0.3";
  if (!(most_blur_px > 0)) problem = "most_blur_px must be positive";
  if (!(exposure_s >= 0 && exposure_s <= 1)) problem = "exposure_s must be 0 to 1";
  if (!(sigma_blur_px2 >= 0)) problem = "sigma_blur_px2 must not be negative";
  if (!(sigma_alignment_px >= 0)) problem = "sigma_alignment_px must not be negative";
  if (!(spacing_s >= 0 && spacing_s <= 60)) problem = "spacing_s must be 0 to 60";
  if (!(width >= 64 && height >= 64 && width <= 16384 && height <= 16384)) {
    problem = "width and height must be 64 to 16384 px";
  }
  const char* of_change = nullptr;
  if (!change.validate(&of_change)) problem = of_change;
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

MotionDetector::MotionDetector(const MotionOptions& options)
    : options_(options),
      distance_(options.width, options.height),
      earlier_(options.width, options.height, options.spacing_s),
      warp_(options.width, options.height),
      noise_(RunningNoiseOptions{}),
      regions_(options.width, options.height, options.change) {
  boxes_.reserve(static_cast<std::size_t>(options.change.most_boxes));
  // A tile at the right may extend beyond its row.
  smooth_pixels_ =
      static_cast<std::size_t>(options.width) * static_cast<std::size_t>(options.height);
  smooth_.resize(smooth_pixels_ + kTile + 1);
  for (Compared& compared : compared_) compared.corners.resize(warp_.corners());
  const auto tiles =
      static_cast<std::size_t>(warp_.columns()) * static_cast<std::size_t>(warp_.rows());
  tiles_.resize(tiles);
  scratch_.resize(tiles);
  const auto side =
      static_cast<std::size_t>(std::ceil(std::min(options.change.most_size_px, 20000.0))) +
      2 * kAboutBox_px + 2;
  piece_.resize(std::min(side, static_cast<std::size_t>(options.width)) *
                std::min(side, static_cast<std::size_t>(options.height)));
}

void MotionDetector::forget() {
  earlier_.clear();
  boxes_.clear();
  first_ = true;
}

MotionStatus MotionDetector::check(const ImageView& image,
                                   const FrameOrientation& orientation) const {
  if (!image.valid() || image.width != options_.width || image.height != options_.height) {
    return MotionStatus::kWrongImage;
  }
  const Camera<double>& camera = orientation.calibration.camera;
  if (camera.width != image.width || camera.height != image.height) {
    return MotionStatus::kWrongImage;
  }
  if (orientation.mode == OrientationMode::kNone || !std::isfinite(orientation.time_s) ||
      !all_finite(orientation.R_base_from_camera) || !all_finite(orientation.angular_velocity) ||
      !(camera.focal_length > 0) || !std::isfinite(camera.focal_length)) {
    return MotionStatus::kNoOrientation;
  }
  if (!earlier_.after_all(orientation.time_s)) return MotionStatus::kNotNewer;
  if (blur_px(orientation) > options_.most_blur_px) return MotionStatus::kBlurred;
  return MotionStatus::kOk;
}

// px, in the picture's middle, along its motion.
double MotionDetector::blur_px(const FrameOrientation& orientation) const {
  return orientation.angular_velocity.head<2>().norm() *
         orientation.calibration.camera.focal_length * options_.exposure_s;
}

void MotionDetector::warp_earlier(const FrameOrientation& orientation) {
  earlier_.order_for(orientation.time_s);
  for (int i = 0; i < earlier_.size(); ++i) {
    Compared& compared = compared_[static_cast<std::size_t>(i)];
    const FrameOrientation& then = earlier_.preferred(i).orientation;
    const double zoom = std::log(then.calibration.camera.focal_length /
                                 orientation.calibration.camera.focal_length);
    compared.match = FrameMatch();
    compared.matched = false;
    compared.usable = std::abs(zoom) <= options_.most_zoom && warp_.to(then, &compared.corners);
  }
}

// Chooses for each tile the frames that show all of it, then those that show a part. Returns the
// share of the picture that has enough of them.
double MotionDetector::choose_tiles() {
  for (Compared& compared : compared_) compared.chosen = false;
  const int columns = warp_.columns();
  int covered = 0;
  std::size_t next = 0;
  for (int row = 0; row < warp_.rows(); ++row) {
    const double r = row_place(kTile * row + kTile / 2, options_.height);
    for (int column = 0; column < columns; ++column) {
      TileChoice& tile = tiles_[next++];
      tile.count = 0;
      std::array<TileSight, EarlierFrames::kMost> sights{};
      for (const TileSight wanted : {TileSight::kAll, TileSight::kPart}) {
        for (int k = 0; k < earlier_.size() && tile.count < kCompared; ++k) {
          Compared& compared = compared_[static_cast<std::size_t>(k)];
          if (!compared.usable) continue;
          TileSight& sight = sights[static_cast<std::size_t>(k)];
          if (wanted == TileSight::kAll) {
            const TileCorner* upper =
                compared.corners.data() + static_cast<std::ptrdiff_t>(row) * (columns + 1) + column;
            sight = tile_sight(upper, upper + columns + 1, compared.match.shift_at(r),
                               options_.width, options_.height);
          }
          if (sight != wanted) continue;
          tile.which[tile.count++] = static_cast<std::uint8_t>(k);
          compared.chosen = true;
        }
        if (wanted == TileSight::kAll && tile.count >= 2) break;
      }
      if (tile.count >= 2) ++covered;
    }
  }
  if (earlier_.first_recent() < earlier_.size()) {
    Compared& recent = compared_[static_cast<std::size_t>(earlier_.first_recent())];
    recent.chosen = recent.usable;
  }
  return static_cast<double>(covered) / static_cast<double>(tiles_.size());
}

// Matches the chosen frames that are not matched yet. False: one of them cannot be used, so tiles
// must choose again.
bool MotionDetector::match_chosen(const FrameOrientation& orientation, MotionAnswer* answer) {
  const double noise = noise_.sigma();
  const double blur = blur_px(orientation);
  const SmoothedView now{smooth_.data(), options_.width, options_.height};
  bool all_usable = true;
  for (int i = 0; i < earlier_.size(); ++i) {
    Compared& compared = compared_[static_cast<std::size_t>(i)];
    if (!compared.chosen || compared.matched) continue;
    compared.matched = true;
    // A line of length L has the variance L^2 / 12.
    const double blur_then = blur_px(earlier_.preferred(i).orientation);
    const double blur_change =
        options_.sigma_blur_px2 + std::abs(blur * blur - blur_then * blur_then) / 24;
    DifferenceModel& model = compared.model;
    model.noise_square = static_cast<float>(kSplineNoise * noise * noise);
    model.shift_square =
        static_cast<float>(options_.sigma_alignment_px * options_.sigma_alignment_px);
    model.blur_square = static_cast<float>(blur_change * blur_change);
    const FrameMatch match = match_frames(now, earlier_.view(i), compared.corners, warp_.columns(),
                                          warp_.rows(), model, &scratch_);
    compared.match = match;
    const double shift = match.largest_shift();
    answer->spread = std::max(answer->spread, match.spread);
    answer->shift_px = std::max(answer->shift_px, shift);
    compared.usable = match.samples >= kLeastSamples && shift <= options_.most_shift_px &&
                      match.spread <= options_.most_spread && match.gain > kLeastGain &&
                      match.gain < 1 / kLeastGain;
    compared.scale = static_cast<float>(ChangeRegions::kUnit / std::max(1.0, match.spread));
    all_usable = all_usable && compared.usable;
  }
  return all_usable;
}

void MotionDetector::compare_row(int which, int column, int row, int v, TileRow* z) const {
  const Compared& compared = compared_[static_cast<std::size_t>(which)];
  const ImageView then = earlier_.view(which);
  const TileCorner* upper =
      compared.corners.data() + static_cast<std::ptrdiff_t>(row) * (warp_.columns() + 1) + column;
  const TileCorner* lower = upper + warp_.columns() + 1;
  const float t = (static_cast<float>(v - kTile * row) + 0.5F) / kTile;
  const Vector2<double> shift = compared.match.shift_at(row_place(v, options_.height));
  const auto shift_u = static_cast<float>(shift.x());
  const auto shift_v = static_cast<float>(shift.y());
  const TileCorner from{(1 - t) * upper[0].u + t * lower[0].u + shift_u,
                        (1 - t) * upper[0].v + t * lower[0].v + shift_v};
  const TileCorner step{((1 - t) * upper[1].u + t * lower[1].u + shift_u - from.u) / kTile,
                        ((1 - t) * upper[1].v + t * lower[1].v + shift_v - from.v) / kTile};
  const float most_u = static_cast<float>(options_.width) - kSplineMargin;
  const float most_v = static_cast<float>(options_.height) - kSplineMargin;
  TileRow seen;
  TileRow square;  // of the distance from the earlier picture's middle
  TileRow there;   // 1; 0 if it is not in the earlier picture
  for (int i = 0; i < kTile; ++i) {
    const float s = static_cast<float>(i) + 0.5F;
    const float u = from.u + s * step.u;
    const float w = from.v + s * step.v;
    const float held_u = std::min(std::max(u, kSplineMargin), most_u);
    const float held_v = std::min(std::max(w, kSplineMargin), most_v);
    const auto at = static_cast<std::size_t>(i);
    there[at] = held_u == u && held_v == w ? 1.0F : 0.0F;
    seen[at] = spline_value(then, held_u, held_v);
    square[at] = distance_.square(u, w);
  }
  const SmoothedView now{smooth_.data(), options_.width, options_.height};
  const int left = kTile * column;
  const std::uint16_t* above = now.row(v - 1) + left;
  const std::uint16_t* here = now.row(v) + left;
  const std::uint16_t* below = now.row(v + 1) + left;
  const auto gain = static_cast<float>(compared.match.gain);
  const auto falloff = static_cast<float>(compared.match.falloff);
  const auto offset = static_cast<float>(compared.match.offset);
  constexpr float kUnit = 1.0F / kSmoothUnit;
  // Beyond the picture's sides this reads pixels of other rows, and the results are not used.
  for (int i = 0; i < kTile; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const float light = gain *
                        (1 + falloff * distance_.square(static_cast<float>(left + i) + 0.5F,
                                                        static_cast<float>(v) + 0.5F)) /
                        (1 + falloff * square[at]);
    const float difference = kUnit * static_cast<float>(here[i]) - light * seen[at] - offset;
    (*z)[at] = there[at] * compared.scale * difference /
               std::sqrt(compared.model.variance(above, here, below, i));
  }
}

void MotionDetector::compare_tile(int column, int row) {
  const TileChoice& tile = tiles_[static_cast<std::size_t>(row * warp_.columns() + column)];
  const int left = std::max(kTile * column, 1);
  const int right = std::min(kTile * (column + 1), options_.width - 1);
  const int top = std::max(kTile * row, 1);
  const int bottom = std::min(kTile * (row + 1), options_.height - 1);
  for (int v = top; v < bottom; ++v) {
    std::int16_t* out = regions_.z() + static_cast<std::ptrdiff_t>(v) * options_.width;
    TileRow least{};
    bool any = true;
    // If nothing in the row differs from one of them, the others are not compared.
    for (int k = 0; k < tile.count && any; ++k) {
      TileRow z;
      compare_row(tile.which[static_cast<std::size_t>(k)], column, row, v, &z);
      float most = 0;
      for (std::size_t i = 0; i < kTile; ++i) {
        const float of_both = std::abs(z[i]) < std::abs(least[i]) ? z[i] : least[i];
        least[i] = k == 0 ? z[i] : (z[i] * least[i] > 0 ? of_both : 0.0F);
        most = std::max(most, std::abs(least[i]));
      }
      any = most >= kLeastAsked;
    }
    for (int u = left; u < right; ++u) {
      const float z = any ? least[static_cast<std::size_t>(u - kTile * column)] : 0.0F;
      out[u] = static_cast<std::int16_t>(std::min(std::max(z, -kMostZ), kMostZ));
    }
  }
}

// True also if it cannot be decided.
bool MotionDetector::differs_from_recent(const DetectionBox& box) {
  const int which = earlier_.first_recent();
  const Compared& recent = compared_[static_cast<std::size_t>(which)];
  if (!recent.usable) return true;
  const int left = std::max(static_cast<int>(box.u) - kAboutBox_px, 1);
  const int top = std::max(static_cast<int>(box.v) - kAboutBox_px, 1);
  const int right =
      std::min(static_cast<int>(box.u + box.width) + kAboutBox_px, options_.width - 1);
  const int bottom =
      std::min(static_cast<int>(box.v + box.height) + kAboutBox_px, options_.height - 1);
  const int columns = warp_.columns();
  for (int v = top; v < bottom; ++v) {
    const int row = v / kTile;
    const Vector2<double> shift = recent.match.shift_at(row_place(v, options_.height));
    for (int column = left / kTile; column * kTile < right; ++column) {
      const TileCorner* upper =
          recent.corners.data() + static_cast<std::ptrdiff_t>(row) * (columns + 1) + column;
      if (tile_sight(upper, upper + columns + 1, shift, options_.width, options_.height) !=
          TileSight::kAll) {
        return true;
      }
      TileRow z;
      compare_row(which, column, row, v, &z);
      for (int i = 0; i < kTile; ++i) {
        const int u = kTile * column + i;
        if (u < left || u >= right) continue;
        piece_[static_cast<std::size_t>((v - top) * (right - left) + u - left)] =
            static_cast<std::int16_t>(
                std::min(std::max(z[static_cast<std::size_t>(i)], -kMostZ), kMostZ));
      }
    }
  }
  return largest_sum(piece_.data(), right - left, bottom - top) >= kLeastRecent;
}

MotionAnswer MotionDetector::find(const ImageView& image, const FrameOrientation& orientation) {
  boxes_.clear();
  MotionAnswer answer;
  answer.status = check(image, orientation);
  if (answer.status != MotionStatus::kOk) return answer;
  if (!warp_.look(orientation)) {
    answer.status = MotionStatus::kNoOrientation;
    return answer;
  }
  noise_.learn(image, first_);
  first_ = false;
  smooth_image(image, smooth_.data());
  warp_earlier(orientation);
  const double seen_before = choose_tiles();
  while (!match_chosen(orientation, &answer)) answer.covered = choose_tiles();
  answer.covered = choose_tiles();
  if (answer.covered >= options_.least_covered) {
    std::fill_n(regions_.z(), smooth_pixels_, std::int16_t{0});
    std::size_t next = 0;
    for (int row = 0; row < warp_.rows(); ++row) {
      for (int column = 0; column < warp_.columns(); ++column) {
        if (tiles_[next++].count >= 2) compare_tile(column, row);
      }
    }
    const bool found = regions_.find();
    answer.changed = regions_.changed();
    if (found && answer.changed <= options_.most_changed) {
      for (const DetectionBox& box : regions_.boxes()) {
        if (differs_from_recent(box)) boxes_.push_back(box);
      }
      const SmoothedView now{smooth_.data(), options_.width, options_.height};
      drop_uncovered_places(now, regions_.z(), &boxes_);
      join_target_pieces(now, regions_.z(), noise_.sigma() * std::sqrt(kSplineNoise),
                         options_.change, &boxes_);
    } else {
      answer.status = MotionStatus::kNotExplained;
    }
  } else {
    answer.status = seen_before >= options_.least_covered ? MotionStatus::kNotExplained
                                                          : MotionStatus::kTooLittleOverlap;
  }
  earlier_.add(image, orientation);
  return answer;
}

std::size_t MotionDetector::memory_bytes() const {
  return earlier_.memory_bytes() + noise_.memory_bytes() + regions_.memory_bytes() +
         (smooth_.size() + piece_.size()) * sizeof(std::uint16_t) +
         compared_.size() * warp_.corners() * sizeof(TileCorner) +
         tiles_.size() * (sizeof(TileChoice) + sizeof(float));
}

}  // namespace alidade
