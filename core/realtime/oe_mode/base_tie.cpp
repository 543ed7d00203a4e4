#include "core/realtime/oe_mode/base_tie.h"

#include <algorithm>
#include <cmath>

#include "core/model/angle.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

bool BaseTieOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(drift >= 0)) problem = "drift must not be negative";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

Matrix2<double> difference_of_shared(const SharedByView& k, const SharedByView& t) {
  // If one lens sees less than the other, its view decides.
  const Vector2<double> extent = k.extent.cwiseMin(t.extent);
  double overlap = 1;
  for (int axis = 0; axis < 2; ++axis) {
    const double apart = std::abs(wrap_angle(k.angle[axis] - t.angle[axis]));
    overlap *= apart < extent[axis] ? 1 - apart / extent[axis] : 0;
  }
  Matrix2<double> out = k.covariance + t.covariance;
  const Vector2<double> common = k.covariance.diagonal().cwiseMin(t.covariance.diagonal());
  out.diagonal() -= 2 * overlap * common;
  // The remaining correlation of the axes is unknown: allow as much as is possible.
  const double most = std::sqrt(std::max(0.0, out(0, 0) * out(1, 1)));
  out(0, 1) = out(1, 0) = std::clamp((1 - overlap) * out(0, 1), -most, most);
  return out;
}

TiedOffset BaseTie::of_telemetry(const MapOffset& offset) const {
  if (!is_by_map_) return tied_;
  return {tied_.value - offset.value, tied_.covariance + shared_.covariance + offset.covariance,
          tied_.sensitivity - offset.sensitivity};
}

void BaseTie::drift(double elapsed_s) {
  if (is_tied_) {
    tied_.covariance.diagonal().array() += options_.drift * options_.drift * std::abs(elapsed_s);
  }
}

void BaseTie::note_telemetry(const Vector2<double>& added, const Matrix2<double>& covariance,
                             const Sensitivity<2>& sensitivity) {
  last_ = {Answer::Kind::kTelemetry, {added, covariance, sensitivity}, {}};
}

void BaseTie::note_landmarks(const Vector2<double>& added, const Matrix2<double>& covariance,
                             const SharedByView& shared, const Sensitivity<2>& sensitivity) {
  last_ = {Answer::Kind::kLandmarks, {added, covariance, sensitivity}, shared};
}

bool BaseTie::ask() {
  asked_ = last_;
  return asked_.kind != Answer::Kind::kNone;
}

bool BaseTie::settle(const BaseMeasurement& measurement, const MapOffset& offset) {
  const Answer asked = asked_;
  asked_.kind = Answer::Kind::kNone;
  if (asked.kind == Answer::Kind::kNone || !all_finite(measurement.change) ||
      !is_covariance(measurement.covariance)) {
    return false;
  }
  const TiedOffset told = {asked.added.value + measurement.change,
                           measurement.covariance + asked.added.covariance,
                           -asked.added.sensitivity};
  const bool by_map = asked.kind == Answer::Kind::kLandmarks;
  if (is_tied_ && !measurement.moved) {
    // Covariance of an answer in the measured view, without its own noise.
    Matrix2<double> known = of_telemetry(offset).covariance;
    if (by_map) {
      known = is_by_map_ ? covariance_in(asked.shared)
                         : known + offset.covariance + asked.shared.covariance;
    }
    if (told.covariance.trace() > known.trace()) return false;
  }
  tied_ = told;
  shared_ = asked.shared;
  is_tied_ = true;
  is_by_map_ = by_map;
  return true;
}

void BaseTie::move_map(const Vector2<double>& by) {
  if (is_by_map_) tied_.value += by;
  for (Answer* answer : {&last_, &asked_}) {
    if (answer->kind == Answer::Kind::kLandmarks) answer->added.value += by;
  }
}

void BaseTie::map_is_lost(const MapOffset& offset) {
  tied_ = of_telemetry(offset);
  shared_ = {};
  is_by_map_ = false;
  for (Answer* answer : {&last_, &asked_}) {
    if (answer->kind != Answer::Kind::kLandmarks) continue;
    answer->kind = Answer::Kind::kTelemetry;
    answer->added.value -= offset.value;
    answer->added.covariance += answer->shared.covariance + offset.covariance;
    answer->shared = {};
    answer->added.sensitivity += offset.sensitivity;
  }
}

}  // namespace alidade
