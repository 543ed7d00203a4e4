#include "edge_app/verify/seen_frame.h"

#include <algorithm>
#include <cmath>

namespace alidade {
namespace {

constexpr std::size_t kMostFrames = 160;
constexpr std::size_t kMostBytes = std::size_t{256} << 20;
constexpr double kClearSigmas = 6;  // 4 sigmas of a difference of two angles

constexpr double kSettling_s = 1;  // until the clocks know the frames' times

bool is_clear(RecordStatus status) {
  return status == RecordStatus::kOk || status == RecordStatus::kClockWarmingUp;
}

// One axis: the way it turned last, by the farthest point so far.
void follow_axis(double angle, double clear, double* farthest, double* heading) {
  const double moved = angle - *farthest;
  if (*heading != 0 && moved * *heading >= 0) {
    *farthest = angle;
  } else if (std::abs(moved) > clear) {
    *heading = moved > 0 ? 1 : -1;
    *farthest = angle;
  }
}

}  // namespace

FrameCollection::FrameCollection(std::size_t frames, int width, int height, double angle_sigma_rad)
    : of_recording_(frames),
      wanted_(std::min({kMostFrames, frames,
                        kMostBytes / static_cast<std::size_t>(std::max(1, width * height))})),
      clear_rad_(kClearSigmas * angle_sigma_rad) {}

void FrameCollection::note_heading(const PanTilt<double>& angle) {
  if (!has_angle_) turned_from_ = angle;
  has_angle_ = true;
  follow_axis(angle.pan, clear_rad_, &turned_from_.pan, &heading_.pan);
  follow_axis(angle.tilt, clear_rad_, &turned_from_.tilt, &heading_.tilt);
}

void FrameCollection::add(const OrientationRecord& by_landmarks,
                          const OrientationRecord& by_telemetry,
                          const OrientationRecord& by_all_samples, const ImageView& image) {
  const std::size_t frame = next_++;
  if (!by_telemetry.orientation || !by_telemetry.time_s || !by_all_samples.orientation) return;
  SeenFrame seen;
  seen.by_telemetry = unpack(by_telemetry.orientation->geometry, by_telemetry.camera);
  seen.by_all_samples = unpack(by_all_samples.orientation->geometry, by_all_samples.camera);
  note_heading(seen.by_all_samples.angle);
  if (chosen_ >= wanted_ || frame < chosen_ * of_recording_ / wanted_) return;
  // A frame that cannot be used is replaced by the next one.
  const Camera<double>& camera = seen.by_telemetry.calibration.camera;
  if (!is_clear(by_telemetry.status) || !image.valid() || image.width != camera.width ||
      image.height != camera.height) {
    return;
  }
  if (!begin_s_) begin_s_ = *by_telemetry.time_s;
  if (*by_telemetry.time_s < *begin_s_ + kSettling_s) return;
  while (chosen_ < wanted_ && chosen_ * of_recording_ / wanted_ <= frame) ++chosen_;
  if (by_landmarks.mode == RecordMode::kOe && by_landmarks.orientation) {
    seen.by_landmarks = unpack(by_landmarks.orientation->geometry, by_landmarks.camera);
  }
  seen.time_s = *by_telemetry.time_s;
  seen.time_sigma_s = by_telemetry.time_sigma_s;
  seen.heading = heading_;
  seen.luma.resize(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height));
  for (int v = 0; v < image.height; ++v) {
    std::copy_n(image.row(v), image.width,
                seen.luma.begin() + static_cast<std::ptrdiff_t>(v) * image.width);
  }
  frames_.push_back(std::move(seen));
}

}  // namespace alidade
