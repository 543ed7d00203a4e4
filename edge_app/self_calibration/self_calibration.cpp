#include "edge_app/self_calibration/self_calibration.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/calibration/calibration_difference.h"
#include "core/calibration/centre_frame.h"
#include "core/calibration/number_text.h"
#include "core/calibration/zoom_fit.h"
#include "edge_app/self_calibration/calibration_refusal.h"
#include "edge_app/self_calibration/keyframe_map.h"

namespace alidade {
namespace {

std::string describe(const Calibration& c) {
  const auto estimate = [&c](double value, Parameter parameter, double unit, const char* name) {
    return estimate_text(value / unit, parameter_sigma(c, parameter) / unit, name);
  };
  return fmt::format("focal length {}, radial distortion {}, line delay {}, clock offset {}",
                     estimate(c.camera.focal_length, Parameter::kFocalLength, 1, "px"),
                     estimate(c.camera.distortion.only_term(), Parameter::kRadialDistortion, 1, ""),
                     estimate(c.line_delay, Parameter::kLineDelay, 1e-6, "us"),
                     estimate(c.clock_offset, Parameter::kClockOffset, 1e-3, "ms"));
}

}  // namespace

SelfCalibration::SelfCalibration(const SelfCalibrationOptions& options, CalibrationArchive* archive)
    : options_(options),
      archive_(archive),
      streams_(options.schedule),
      session_(options.session),
      pace_(options.schedule),
      zoom_(options.zoom_tolerance, options.schedule),
      zooms_(options.zooms),
      contradiction_(options.contradiction),
      disagreement_(options.disagreement) {
  auto first = std::make_shared<PublishedCalibration>();
  const StoredCalibration* stored = archive != nullptr ? archive->find(std::nullopt) : nullptr;
  if (stored != nullptr) {
    first->calibration = stored->calibration;
    first->telemetry_error = stored->notes.telemetry_error;
    first->calibrated = true;
    first->map = kept_map(stored->map);
    first->name = stored->path;
  } else {
    first->calibration = options.data_sheet;
    first->name = "data sheet";
  }
  if (archive != nullptr) {
    const bool free_centre =
        stored != nullptr && stored->calibration.zoom && has_free_centre(stored->calibration);
    nodes_.begin_with(archive->zoom_curve(), free_centre ? &stored->calibration : nullptr);
  }
  zooms_ = zooms_ || !nodes_.empty();
  first->zoom_curve = nodes_.believed_curve();
  first->of_this_connection = stored == nullptr;
  publication_.begin_with(first);
}

void SelfCalibration::begin_anew() {
  session_.clear();
  first_node_is_wanted_ = false;
  pace_.begin_anew();
  refusal_.clear();
  goals_.reset();
  disagreement_.restart();
}

void SelfCalibration::begin_fresh() {
  begin_anew();
  publication_.want_fresh(is_calibrated_here());
}

bool SelfCalibration::is_calibrated_here() const {
  return publication_.object()->calibrated && zoom_.fits(publication_.calibration().zoom);
}

void SelfCalibration::clock_began_anew() {
  nodes_.clock_began_anew();
  if (first_node_) first_node_->clock_holds = false;
}

bool SelfCalibration::judge_delay(const FrameTracks& tracks) {
  if (streams_.judge_delay(tracks)) {
    if (streams_.delay_wanders()) {
      messages_.warn(
          fmt::format("the video's delay, or its time stamps, wander by {:.0f} ms, more than "
                      "the {:.0f} ms up to which a clock offset can be found: a relay, Wi-Fi, "
                      "or a camera or machine that is too busy; nothing is calibrated and "
                      "nothing withdrawn until they hold",
                      1e3 * tracks.delay_wander_s, 1e3 * options_.schedule.most_wander_s));
      widen_contradicted();
    } else {
      messages_.say("the video's delay holds again; the clock offset is found anew");
    }
    begin_anew();
    publication_.clock_began_anew();
    clock_began_anew();
  }
  return streams_.delay_wanders();
}

// While the delay wanders nothing better can be had. So the sigmas grow to what the last motion has
// shown, as a second contradiction cannot come.
void SelfCalibration::widen_contradicted() {
  const std::optional<double> chi_square = contradiction_.pending();
  if (!chi_square || !is_calibrated_here()) return;
  contradiction_.restart();
  const auto parameters = static_cast<double>(kComparedParameters.size());
  auto widened = std::make_shared<PublishedCalibration>(*publication_.object());
  widened->calibration.covariance *= *chi_square / parameters;
  widened->name += ", widened";
  messages_.warn(fmt::format(
      "the last motion contradicted the calibration (chi-square {:.0f}), and while the delay "
      "wanders none can take its place: its sigmas are now {:.1f} times as wide",
      *chi_square, std::sqrt(*chi_square / parameters)));
  publication_.widen(widened);
}

void SelfCalibration::judge_agreement(const FrameTracks& tracks) {
  if (tracks.tracker != FrameTracks::Tracker::kOe || !is_calibrated_here()) return;
  const bool contradicted = tracks.oe_status == OeStatus::kContradiction;
  if (!disagreement_.judge(tracks.stamp.receive_time_s, contradicted)) return;
  if (!options_.automatic) {
    // Nothing would take its place.
    messages_.warn_once(
        fmt::format("landmarks contradict telemetry in half of the frames (was the camera "
                    "moved on its mount, or its lens?); the calibration {} stays in use, as "
                    "calibration.auto is false: calibrate again",
                    publication_.object()->name));
    disagreement_.restart();
    return;
  }
  withdraw(fmt::format("landmarks contradict telemetry in {} of {} frames",
                       disagreement_.contradicted_frames(), disagreement_.frames()),
           "was the camera moved on its mount, or its lens?");
}

void SelfCalibration::withdraw(const std::string& reason, const std::string& question) {
  auto withdrawn = std::make_shared<PublishedCalibration>();
  // Its values are still the best guess. A data sheet that states a value as exact does not make
  // it better known than it was.
  withdrawn->calibration = publication_.calibration();
  withdrawn->calibration.covariance += options_.data_sheet.covariance;
  withdrawn->telemetry_error = publication_.object()->telemetry_error;
  withdrawn->name = publication_.object()->name + ", withdrawn";
  messages_.warn(fmt::format("{}: the calibration {} is withdrawn ({}); calibrating anew", reason,
                             publication_.object()->name, question));
  publication_.withdraw(withdrawn);
  nodes_.doubt();
  begin_anew();
}

bool SelfCalibration::storing_is_due() const {
  return archive_ != nullptr && archive_->has_pending() &&
         streams_.now_s() > last_store_s_ + options_.schedule.store_retry_s;
}

bool SelfCalibration::adjusting_is_due() const {
  if (cancelled_) return false;
  if (!options_.automatic || session_.frames() < 3 || !zoom_.has_settled(streams_.now_s())) {
    return false;
  }
  if (wants_first()) return pace_.first_is_due(session_);
  if (makes_nodes() && !nodes_.has_visit()) return pace_.node_is_due(session_);
  return pace_.watch_is_due(session_, !publication_.clock_holds());
}

CheckedCalibration SelfCalibration::adjust(const Calibration* known, bool free_centre) const {
  CheckedCalibrationOptions options;
  options.width = options_.data_sheet.camera.width;
  options.height = options_.data_sheet.camera.height;
  options.adjustment = options_.adjustment;
  options.adjustment.learns_scales = !free_centre && !makes_nodes();
  if (free_centre) {
    options.adjustment.centre_sigma_px = kUsualCentreShare * options.width;
  } else if (known == nullptr && is_calibrated_here() && !publication_.is_fresh_wanted()) {
    // To be compared: axes are told in the camera frame through the centre.
    options.adjustment.centre_offset_px = publication_.calibration().camera.centre_offset();
    options.adjustment.centre_sigma_px = 0;
  }
  options.camera = options_.camera;
  options.noise = options_.noise;
  options.checks = options_.checks;
  options.is_cancelled = [this] { return cancelled_.load(); };
  const auto calibrate_with = [&](const CheckedCalibrationOptions& with) {
    if (known == nullptr) return calibrate_session(session_, with, nullptr);
    const KnownCalibration prior{*known, publication_.clock_holds()};
    return calibrate_session(session_, with, &prior);
  };
  CheckedCalibration checked = calibrate_with(options);
  const double centre_sigma_px = options.adjustment.centre_sigma_px;
  if (known == nullptr && !free_centre && checked.refusal.empty() && centre_sigma_px > 0) {
    // Told in a camera frame with an exact centre.
    const Calibration free = checked.result.calibration;
    if (centre_is_shown(free, options.adjustment.centre_offset_px, centre_sigma_px)) {
      checked.result.calibration = with_frame_through_centre(free);
    } else {
      options.adjustment.centre_sigma_px = 0;
      checked = calibrate_with(options);
      checked.result.calibration = with_centre_error(checked.result.calibration, free);
    }
  }
  // A refined calibration keeps the frame, and with it the error of the centre.
  if (known != nullptr) checked.result.calibration.centre_error = known->centre_error;
  checked.result.calibration.zoom = zoom_.reading();
  return checked;
}

void SelfCalibration::store(const CalibrationResult& result, const MapState& map) {
  last_store_s_ = streams_.now_s();
  if (archive_ == nullptr) return;
  StoredCalibration stored;
  stored.calibration = result.calibration;
  stored.notes.quality = result.quality;
  stored.notes.excluded = result.exclusions.describe();
  stored.notes.zoom_curve = nodes_.curve();
  stored.notes.telemetry_error = result.telemetry_error;
  stored.notes.pupil = options_.adjustment.pupil;
  stored.notes.far_focal_length = result.far_focal_length();
  stored.map = map;
  std::string error;
  if (archive_->save(stored, &error)) return;
  messages_.warn(archive_->has_pending() ? error + "; kept, will be tried again" : error);
}

void SelfCalibration::publish(const CheckedCalibration& checked) {
  auto fresh = std::make_shared<PublishedCalibration>();
  fresh->calibration = checked.result.calibration;
  fresh->calibrated = true;
  fresh->map = map_from_keyframes(checked.result, session_.keyframes(checked.result));
  fresh->name = "live";
  fresh->zoom_curve = nodes_.believed_curve();
  fresh->telemetry_error = checked.result.telemetry_error;
  const CalibrationQuality& quality = checked.result.quality;
  const std::string held_out =
      checked.hold_out ? fmt::format(", {:.2f} in frames held out", *checked.hold_out) : "";
  messages_.say(
      fmt::format("calibrated from {} frames, {} landmarks: {}; residuals {:.2f} of the tracker's "
                  "noise{}; map of {} landmarks",
                  quality.frames, quality.landmarks, describe(fresh->calibration),
                  quality.pixel_sigma_ratio, held_out, fresh->map.landmarks.size()));
  for (const std::string& line : quality.describe_departures()) {
    messages_.say("what was filmed contradicts the model: " + line);
  }
  for (const std::string& remark : checked.remarks) messages_.say(remark);
  store(checked.result, fresh->map);
  publication_.accept([this](double zoom) { return zoom_.fits(zoom); });
  publication_.replace(fresh);
  messages_.forget_said();
  need_ = CalibrationNeed::kNothing;
}

// Calibrates without an earlier calibration as prior.
void SelfCalibration::try_first() {
  pace_.note_first();
  CheckedCalibration checked = adjust(nullptr);
  if (checked.refusal.empty()) {
    pace_.watch_soon();
    settle(std::move(checked));
    return;
  }
  // The program ends: nobody need do anything about it.
  if (checked.result.status == CalibrationStatus::kCancelled) return;
  const CalibrationRefusal refusal =
      why_refused(checked, session_.frames(), streams_.repeated_share());
  need_ = refusal.need;
  goals_ = checked.result.goals;
  refusal_ = (publication_.is_fresh_wanted() ? "no fresh calibration yet" : "not calibrated yet") +
             refusal.why;
  messages_.say_once(refusal_);
}

void SelfCalibration::hold_against_published() {
  pace_.watch_later();
  CheckedCalibration alone = adjust(nullptr);
  // Insufficient motion says nothing against what is known.
  if (!alone.refusal.empty()) return;
  const double chi_square = difference_chi_square(
      publication_.calibration(), alone.result.calibration, publication_.clock_holds());
  // A reading that agrees with itself says nothing about the curve.
  const bool agrees = makes_nodes() && chi_square <= options_.contradiction.least_chi_square;
  const ContradictionJudge::Verdict verdict =
      agrees ? ContradictionJudge::Verdict::kAgrees : contradiction_.judge(chi_square);
  if (verdict != ContradictionJudge::Verdict::kAgrees) {
    pace_.watch_soon();
    messages_.warn(
        fmt::format("the camera is not what the calibration says (chi-square {:.0f}): {}",
                    chi_square, describe(alone.result.calibration)));
    if (verdict != ContradictionJudge::Verdict::kBelieved) return;
    contradiction_.restart();
    if (makes_nodes()) {
      begin_nodes_anew(alone);
    } else {
      publish(alone);
      first_node_.reset();
      first_node_is_wanted_ = true;
    }
    return;
  }
  if (makes_nodes()) {
    refine_node(std::move(alone));
    return;
  }
  if (!first_node_ || !first_node_->refusal.empty()) first_node_is_wanted_ = true;
  alone = {};  // frees a megabyte
  const CheckedCalibration refined = adjust(&publication_.calibration());
  if (!refined.refusal.empty()) return;
  if (!publication_.clock_holds() ||
      is_sharper(refined.result.calibration, publication_.calibration(),
                 options_.schedule.worth_publishing)) {
    publish(refined);
    first_node_is_wanted_ = true;
  }
}

void SelfCalibration::add(const FrameTracks& tracks) {
  streams_.add(tracks);
  // Frames before and after have different clock offsets.
  if (tracks.clock_restarted || tracks.delay_stepped) {
    if (!session_.empty()) begin_anew();
    if (is_calibrated_here()) publication_.clock_began_anew();
    clock_began_anew();
  }
  if (judge_delay(tracks)) return;
  judge_agreement(tracks);
  if (tracks.tracker == FrameTracks::Tracker::kNone || !tracks.time_is_of_use) return;
  // On an overloaded machine, frames of the previous zoom may come after the new reading.
  if (!zoom_.has_settled(tracks.stamp.receive_time_s)) return;
  if (tracks.tracker != tracker_) {
    begin_anew();
    tracker_ = tracks.tracker;
  }
  if (fresh_asked_.exchange(false)) begin_fresh();
  if (session_.empty()) pace_.begin(tracks.stamp.receive_time_s);
  session_.add(tracks);
}

bool SelfCalibration::wants_keyframe() const {
  return options_.automatic && session_.wants_keyframe(publication_.calibration().camera);
}

void SelfCalibration::add_keyframe(std::int64_t frame, const ImageView& image) {
  const Camera<double>& camera = options_.data_sheet.camera;
  if (session_.newest_frame() != frame || !image.valid() || image.width != camera.width ||
      image.height != camera.height) {
    return;
  }
  session_.add_keyframe(image);
}

void SelfCalibration::add(const PanTiltSample& sample) {
  streams_.add(sample);
  judge_zoom(sample);
  look_for_stored();
  session_.add(sample);
}

bool SelfCalibration::ask_for_fresh() {
  if (!options_.automatic) return false;
  fresh_asked_ = true;
  return true;
}

void SelfCalibration::cancel() { cancelled_ = true; }

bool SelfCalibration::due() const {
  return storing_is_due() || first_node_is_wanted() || first_node_is_due() || adjusting_is_due();
}

std::shared_ptr<const PublishedCalibration> SelfCalibration::work() {
  if (storing_is_due()) {
    std::string error;
    last_store_s_ = streams_.now_s();
    if (archive_->save_pending(&error)) {
      messages_.say_once("the calibration is stored now");
    } else {
      messages_.warn_once(error);
    }
  }
  if (first_node_is_due()) take_first_node();
  if (first_node_is_wanted()) {
    make_first_node();
  } else if (adjusting_is_due()) {
    pace_.note_try(session_);
    if (wants_first()) {
      try_first();
    } else {
      hold_against_published();
    }
  }
  return publication_.take_next();
}

CalibrationReport SelfCalibration::report() const {
  CalibrationReport report;
  if (!options_.automatic) return report;
  const bool is_known = is_known_here();
  report.activity = is_known                      ? CalibrationActivity::kWatching
                    : publication_.is_withdrawn() ? CalibrationActivity::kDoubtful
                                                  : CalibrationActivity::kCollecting;
  const std::optional<CalibrationNeed> unsteady = streams_.unsteady();
  const std::optional<CalibrationNeed> missing = streams_.missing();
  if (unsteady) {
    report.need = *unsteady;
  } else if (is_known && !publication_.is_fresh_wanted()) {
    report.need = CalibrationNeed::kNothing;
  } else if (missing) {
    report.need = *missing;
  } else if (!zoom_.has_settled(streams_.now_s())) {
    report.need = CalibrationNeed::kSteadyZoom;
  } else {
    report.need = pace_.has_tried() ? need_ : missing_motion();
  }
  return report;
}

// Before the first try nothing but the range of the angles tells.
CalibrationNeed SelfCalibration::missing_motion() const {
  constexpr double kSeen_s = 1;
  const std::optional<AngleRange> range = session_.angle_range();
  if (!range || session_.span_s() < kSeen_s) return CalibrationNeed::kTime;
  const Camera<double>& camera = publication_.calibration().camera;
  const double least = travel_limits(camera.focal_length, camera.width).least;
  const bool pans = range->largest.pan - range->least.pan >= least;
  const bool tilts = range->largest.tilt - range->least.tilt >= least;
  if (pans && tilts) return CalibrationNeed::kTime;
  return pans ? CalibrationNeed::kTilt : tilts ? CalibrationNeed::kPan : CalibrationNeed::kMotion;
}

std::optional<CalibrationProgress> SelfCalibration::progress() const {
  if (!options_.automatic || (is_known_here() && !publication_.is_fresh_wanted()))
    return std::nullopt;
  const Camera<double>& camera = publication_.calibration().camera;
  CalibrationProgress progress;
  progress.attempts = pace_.tries();
  progress.refusal = refusal_;
  progress.goals = goals_.value_or(calibration_goals(camera));
  progress.travel = travel_limits(camera.focal_length, camera.width);
  progress.span_s = session_.span_s();
  progress.coverage =
      session_.coverage(options_.data_sheet.camera.width, options_.data_sheet.camera.height);
  return progress;
}

}  // namespace alidade
