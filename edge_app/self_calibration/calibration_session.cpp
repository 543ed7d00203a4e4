#include "edge_app/self_calibration/calibration_session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/model/angle.h"

namespace alidade {

void CalibrationSession::clear() {
  frames_.clear();
  images_.clear();
}

double CalibrationSession::span_s() const {
  return frames_.empty()
             ? 0
             : frames_.back().stamp.receive_time_s - frames_.front().stamp.receive_time_s;
}

double CalibrationSession::newest_s() const {
  return frames_.empty() ? 0 : frames_.back().stamp.receive_time_s;
}

void CalibrationSession::add(const FrameTracks& tracks) {
  KeptFrame frame{tracks.stamp, {}};
  // There is no reconnection within a session: its owner clears it at one.
  frame.stamp.restarted = false;
  frame.points.assign(tracks.points.begin(), tracks.points.begin() + tracks.count);
  frames_.push_back(std::move(frame));
  while (frames_.size() > limits_.max_frames || span_s() > limits_.window_s) frames_.pop_front();
  const double oldest_s = frames_.front().stamp.receive_time_s;
  while (!telemetry_.empty() &&
         telemetry_.front().latest_time_s < oldest_s - limits_.telemetry_margin_s) {
    telemetry_.pop_front();
  }
  images_.erase(std::remove_if(
                    images_.begin(), images_.end(),
                    [oldest_s](const KeptImage& image) { return image.receive_time_s < oldest_s; }),
                images_.end());
}

void CalibrationSession::add(const PanTiltSample& sample) {
  last_angle_ = {sample.pan_rad, sample.tilt_rad};
  if (sample.restarted) telemetry_.clear();
  telemetry_.push_back(sample);
  if (telemetry_.size() > limits_.max_samples) telemetry_.pop_front();
}

bool CalibrationSession::wants_keyframe(const Camera<double>& camera) const {
  if (frames_.empty() || telemetry_.empty()) return false;
  const double apart = limits_.keyframes_apart * camera.width / camera.focal_length;
  return std::all_of(images_.begin(), images_.end(), [&](const KeptImage& image) {
    const double pan = wrap_angle(image.pan - last_angle_.pan) * std::cos(image.tilt);
    return std::hypot(pan, image.tilt - last_angle_.tilt) > apart;
  });
}

void CalibrationSession::add_keyframe(const ImageView& image) {
  if (images_.size() >= limits_.max_keyframes) images_.erase(images_.begin());
  const FrameStamp& stamp = frames_.back().stamp;
  images_.push_back({stamp.frame, stamp.receive_time_s, last_angle_.pan, last_angle_.tilt,
                     std::make_shared<PackedImage>(image)});
  const auto bytes = [this] {
    std::size_t sum = 0;
    for (const KeptImage& kept : images_) sum += kept.image->bytes();
    return sum;
  };
  while (images_.size() > 1 && bytes() > limits_.max_keyframe_bytes) images_.erase(images_.begin());
}

template <class Visit>
void CalibrationSession::visit_angles(const Visit& visit) const {
  if (frames_.empty()) return;
  const double begin_s = frames_.front().stamp.receive_time_s;
  std::optional<double> pan;
  for (const PanTiltSample& sample : telemetry_) {
    if (sample.latest_time_s < begin_s || sample.latest_time_s > newest_s()) continue;
    pan = pan ? *pan + wrap_angle(sample.pan_rad - *pan) : sample.pan_rad;
    visit(sample.latest_time_s, PanTilt<double>{*pan, sample.tilt_rad});
  }
}

std::optional<AngleRange> CalibrationSession::angle_range() const {
  std::optional<AngleRange> range;
  visit_angles([&range](double, const PanTilt<double>& angle) {
    if (!range) range = AngleRange{angle, angle};
    range->least = {std::min(range->least.pan, angle.pan), std::min(range->least.tilt, angle.tilt)};
    range->largest = {std::max(range->largest.pan, angle.pan),
                      std::max(range->largest.tilt, angle.tilt)};
  });
  return range;
}

ViewCoverage CalibrationSession::coverage(int width, int height) const {
  ViewCoverage coverage;
  const auto cell = [](double at, int size, std::size_t cells) {
    const double place = std::floor(at / size * static_cast<double>(cells));
    return static_cast<std::size_t>(std::clamp(place, 0.0, static_cast<double>(cells - 1)));
  };
  for (const KeptFrame& frame : frames_) {
    for (const TrackedPoint& point : frame.points) {
      ++coverage.points[cell(point.v_px, height, ViewCoverage::kRows) * ViewCoverage::kColumns +
                        cell(point.u_px, width, ViewCoverage::kColumns)];
    }
  }
  coverage.range = angle_range();
  constexpr double kRateSpan_s = 0.2;  // shorter differences would show the noise
  std::deque<std::pair<double, PanTilt<double>>> latest;
  std::vector<PanTilt<double>> all;
  visit_angles([&](double time_s, const PanTilt<double>& angle) {
    all.push_back(angle);
    latest.emplace_back(time_s, angle);
    while (latest.size() > 1 && time_s - latest[1].first >= kRateSpan_s) latest.pop_front();
    const double span_s = time_s - latest.front().first;
    if (span_s < kRateSpan_s) return;
    const double turn = (angle.vector() - latest.front().second.vector()).norm();
    coverage.largest_rate = std::max(coverage.largest_rate, turn / span_s);
  });
  const std::size_t stride = (all.size() + ViewCoverage::kMostPath - 1) / ViewCoverage::kMostPath;
  for (std::size_t i = 0; i < all.size(); i += stride) coverage.path.push_back(all[i]);
  return coverage;
}

std::vector<FrameStamp> CalibrationSession::stamps() const {
  std::vector<FrameStamp> stamps;
  for (const KeptFrame& frame : frames_) stamps.push_back(frame.stamp);
  return stamps;
}

std::vector<PanTiltSample> CalibrationSession::telemetry() const {
  return {telemetry_.begin(), telemetry_.end()};
}

std::vector<CalibrationObservation> CalibrationSession::observations() const {
  std::size_t count = 0;
  for (const KeptFrame& frame : frames_) count += frame.points.size();
  std::vector<CalibrationObservation> observations;
  observations.reserve(count);
  for (const KeptFrame& frame : frames_) {
    for (const TrackedPoint& point : frame.points) {
      observations.push_back(
          {frame.stamp.frame, point.landmark, point.u_px, point.v_px, point.sigma_px});
    }
  }
  return observations;
}

bool CalibrationSession::is_held_out(std::size_t place) {
  constexpr std::size_t kEvery = 10;
  return place % kEvery == kEvery / 2;
}

FrameTimes CalibrationSession::frame_times(const CalibrationResult& result) const {
  FrameTimes time_of;
  for (const FrameResult& frame : result.frames) time_of[frame.frame] = frame.time_s;
  for (std::size_t i = 1; i + 1 < frames_.size(); ++i) {
    const FrameStamp& before = frames_[i - 1].stamp;
    const FrameStamp& after = frames_[i + 1].stamp;
    const FrameStamp& own = frames_[i].stamp;
    const auto from = time_of.find(before.frame);
    const auto to = time_of.find(after.frame);
    if (!is_held_out(i) || from == time_of.end() || to == time_of.end()) continue;
    double share = 0.5;
    if (before.sender_time_s && own.sender_time_s && after.sender_time_s) {
      share = (*own.sender_time_s - *before.sender_time_s) /
              (*after.sender_time_s - *before.sender_time_s);
    } else if (before.sequence && own.sequence && after.sequence) {
      share = static_cast<double>(*own.sequence - *before.sequence) /
              static_cast<double>(*after.sequence - *before.sequence);
    }
    if (share > 0 && share < 1)
      time_of[own.frame] = from->second + share * (to->second - from->second);
  }
  return time_of;
}

std::vector<Keyframe> CalibrationSession::keyframes(const CalibrationResult& result) const {
  const FrameTimes time_of = frame_times(result);
  std::vector<Keyframe> keyframes;
  for (const KeptImage& image : images_) {
    const auto time = time_of.find(image.frame);
    if (time == time_of.end()) continue;
    keyframes.push_back({time->second, image.image});
  }
  return keyframes;
}

}  // namespace alidade
