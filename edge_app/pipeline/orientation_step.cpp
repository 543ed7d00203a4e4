#include "edge_app/pipeline/orientation_step.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace alidade {
namespace {

OrientationRecord::Orientation to_record(const FrameOrientation& frame) {
  OrientationRecord::Orientation orientation;
  orientation.pan_rad = wrap_angle(frame.angle.pan);
  orientation.tilt_rad = wrap_angle(frame.angle.tilt);
  orientation.pan_rate_rad_s = frame.rate.pan;
  orientation.tilt_rate_rad_s = frame.rate.tilt;
  orientation.pan_acceleration_rad_s2 = frame.acceleration.pan;
  orientation.tilt_acceleration_rad_s2 = frame.acceleration.tilt;
  // q and -q are one rotation: the one with w >= 0 is written.
  const Eigen::Quaterniond q = frame.quaternion();
  const double sign = q.w() < 0 ? -1 : 1;
  orientation.q_base_from_camera = {sign * q.x(), sign * q.y(), sign * q.z(), sign * q.w()};
  for (std::size_t i = 0; i < orientation.sigma_rad.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    // Rounding may leave a zero variance negative.
    orientation.sigma_rad[i] = std::sqrt(std::max(frame.orientation_covariance(row, row), 0.0));
  }
  for (std::size_t i = 0; i < orientation.covariance_rad2.size(); ++i) {
    orientation.covariance_rad2[i] = frame.orientation_covariance(static_cast<Eigen::Index>(i / 3),
                                                                  static_cast<Eigen::Index>(i % 3));
  }
  orientation.geometry = pack(frame);
  return orientation;
}

// Why the answer is telemetry's, if it is.
RecordStatus to_record(OeStatus status) {
  switch (status) {
    case OeStatus::kOk:
      return RecordStatus::kOk;
    case OeStatus::kTooFew:
      return RecordStatus::kTooFewLandmarks;
    case OeStatus::kContradiction:
      return RecordStatus::kContradiction;
    case OeStatus::kBadImage:
      return RecordStatus::kBadImage;
    case OeStatus::kNoPrediction:
    case OeStatus::kNotFinite:
      break;
  }
  return RecordStatus::kNotFinite;
}

// Of those that held the result; px.
std::optional<double> residual_rms(const OeMode& oe) {
  double sum = 0;
  int count = 0;
  for (int i = 0; i < oe.statistics().aligned; ++i) {
    const OeObservation& seen = oe.observations()[i];
    if (!seen.inlier) continue;
    sum += observed_residual(seen).squaredNorm();
    ++count;
  }
  if (count == 0) return std::nullopt;
  return std::sqrt(sum / count);
}

}  // namespace

OeOptions oe_options(const Camera<double>& camera) {
  constexpr double kLeastColumns = 24;
  OeOptions options;
  options.max_width = camera.width;
  options.max_height = camera.height;
  options.maker.cell_size_px = std::min(options.maker.cell_size_px, camera.width / kLeastColumns);
  return options;
}

OrientationStep::OrientationStep(const OrientationStepOptions& options)
    : options_(options),
      video_clock_(options.video_clock),
      telemetry_clock_(options.telemetry_clock),
      telemetry_(empty_telemetry(false)) {
  if (!options.oe) return;
  OeOptions oe = *options.oe;
  oe.max_width = options.calibration.camera.width;
  oe.max_height = options.calibration.camera.height;
  oe_ = std::make_unique<OeMode>(oe);
  oe_->reset(options.calibration, options.map);
  if (!options.follow_points) return;
  StartUpOptions start_up;
  start_up.width = oe.max_width;
  start_up.height = oe.max_height;
  start_up.max_points = FrameTracks::kMaxPoints;
  start_up_ = std::make_unique<StartUpTracker>(start_up);
}

OrientationStep::Telemetry OrientationStep::empty_telemetry(bool filtered) const {
  // Filtered times share the error of their line; polled ones have each an error of its own, which a
  // bound beyond every stamp's sigma says.
  constexpr double kAllOwn = 1e3;  // s
  TelemetryNoise noise = options_.telemetry_noise;
  if (!filtered) noise.period_sigma_s = kAllOwn;
  return Telemetry(noise, options_.telemetry_limits);
}

