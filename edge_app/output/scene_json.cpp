#include "edge_app/output/scene_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

namespace alidade {

using Json = nlohmann::ordered_json;

namespace {

Json offset_json(const std::optional<BaseOffset>& offset) {
  if (!offset) return nullptr;
  return {{"pan_rad", offset->zero.pan},
          {"tilt_rad", offset->zero.tilt},
          {"sigma_rad", {std::sqrt(offset->covariance(0, 0)), std::sqrt(offset->covariance(1, 1))}},
          {"roll_rad", offset->roll}};
}

Json last_json(const std::optional<SceneReport::Last>& last, double now_s) {
  if (!last) return nullptr;
  Json sigmas;
  if (last->sigma_rad[0] > 0) {
    for (const double sigma : last->sigma_rad) sigmas.push_back(sigma);
  }
  return {{"frame", last->frame},          {"age_s", now_s - last->finished_s},
          {"took_s", last->took_s},        {"status", last->status},
          {"matches", last->matches},      {"by_hint", last->by_hint},
          {"sigma_rad", std::move(sigmas)}};
}

Json upkeep_json(const std::optional<UpkeepReport>& upkeep) {
  if (!upkeep) return nullptr;
  return {{"pictures", upkeep->pictures},
          {"updates", upkeep->updates},
          {"expected", upkeep->expected},
          {"updated", upkeep->updated},
          {"beyond_gate", upkeep->beyond_gate},
          {"born", upkeep->born},
          {"died", upkeep->died},
          {"not_close", upkeep->not_close},
          {"hidden", upkeep->hidden},
          {"stopped", upkeep->stopped}};
}

}  // namespace

Json scene_json(const SceneReport& report, double now_s) {
  return {{"file", report.name},
          {"keyframes", report.keyframes},
          {"landmarks", report.landmarks},
          {"ready", report.ready},
          {"pictures",
           {{"looked_at", report.pictures},
            {"found", report.found},
            {"found_by_hint", report.found_by_hint},
            {"not_in_map", report.not_in_map},
            {"ambiguous", report.ambiguous},
            {"unusable", report.unusable}}},
          {"last", last_json(report.last, now_s)},
          {"offset", offset_json(report.offset)},
          {"movements", report.movements},
          {"moved", offset_json(report.moved)},
          {"uncorrected", report.uncorrected},
          {"upkeep", upkeep_json(report.upkeep)}};
}

}  // namespace alidade
