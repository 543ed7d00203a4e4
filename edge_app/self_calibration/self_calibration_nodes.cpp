// SelfCalibration, the part for zooms: from the calibration of a dwell to a node of the zoom curve.

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <utility>

#include "core/calibration/calibration_difference.h"
#include "core/realtime/lens/zoom_lookup.h"
#include "edge_app/self_calibration/keyframe_map.h"
#include "edge_app/self_calibration/self_calibration.h"

namespace alidade {
namespace {

ZoomFitOptions fit_options_of(const CheckedCalibration& checked) {
  ZoomFitOptions options = zoom_fit_options(checked.adjustment);
  options.common_clock_sigma_s = checked.common_clock_sigma_s;
  return options;
}

bool look_forward(const Calibration& c, Vector3<double>* d_b) {
  const Vector2<double> middle(0.5 * c.camera.width, 0.5 * c.camera.height);
  Vector3<double> d_c;
  if (unproject(c.camera, middle, &d_c) != ProjectionStatus::kOk) return false;
  *d_b = R_base_from_camera(c.mechanics, PanTilt<double>{}) * d_c;
  return true;
}

// Whether a map made with one calibration is where the other one looks. An exchange between the
// axes and the optical centre turns it; kept_map() allows for three times this limit.
bool look_alike(const Calibration& a, const Calibration& b) {
  constexpr double kMost_rad = 3e-4;
  Vector3<double> of_a;
  Vector3<double> of_b;
  return look_forward(a, &of_a) && look_forward(b, &of_b) && (of_a - of_b).norm() <= kMost_rad;
}

}  // namespace

// Readings taken for other zooms were this zoom's.
void SelfCalibration::take_jitter() {
  messages_.say(
      fmt::format("the zoom reading jitters by {:.2g} (one standard deviation): what differs by up "
                  "to {:.2g} is taken for one zoom; calibration.zoom_tolerance says otherwise",
                  zoom_.sigma(), zoom_.tolerance()));
  if (archive_ != nullptr) archive_->set_zoom_tolerance(zoom_.tolerance());
  zooms_ = options_.zooms || !nodes_.empty();
}

void SelfCalibration::judge_zoom(const PanTiltSample& sample) {
  using Change = PresentZoom::Change;
  if (sample.zoom && !std::isfinite(*sample.zoom)) {
    messages_.warn_once(
        "the pan/tilt source tells a zoom reading that is no number; such are left out");
  }
  const Change change = zoom_.add(sample);
  switch (change) {
    case Change::kNone:
      return;
    case Change::kSilent:
      messages_.warn_once(fmt::format(
          "no zoom reading for {:g} s; the last, {}, is taken to hold: does the pan/tilt link tell "
          "the zoom in every answer?",
          options_.schedule.zoom_silence_s, *zoom_.reading()));
      return;
    case Change::kJitter:
      take_jitter();
      return;
    case Change::kGlitch:
      messages_.say_once(fmt::format(
          "the zoom reading left {} and was back within {:g} s, as no lens can: taken for a glitch",
          *zoom_.reading(), options_.schedule.zoom_glitch_s));
      [[fallthrough]];
    case Change::kSame:
      if (!is_calibrated_here()) zoom_.take_level();
      return;
    case Change::kMoved:
      zooms_ = true;
      nodes_.leave();
      [[fallthrough]];
    case Change::kFirst:
      begin_anew();
  }
}

bool SelfCalibration::is_on_curve() const {
  Calibration here;
  return zoom_.reading() && nodes_.believed_curve().at(*zoom_.reading(), &here) &&
         relative_focal_length_sigma(here) <= kSharpFocalLength &&
         !publication_.is_rejected(*zoom_.reading(), zoom_.tolerance());
}

// At a new zoom: was the camera there before, or is it on the curve?
void SelfCalibration::look_for_stored() {
  if (!zoom_.reading() || is_calibrated_here() || !zoom_.has_arrived(streams_.now_s())) return;
  const StoredCalibration* stored = archive_ == nullptr ? nullptr : archive_->find(zoom_.reading());
  // A calibration without a zoom, which holds for any, would have fitted already.
  if (stored != nullptr && !stored->calibration.zoom) stored = nullptr;
  auto found = std::make_shared<PublishedCalibration>();
  const bool on_curve = nodes_.believed_curve().at(*zoom_.reading(), &found->calibration) &&
                        (stored == nullptr || has_free_centre(stored->calibration));
  const double f_sigma = relative_focal_length_sigma(found->calibration);
  const bool by_curve = on_curve && f_sigma <= kSharpFocalLength;
  if (on_curve && !by_curve) {
    // The real-time thread has the curve. It follows points, or begins a map where nothing better
    // will come.
    if (options_.automatic)
      messages_.say_once(
          fmt::format("zoom {}: by the zoom curve the focal length is known to {:.2g} %: PT mode "
                      "with that sigma "
                      "until it is calibrated here",
                      *zoom_.reading(), 100 * f_sigma));
    return;
  }
  if (stored != nullptr && (!by_curve || look_alike(stored->calibration, found->calibration)))
    found->map = kept_map(stored->map);
  if (by_curve) {
    found->name = "zoom curve";
  } else if (stored != nullptr) {
    found->calibration = stored->calibration;
    found->name = stored->path.empty() ? "live" : stored->path;
  } else {
    return;
  }
  if (publication_.is_rejected(*found->calibration.zoom, zoom_.tolerance())) return;
  found->telemetry_error = stored != nullptr && stored->notes.telemetry_error.exists()
                               ? stored->notes.telemetry_error
                               : publication_.object()->telemetry_error;
  found->calibrated = true;
  found->zoom_curve = nodes_.believed_curve();
  // For a stored one the connection is unknown.
  found->of_this_connection = by_curve && nodes_.clock_is_known();
  messages_.say(fmt::format("zoom {}: the calibration {} holds", *zoom_.reading(), found->name));
  publication_.replace(found);
  if (!makes_nodes()) contradiction_.restart();
  pace_.watch_after(makes_nodes() ? options_.schedule.next_try_s : options_.schedule.first_watch_s);
  need_ = CalibrationNeed::kNothing;
}

// In a work() of its own, so that publishing does not wait for it.
void SelfCalibration::make_first_node() {
  first_node_is_wanted_ = false;
  if (!zoom_.reading()) return;
  const CheckedCalibration made = adjust(nullptr, true);
  if (made.result.status == CalibrationStatus::kCancelled) return;
  FirstNode node;
  node.refusal = made.refusal;
  node.result.calibration = made.result.calibration;
  node.result.quality = made.result.quality;
  node.result.exclusions = made.result.exclusions;
  if (made.refusal.empty())
    node.map = map_from_keyframes(made.result, session_.keyframes(made.result));
  first_node_ = std::move(node);
}

// Called once the camera has another zoom.
void SelfCalibration::take_first_node() {
  const FirstNode first = std::move(*first_node_);
  first_node_.reset();
  if (!nodes_.empty() || !makes_nodes()) return;
  const Calibration& calibration = first.result.calibration;
  if (!first.refusal.empty()) {
    messages_.say(fmt::format(
        "zoom {}: no node of the zoom curve until the camera is there again: with a free optical "
        "centre, {}",
        *calibration.zoom, first.refusal));
    return;
  }
  nodes_.begin_anew(calibration);
  nodes_.leave();
  if (!first.clock_holds) nodes_.clock_began_anew();
  store(first.result, first.map);
}

// Called where there was no calibration, or a fresh one is wanted.
void SelfCalibration::settle(CheckedCalibration checked) {
  if (!makes_nodes()) {
    contradiction_.restart();
    publish(checked);
    first_node_is_wanted_ = true;
    return;
  }
  ZoomAddition addition;
  std::string why;
  if (nodes_.add(checked.result.calibration, fit_options_of(checked), &addition, &why)) {
    take_node(addition, &checked);
  } else {
    contradict_nodes(checked, why);
  }
}

// Called where there is a calibration, and `alone` agrees with it.
void SelfCalibration::refine_node(CheckedCalibration alone) {
  ZoomAddition addition;
  std::string why;
  if (!nodes_.add(alone.result.calibration, fit_options_of(alone), &addition, &why)) {
    contradict_nodes(alone, why);
    return;
  }
  contradiction_.restart();
  if (!nodes_.has_visit() || !publication_.clock_holds() ||
      is_sharper(addition.calibration, publication_.calibration(),
                 options_.schedule.worth_publishing)) {
    take_node(addition, &alone);
  }
}

void SelfCalibration::take_node(const ZoomAddition& addition, CheckedCalibration* checked) {
  if (!nodes_.has_visit()) pace_.watch_soon();
  nodes_.take(addition);
  contradiction_.restart();
  checked->result.calibration = addition.calibration;
  publish(*checked);
  if (!addition.node) return;
  const ZoomCurve& curve = nodes_.curve();
  messages_.say(fmt::format("zoom curve: {} nodes from reading {} to {}", curve.visits(),
                            curve.first_reading(), curve.last_reading()));
  // Its data is in the node now.
  session_.clear();
}

// Perhaps this reading alone is wrong: the other nodes are kept until a second one contradicts.
void SelfCalibration::contradict_nodes(const CheckedCalibration& alone, const std::string& why) {
  messages_.warn(fmt::format("zoom {}: not of the zoom curve: {}", *zoom_.reading(), why));
  const auto verdict = contradiction_.judge(std::numeric_limits<double>::infinity());
  if (publication_.is_fresh_wanted() || verdict == ContradictionJudge::Verdict::kBelieved) {
    contradiction_.restart();
    begin_nodes_anew(alone);
  } else {
    publish(alone);
  }
}

void SelfCalibration::begin_nodes_anew(const CheckedCalibration& alone) {
  const std::string aside = archive_ == nullptr ? "" : archive_->set_zooms_aside();
  messages_.warn(
      fmt::format("another camera or lens than the zoom curve's, or moved on its mount, or its "
                  "reading does not "
                  "follow the lens: a new curve begins at zoom {}{}{}",
                  *zoom_.reading(), aside.empty() ? "" : "; ", aside));
  nodes_.begin_anew(alone.result.calibration);
  publication_.accept([](double) { return true; });
  publish(alone);
}

}  // namespace alidade