void OrientationStep::add_telemetry(const PanTiltSample& sample) {
  const std::optional<ClockEstimate> clock = telemetry_clock_.update(
      sample.latest_time_s, sample.device_time_s, sample.sequence, sample.restarted);
  const bool filtered = clock.has_value();
  if (sample.restarted || filtered != telemetry_filtered_ || (clock && clock->restarted)) {
    telemetry_ = empty_telemetry(filtered);
    telemetry_filtered_ = filtered;
    if (oe_) oe_->forget_pending();
  }
  telemetry_lost_ = false;
  if (sample.zoom) {
    zoom_ = sample.zoom;
    if (!zoom_at_adoption_) zoom_at_adoption_ = sample.zoom;
  }

  TelemetrySample timed;
  timed.pan = sample.pan_rad;
  timed.tilt = sample.tilt_rad;
  const double width_s = sample.latest_time_s - sample.earliest_time_s;
  if (clock) {
    timed.time_s = clock->time_s;
    timed.time_sigma_s = clock->sigma_s;
  } else {
    timed.time_s = sample.latest_time_s - width_s / 2;
    timed.time_sigma_s = width_s > 0 ? width_s / std::sqrt(12.0) : options_.telemetry_stamp_sigma_s;
  }
  // What the buffer refuses (a duplicate, a value that is not finite) it counts, and the records'
  // sigma says the rest.
  static_cast<void>(telemetry_.push(timed));
  settle_pending_frames();
}

void OrientationStep::settle_pending_frames() {
  const std::optional<double> newest_s = telemetry_.newest_time();
  if (!oe_ || !newest_s) return;
  TelemetryLookUp look_up;
  while (oe_->pending(*newest_s, &look_up)) {
    InterpolatedPanTilt late;
    const QueryStatus query = telemetry_.query(look_up.time_s, look_up.time_sigma_s, &late);
    oe_->settle_pending(query == QueryStatus::kOk ? &late : nullptr);
  }
}

void OrientationStep::telemetry_lost() { telemetry_lost_ = true; }

void OrientationStep::adopt(const PublishedCalibration& published) {
  options_.calibration = published.calibration;
  options_.calibrated = published.calibrated;
  zoom_at_adoption_ = zoom_;
  floor_sigma_s_ = 0;
  if (oe_) oe_->reset(published.calibration, published.map);
}

bool OrientationStep::zoom_fits() const {
  const std::optional<double>& wanted =
      options_.calibration.zoom ? options_.calibration.zoom : zoom_at_adoption_;
  return !options_.calibrated || !zoom_ || !wanted ||
         std::abs(*zoom_ - *wanted) <= options_.zoom_tolerance;
}

OrientationRecord OrientationStep::empty_record() const {
  OrientationRecord record;
  record.calibrated = options_.calibrated && zoom_fits();
  record.camera = pack(options_.calibration);
  return record;
}

OrientationRecord OrientationStep::video_lost(double now_s) const {
  OrientationRecord record = empty_record();
  record.receive_time_s = now_s;
  record.status = RecordStatus::kVideoLost;
  return record;
}

OrientationRecord OrientationStep::add_frame(const FrameStamp& stamp, const ImageView& picture,
                                             StepEvents* events) {
  ClockEstimate clock;
  clock.time_s = stamp.receive_time_s;
  clock.sigma_s = options_.video_stamp_sigma_s;
  clock.state = ClockState::kLocked;
  clock = video_clock_
              .update(stamp.receive_time_s, stamp.sender_time_s, stamp.sequence, stamp.restarted)
              .value_or(clock);
  events->video_clock_restarted = clock.restarted;
  events->video_floor_shifted = clock.floor_shifted;
  if (clock.restarted || clock.floor_shifted) floor_sigma_s_ = options_.floor_sigma_s;
  picture_ = picture;
  tracks_.stamp = stamp;
  tracks_.time_s = clock.time_s;
  tracks_.clock_restarted = clock.restarted;
  tracks_.floor_shifted = clock.floor_shifted;
  tracks_.tracker = FrameTracks::Tracker::kNone;

  OrientationRecord record = empty_record();
  record.frame = stamp.frame;
  record.time_s = clock.time_s;
  record.receive_time_s = stamp.receive_time_s;
  const Calibration& calibration = options_.calibration;
  const double to_middle_row_s = calibration.line_delay * (0.5 * calibration.camera.height);
  InterpolatedPanTilt measured;
  const double telemetry_time_s = clock.time_s + calibration.clock_offset + to_middle_row_s;
  const double time_sigma_s = std::hypot(clock.sigma_s, floor_sigma_s_);
  const QueryStatus query = telemetry_.query(telemetry_time_s, time_sigma_s, &measured);
  record.time_sigma_s = time_sigma_s;
  record.clock_locked = clock.state == ClockState::kLocked;
  record.status = status_of(query, record.clock_locked);
  if (!zoom_fits()) {
    // Neither the lens nor the axes of another zoom are this one's.
    record.status = RecordStatus::kOtherZoom;
    return record;
  }
  orient(has_result(query) ? &measured : nullptr, picture, &record);
  return record;
}

