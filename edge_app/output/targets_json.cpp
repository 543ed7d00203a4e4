#include "edge_app/output/targets_json.h"

#include <nlohmann/json.hpp>

#include "core/model/trigonometry.h"
#include "edge_app/output/or_null.h"
#include "edge_app/tracking/frame_view.h"
#include "edge_app/tracking/target_report.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

template <int rows, int columns>
Json rows_of(const Matrix<double, rows, columns>& m) {
  Json out = Json::array();
  for (int i = 0; i < rows; ++i) {
    Json row = Json::array();
    for (int j = 0; j < columns; ++j) row.push_back(m(i, j));
    out.push_back(std::move(row));
  }
  return out;
}

Json pair_of(double first, double second) { return Json::array({first, second}); }

Json target_json(const TargetReport& target, TargetSpace space) {
  Json out{{"identity", target.identity},
           {"class", target.name.empty() ? Json() : Json(target.name)},
           {"score", target.score},
           {"born_s", target.born_s},
           {"seen_s", target.seen_s},
           {"in_view", target.in_view},
           {"direction", Json::array({target.d_b.x(), target.d_b.y(), target.d_b.z()})}};
  const auto& state = target.state;
  if (space == TargetSpace::kPlane) {
    out["position_m"] = pair_of((*state)[0], (*state)[1]);
    out["velocity_m_s"] = pair_of((*state)[2], (*state)[3]);
    if (target.on_earth) {
      out["latitude_deg"] = target.on_earth->latitude * 180 / kPi;
      out["longitude_deg"] = target.on_earth->longitude * 180 / kPi;
    }
  } else {
    out["azimuth_rad"] = state ? Json((*state)[0]) : Json();
    out["elevation_rad"] = state ? Json((*state)[1]) : Json();
    out["azimuth_rate_rad_s"] = state ? Json((*state)[2]) : Json();
    out["elevation_rate_rad_s"] = state ? Json((*state)[3]) : Json();
  }
  out["covariance"] = state ? rows_of(target.cov) : Json();
  out["pixel"] = target.pixel ? pair_of(target.pixel->x(), target.pixel->y()) : Json();
  out["covariance_px2"] = target.pixel ? rows_of(target.cov_px) : Json();
  out["box"] = nullptr;
  if (target.box) {
    out["box"] = {{"u", target.box->u},
                  {"v", target.box->v},
                  {"width", target.box->width},
                  {"height", target.box->height}};
  }
  return out;
}

}  // namespace

Json targets_json(const TargetsState& state, const OrientationRecord& record) {
  Json targets = Json::array();
  for (const TargetReport& target : report_targets(state, record))
    targets.push_back(target_json(target, state.space));
  return {{"frame", or_null(record.frame)},
          {"time_s", FrameView(record).time_s()},
          {"detected_frame", or_null(state.record.frame)},
          {"space", state.space == TargetSpace::kPlane ? "plane" : "sphere"},
          {"targets", std::move(targets)}};
}

std::string targets_line(const TargetsState& state) {
  return targets_json(state, state.record).dump(-1, ' ', false, Json::error_handler_t::replace) +
         "\n";
}

Json target_counters_json(const TargetCounters& counters) {
  Json frames;
  for (int i = 0; i < kDetectionStatusCount; ++i) {
    const auto status = static_cast<DetectionStatus>(i);
    frames[label_of(status)] = counters.of(status);
  }
  Json boxes;
  for (const auto& outcome : counters.boxes()) boxes[outcome.label] = outcome.boxes;
  return {{"frames", std::move(frames)},
          {"boxes", std::move(boxes)},
          {"births_refused", counters.births_refused}};
}

}  // namespace alidade
