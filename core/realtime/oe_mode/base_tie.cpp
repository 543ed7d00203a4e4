#include "core/realtime/oe_mode/base_tie.h"

#include <cmath>

#include "core/realtime/oe_mode/covariance.h"

namespace alidade {

bool BaseTieOptions::validate(const char** error) const {
  const char* problem = nullptr;
  if (!(drift >= 0)) problem = "drift must not be negative";
  if (error != nullptr && problem != nullptr) *error = problem;
  return problem == nullptr;
}

TiedOffset BaseTie::of_telemetry(const MapOffset& offset) const {
  if (!is_by_map_) return tied_;
  return {tied_.value - offset.value, tied_.covariance + offset.covariance,
          tied_.sensitivity - offset.sensitivity};
}

void BaseTie::drift(double elapsed_s) {
  if (is_tied_) {
    tied_.covariance.diagonal().array() += options_.drift * options_.drift * std::abs(elapsed_s);
  }
}

void BaseTie::note_telemetry(const Vector2<double>& added, const Matrix2<double>& covariance,
                             const Sensitivity<2>& sensitivity) {
  last_ = {Answer::Kind::kTelemetry, {added, covariance, sensitivity}};
}

void BaseTie::note_landmarks(const Vector2<double>& added, const Matrix2<double>& covariance,
                             const Sensitivity<2>& sensitivity) {
  last_ = {Answer::Kind::kLandmarks, {added, covariance, sensitivity}};
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
    TiedOffset known = tied_;
    if (by_map && !is_by_map_) known.covariance += offset.covariance;
    if (!by_map) known = of_telemetry(offset);
    if (told.covariance.trace() > known.covariance.trace()) return false;
  }
  tied_ = told;
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
  is_by_map_ = false;
  for (Answer* answer : {&last_, &asked_}) {
    if (answer->kind != Answer::Kind::kLandmarks) continue;
    answer->kind = Answer::Kind::kTelemetry;
    answer->added.value -= offset.value;
    answer->added.covariance += offset.covariance;
    answer->added.sensitivity += offset.sensitivity;
  }
}

}  // namespace alidade
