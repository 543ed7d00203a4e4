#include "edge_app/step/orientation_step.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "edge_app/step/frame_observations.h"

namespace alidade {

OeOptions oe_options(const Camera<double>& camera) {
  constexpr double kLeastColumns = 24;
  OeOptions options;
  options.max_width = camera.width;
  options.max_height = camera.height;
  options.maker.cell_size_px =
      std::max(LandmarkMakerOptions::kLeastCellSize_px,
               std::min(options.maker.cell_size_px, camera.width / kLeastColumns));
  return options;
}

std::unique_ptr<OeMode> make_oe_mode(const OeOptions& options) {
  const char* error = nullptr;
  if (!options.validate(&error)) throw std::invalid_argument(std::string("OE mode: ") + error);
  return std::make_unique<OeMode>(options);
}

OrientationStep::OrientationStep(const OrientationStepOptions& options)
    : any_zoom_(options.any_zoom),
      has_telemetry_(options.has_telemetry),
      follow_points_(options.follow_points),
      connections_sigma_s_(options.minimum_delay_sigma_s),
      video_clock_(options.video_clock, options.video_stamp_sigma_s, options.wait_for_pace),
      now_{options.calibration, options.calibrated, options.zoom_curve},
      telemetry_({options.telemetry_clock, options.telemetry_stamp_sigma_s, options.telemetry_noise,
                  options.telemetry_limits, options.wait_for_pace}),
      zoom_(options.zoom_tolerance),
      lens_(options.oe ? options.oe->lens.belief : ReadingBeliefOptions()),
      unseen_delay_sigma_s_(options.unseen_delay_sigma_s),
      link_delay_(std::hypot(options.telemetry_noise.pan_tilt_sigma,
                             options.telemetry_noise.resolution / std::sqrt(12.0)),
                  options.minimum_delay_sigma_s),
      scene_lens_(options.calibration) {
  telemetry_.correct_by(options.calibration.mechanics, options.telemetry_error);
  // A stored calibration was made over another connection.
  if (options.other_connection && options.calibrated) link_delay_.open(unseen_delay_sigma_s_);
  if (options.link_delay)
    link_delay_.begin_found(options.link_delay->delay_s, options.link_delay->sigma_s);
  const Camera<double>& camera = options.calibration.camera;
  const auto follow_points = [this, &camera] {
    StartUpOptions start_up;
    start_up.width = camera.width;
    start_up.height = camera.height;
    start_up.max_points = kMaxFramePoints;
    start_up_ = std::make_unique<StartUpTracker>(start_up);
  };
  if (!options.oe) {
    if (!options.follow_turns || !options.has_telemetry) return;
    follow_points();
    turns_ = std::make_unique<TurnChain>();
    return;
  }
  OeOptions oe = *options.oe;
  oe.max_width = camera.width;
  oe.max_height = camera.height;
  oe_ = make_oe_mode(oe);
  oe_->reset(options.calibration, options.map, focal_length());
  if (options.follow_points || !options.has_telemetry) follow_points();
}

void OrientationStep::add_telemetry(const PanTiltSample& sample) {
  const TelemetryIntake::Taken taken = telemetry_.add(sample);
  if (taken.restarted) {
    link_delay_.break_images();
    if (oe_) oe_->forget_pending();
  }
  const bool has_zoom = sample.zoom && std::isfinite(*sample.zoom);
  if (has_zoom && zoom_.take(sample.latest_time_s, *sample.zoom)) note_curve_here();
  if (!taken.time_s) return;
  if (has_zoom) zoom_.place(*taken.time_s);
  link_delay_.add(TelemetrySample{*taken.time_s, 0, taken.angle.pan, taken.angle.tilt},
                  taken.error_variance);
  settle_pending_frames();
}

void OrientationStep::settle_pending_frames() {
  const std::optional<double> newest_s = telemetry_.newest_time();
  if (!oe_ || !newest_s) return;
  TelemetryLookUp look_up;
  while (oe_->pending(*newest_s, &look_up)) {
    InterpolatedPanTilt late;
    const QueryStatus query = ask_telemetry(look_up.time_s, look_up.time_sigma_s, &late);
    oe_->settle_pending(query == QueryStatus::kOk ? &late : nullptr);
  }
}

void OrientationStep::telemetry_lost() { telemetry_.note_lost(); }

// True if the new calibration is of the same curve, with the same shared parameters, at a zoom to
// which OE mode has followed the lens. A map that has only begun there is worth less than what was
// seen from there before.
bool OrientationStep::keeps_map(const PublishedCalibration& published) const {
  if (!oe_ || !now_.calibrated || !published.calibrated || !oe_->lens_has_moved()) return false;
  if (!oe_->has_followed_lens() && !published.map.landmarks.empty()) return false;
  const Calibration& now = now_.calibration;
  const Calibration& next = published.calibration;
  Calibration by_curve;
  return oe_->statistics().status == OeStatus::kOk && next.zoom &&
         published.zoom_curve.at(*next.zoom, &by_curve) &&
         by_curve.camera.focal_length == next.camera.focal_length &&
         now.line_delay == next.line_delay && now.clock_offset == next.clock_offset &&
         now.mechanics.pan_axis == next.mechanics.pan_axis &&
         now.mechanics.tilt_axis == next.mechanics.tilt_axis &&
         now.mechanics.pan_scale == next.mechanics.pan_scale &&
         now.mechanics.tilt_scale == next.mechanics.tilt_scale;
}

void OrientationStep::adopt(const PublishedCalibration& published) {
  const bool keep = keeps_map(published);
  // A withdrawn calibration's clock offset stays in use.
  if (!published.of_this_connection) {
    if (now_.calibrated) {
      link_delay_.change_calibration(published.calibration.clock_offset -
                                     now_.calibration.clock_offset);
    } else {
      link_delay_.open(unseen_delay_sigma_s_);
    }
  } else if (published.calibrated) {
    link_delay_.begin_calibrated();
  }
  has_shown_ = false;
  now_.calibration = published.calibration;
  now_.calibrated = published.calibrated;
  now_.zoom_curve = published.zoom_curve;
  telemetry_.correct_by(published.calibration.mechanics, published.telemetry_error);
  zoom_.note_adoption();
  note_curve_here();
  if (oe_ && !keep) oe_->reset(published.calibration, published.map, focal_length());
}

OrientationRecord OrientationStep::empty_record() const {
  OrientationRecord record;
  record.calibrated = now_.calibrated && zoom_fits();
  record.camera = pack(now_.calibration);
  record.zoom = zoom_.told();
  return record;
}

OrientationRecord OrientationStep::video_lost(double now_s) const {
  OrientationRecord record = empty_record();
  record.receive_time_s = now_s;
  record.status = RecordStatus::kVideoLost;
  return record;
}

OrientationRecord OrientationStep::add_frame(const FrameStamp& stamp, const ImageView& image,
                                             StepEvents* events) {
  const FrameTime frame_time = video_clock_.update(stamp);
  const ClockEstimate& clock = frame_time.clock;
  events->video_clock_restarted = clock.restarted;
  events->video_clock_restarted_by = frame_time.restarted_by;
  events->video_delay_stepped = clock.delay_stepped;
  events->video_moved_s = frame_time.moved_s;
  events->video_delay_wander_s = frame_time.wander_s;
  events->stamps_left_out = frame_time.stamp_rate_error;
  events->stamps_count = frame_time.stamps_count;
  tracks_.delay_stepped = clock.delay_stepped;
  if (clock.restarted || clock.delay_stepped) {
    const double moved_s = std::hypot(connections_sigma_s_, frame_time.moved_s);
    const bool is_new = stamp.restarted && now_.calibrated;
    link_delay_.open(is_new ? std::max(unseen_delay_sigma_s_, moved_s) : moved_s);
  }
  tell_delay(events);
  answered_by_oe_ = false;
  image_ = image;
  tracks_.stamp = stamp;
  tracks_.stamp.receive_time_s -= frame_time.delay_shift_s;  // as if the delay had not stepped
  if (frame_time.stamps_left_out) tracks_.stamp.sender_time_s.reset();
  tracks_.time_s = clock.time_s;
  tracks_.time_is_of_use = frame_time.of_use;
  tracks_.clock_restarted = clock.restarted;
  tracks_.delay_wander_s = frame_time.wander_s;
  tracks_.image_repeated = false;
  tracks_.telemetry_too_old = false;
  tracks_.tracker = FrameTracks::Tracker::kNone;

  OrientationRecord record = empty_record();
  record.frame = stamp.frame;
  record.receive_time_s = stamp.receive_time_s;
  if (!frame_time.known) {
    record.status = RecordStatus::kTimeUnknown;
    // The map would learn from an angle of another time.
    if (finds_landmarks() || turns_) image_ = ImageView{};
    return record;
  }
  record.time_s = clock.time_s;
  const Calibration& calibration = now_.calibration;
  const double to_middle_row_s = calibration.line_delay * (0.5 * calibration.camera.height);
  InterpolatedPanTilt measured;
  by_calibration_s_ = clock.time_s + calibration.clock_offset + to_middle_row_s;
  const double telemetry_time_s = by_calibration_s_ + link_delay_.delay_s();
  lens_.begin_frame(telemetry_time_s);
  lasting_sigma_s_ = frame_time.off_line_s;
  double time_sigma_s = clock.sigma_s;
  QueryStatus query = ask_telemetry(telemetry_time_s, time_sigma_s, &measured);
  if (has_result(query)) measured_angle_ = measured.angle;
  // A record in PT mode does not depend on the image.
  const ImageView judged = oe_ ? image : ImageView{};
  if (repeated_images_.judge(judged, clock.time_s, has_result(query) ? &measured : nullptr,
                             calibration.camera.focal_length)) {
    record.time_s.reset();
    record.status = RecordStatus::kImageRepeated;
    tracks_.image_repeated = true;
    image_ = ImageView{};
    return record;
  }
  if (repeated_images_.sigma_s() > 0) {
    time_sigma_s = std::hypot(time_sigma_s, repeated_images_.sigma_s());
    query = ask_telemetry(telemetry_time_s, time_sigma_s, &measured);
  }
  record.time_sigma_s = std::hypot(time_sigma_s, link_delay_.sigma_s());
  if (!has_telemetry_) {
    record.clock_locked = clock.state == ClockState::kLocked;
    orient_by_scene(image, &record);
    return record;
  }
  if (const auto newest_s = telemetry_.newest_time())
    record.telemetry_age_s = telemetry_time_s - *newest_s;
  record.clock_locked = clock.state == ClockState::kLocked;
  record.status = status_of_telemetry(query, telemetry_.is_lost(), record.clock_locked);
  tracks_.telemetry_too_old = record.status == RecordStatus::kTelemetryTooOld;
  const bool elsewhere = !zoom_fits() || zoom_moved(telemetry_time_s);
  // A map begun at another zoom has lost all its landmarks: the present zoom's calibration is used
  // again.
  if (!elsewhere && oe_ && now_.calibrated && oe_->lens_has_moved() && oe_->map().size() == 0)
    oe_->reset(now_.calibration, focal_length());
  if (elsewhere || (oe_ && oe_->lens_has_moved())) {
    FrameLens lens;
    if (follows_lens() && lens_.look_up(now_.zoom_curve, zoom_, readout_s(), &lens)) {
      record.calibrated = true;
      record.camera = pack(lens.calibration);
      const bool excluded = lens_.belief() == ReadingBelief::kExcluded;
      orient(has_result(query) ? &measured : nullptr, image, &lens, &record);
      events->zoom_contradicted = !excluded && lens_.belief() == ReadingBelief::kExcluded;
      return record;
    }
  }
  if (elsewhere) {
    // The map belongs to another zoom.
    image_ = finds_landmarks() ? ImageView{} : image_;
    orient_between(has_result(query) ? &measured : nullptr, telemetry_time_s, &record);
    return record;
  }
  orient(has_result(query) ? &measured : nullptr, image, nullptr, &record);
  return record;
}

// The head and the link stay what they are; the lens and where it points are open.
Calibration OrientationStep::at_any_zoom() const {
  Calibration out = *any_zoom_;
  const Calibration& here = now_.calibration;
  out.camera.aspect = here.camera.aspect;
  out.mechanics = here.mechanics;
  out.line_delay = here.line_delay;
  out.clock_offset = here.clock_offset;
  return out;
}

void OrientationStep::orient_between(const InterpolatedPanTilt* measured, double telemetry_time_s,
                                     OrientationRecord* record) {
  Calibration between;
  const bool known = zoom_.calibration(now_.zoom_curve, telemetry_time_s, readout_s(), &between);
  if (!known) {
    record->status = RecordStatus::kOtherZoom;
    if (!any_zoom_) return;
    between = at_any_zoom();
  }
  record->calibrated = known;
  record->camera = pack(between);
  if (measured == nullptr) return;
  FrameOrientation frame;
  if (!pt_orientation(between, *record->time_s, *measured, &frame) ||
      (oe_ && !oe_->put_into_base(&frame))) {
    record->status = RecordStatus::kNotFinite;
    return;
  }
  record->mode = RecordMode::kPt;
  if (oe_ && known) {
    record->status = zoom_on_curve_ ? RecordStatus::kFocalLengthUnsure : RecordStatus::kZoomMoves;
  }
  record->orientation = orientation_of(frame);
  note_tie(record);
}

void OrientationStep::orient(const InterpolatedPanTilt* measured, const ImageView& image,
                             const FrameLens* lens, OrientationRecord* record) {
  FrameOrientation frame;
  if (finds_landmarks()) {
    const OeStatus status = oe_->process(image, *record->time_s, measured, lens, &frame);
    answered_by_oe_ = true;
    // If the frame's time is not yet known well, sigma says so too.
    if (measured != nullptr && status != OeStatus::kOk)
      record->status = status_of_landmarks(status);
  } else if (measured != nullptr &&
             pt_orientation(now_.calibration, *record->time_s, *measured, &frame) && oe_ &&
             !oe_->put_into_base(&frame)) {
    // If this fails, the frame has no orientation.
    frame = FrameOrientation();
  }
  if (frame.mode == OrientationMode::kNone) {
    if (measured != nullptr) record->status = RecordStatus::kNotFinite;
    return;
  }
  record->mode = RecordMode::kPt;
  if (oe_ && !answered_by_oe_) record->status = RecordStatus::kNotCalibrated;
  if (lens == nullptr) allow_for_begun_movement(&frame.calibration);
  if (focal_length() == FocalLength::kLearnt) record->camera = pack(frame.calibration);
  if (frame.mode == OrientationMode::kOe) {
    note_landmarks(frame, record);
    if (lens != nullptr) lens_.judge(frame.calibration);
  }
  record->orientation = orientation_of(frame);
  note_tie(record);
  if (record->mode == RecordMode::kOe && measured != nullptr)
    record->telemetry_error = telemetry_error(*measured, frame, *record);
}

void OrientationStep::note_landmarks(const FrameOrientation& frame, OrientationRecord* record) {
  record->mode = RecordMode::kOe;
  record->landmarks = frame.landmarks;
  record->residual_px = residual_rms(*oe_);
  lens_.note_found(frame.calibration, frame.zoom_rate);
}

PanTilt<double> OrientationStep::telemetry_error(const InterpolatedPanTilt& measured,
                                                 const FrameOrientation& frame,
                                                 const OrientationRecord& record) {
  const Camera<double>& camera = frame.calibration.camera;
  const double t = frame.calibration.line_delay * (0.5 * camera.height);  // to the middle row
  const Vector2<double> answer =
      frame.angle.vector() + frame.rate.vector() * t + frame.acceleration.vector() * (0.5 * t * t);
  const PanTilt<double> zero =
      record.localized ? record.localized->telemetry_zero : PanTilt<double>{};
  const PanTilt<double> told = true_from_measured(frame.calibration.mechanics, measured.angle);
  const Vector2<double> error =
      minus(plus(told, zero.vector()), PanTilt<double>{answer.x(), answer.y()});
  return {error.x(), error.y()};
}

void OrientationStep::maintain() {
  show_motion();
  if (finds_landmarks()) {
    oe_->maintain();
    if (image_.valid()) tracks_.tracker = FrameTracks::Tracker::kOe;
  } else if (start_up_ && image_.valid()) {
    if (start_up_->process(image_) != StartUpStatus::kBadImage)
      tracks_.tracker = FrameTracks::Tracker::kStartUp;
    if (turns_) follow_turn();
  }
  image_ = {};
}

void OrientationStep::get_tracks(FrameTracks* tracks) const {
  *tracks = tracks_;
  tracks->count = 0;
  if (tracks_.tracker == FrameTracks::Tracker::kStartUp) alidade::get_tracks(*start_up_, tracks);
  if (tracks_.tracker == FrameTracks::Tracker::kOe) alidade::get_tracks(*oe_, tracks);
}

void OrientationStep::get_landmarks(FrameLandmarks* landmarks) const {
  landmarks->kind = FrameLandmarks::Kind::kNone;
  landmarks->count = 0;
  if (tracks_.tracker == FrameTracks::Tracker::kStartUp)
    alidade::get_landmarks(*start_up_, landmarks);
  if (tracks_.tracker == FrameTracks::Tracker::kOe) alidade::get_landmarks(*oe_, landmarks);
}

}  // namespace alidade