void OrientationStep::orient(const InterpolatedPanTilt* measured, const ImageView& picture,
                             OrientationRecord* record) {
  FrameOrientation frame;
  if (finds_landmarks()) {
    const OeStatus status = oe_->process(picture, *record->time_s, measured, &frame);
    // That the frame's time is not yet known well, sigma says too.
    if (measured != nullptr && status != OeStatus::kOk) record->status = to_record(status);
  } else if (measured != nullptr) {
    // Where this fails the frame stays without orientation.
    static_cast<void>(pt_orientation(options_.calibration, *record->time_s, *measured, &frame));
  }
  if (frame.mode == OrientationMode::kNone) {
    if (measured != nullptr) record->status = RecordStatus::kNotFinite;
    return;
  }
  record->mode = frame.mode == OrientationMode::kOe ? RecordMode::kOe : RecordMode::kPt;
  record->landmarks = frame.landmarks;
  if (record->mode == RecordMode::kOe) record->residual_px = residual_rms(*oe_);
  record->orientation = to_record(frame);
}

void OrientationStep::maintain() {
  if (finds_landmarks()) {
    oe_->maintain();
    if (picture_.valid()) tracks_.tracker = FrameTracks::Tracker::kOe;
  } else if (start_up_ && picture_.valid()) {
    if (start_up_->process(picture_) != StartUpStatus::kBadImage)
      tracks_.tracker = FrameTracks::Tracker::kStartUp;
  }
  picture_ = {};
}

void OrientationStep::get_tracks(FrameTracks* tracks) const {
  *tracks = tracks_;
  const auto add = [tracks](std::uint32_t landmark, const Vector2<double>& u, double sigma) {
    if (tracks->count == FrameTracks::kMaxPoints) return;
    tracks->points[static_cast<std::size_t>(tracks->count++)] = {
        landmark, static_cast<float>(u.x()), static_cast<float>(u.y()), static_cast<float>(sigma)};
  };
  tracks->count = 0;
  if (tracks_.tracker == FrameTracks::Tracker::kStartUp) {
    tracks->looked_for = start_up_->statistics().looked_for;
    for (int i = 0; i < start_up_->observation_count(); ++i) {
      const TrackObservation& seen = start_up_->observations()[i];
      add(seen.landmark, seen.u, seen.sigma);
    }
  } else if (tracks_.tracker == FrameTracks::Tracker::kOe) {
    const OeStatistics& statistics = oe_->statistics();
    tracks->oe_status = statistics.status;
    tracks->looked_for = statistics.looked_for;
    for (int i = 0; statistics.status == OeStatus::kOk && i < statistics.aligned; ++i) {
      const OeObservation& seen = oe_->observations()[i];
      if (const auto sigma = track_sigma(seen)) add(seen.id, seen.u, *sigma);
    }
  }
}

void OrientationStep::get_landmarks(FrameLandmarks* landmarks) const {
  landmarks->kind = FrameLandmarks::Kind::kNone;
  landmarks->count = 0;
  const auto add = [landmarks](const Vector2<double>& u, const Vector2<double>& residual,
                               bool used) {
    if (landmarks->count == FrameLandmarks::kMaxSeen) return;
    landmarks->seen[static_cast<std::size_t>(landmarks->count++)] = {
        static_cast<float>(u.x()), static_cast<float>(u.y()), static_cast<float>(residual.x()),
        static_cast<float>(residual.y()), used};
  };
  if (tracks_.tracker == FrameTracks::Tracker::kStartUp) {
    landmarks->kind = FrameLandmarks::Kind::kPoints;
    for (int i = 0; i < start_up_->observation_count(); ++i) {
      add(start_up_->observations()[i].u, Vector2<double>::Zero(), true);
    }
  } else if (tracks_.tracker == FrameTracks::Tracker::kOe &&
             oe_->statistics().status == OeStatus::kOk) {
    landmarks->kind = FrameLandmarks::Kind::kLandmarks;
    for (int i = 0; i < oe_->statistics().aligned; ++i) {
      const OeObservation& seen = oe_->observations()[i];
      const Vector2<double> residual = observed_residual(seen);
      add(seen.u - residual, residual, seen.inlier);
    }
  }
}

RecordStatus OrientationStep::status_of(QueryStatus query, bool clock_locked) const {
  switch (query) {
    case QueryStatus::kOk:
    case QueryStatus::kExtrapolated:
      return clock_locked ? RecordStatus::kOk : RecordStatus::kClockWarmingUp;
    case QueryStatus::kEmpty:
    case QueryStatus::kOneSample:
      return telemetry_lost_ ? RecordStatus::kTelemetryLost : RecordStatus::kTelemetryMissing;
    case QueryStatus::kTooNew:
      return telemetry_lost_ ? RecordStatus::kTelemetryLost : RecordStatus::kTelemetryTooOld;
    case QueryStatus::kTooOld:
      return RecordStatus::kFrameBeforeTelemetry;
    case QueryStatus::kGap:
      return RecordStatus::kTelemetryGap;
    case QueryStatus::kNotFinite:
      break;
  }
  return RecordStatus::kNotFinite;
}

}  // namespace alidade
