#include "edge_app/output/plane_json.h"

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>

#include "core/model/trigonometry.h"

namespace alidade {

using Json = nlohmann::ordered_json;

Json plane_json(const PlaneEstimate& estimate) {
  const PlaneValues values = plane_values(estimate.plane);
  Json out{{"format", 1}, {"origin", nullptr}};
  if (estimate.origin) {
    out["origin"] = {{"latitude_deg", estimate.origin->latitude * 180 / kPi},
                     {"longitude_deg", estimate.origin->longitude * 180 / kPi},
                     {"height_m", estimate.origin->height_m}};
  }
  Json names = Json::array();
  Json matrix = Json::array();
  for (int i = 0; i < kPlaneParameterCount; ++i) {
    const char* name = kPlaneValueNames[static_cast<std::size_t>(i)];
    out[name] = {{"value", values.value[i]}, {"sigma", std::sqrt(values.covariance(i, i))}};
    names.push_back(name);
    Json row = Json::array();
    for (int j = 0; j < kPlaneParameterCount; ++j) row.push_back(values.covariance(i, j));
    matrix.push_back(row);
  }
  out["covariance"] = {{"names", names}, {"matrix", matrix}};
  return out;
}

Json plane_fit_json(const PlaneEvidence& evidence, const PlaneFit& fit) {
  const PlaneValues values = plane_values(fit.plane);
  Json json;
  json["status"] = to_string(fit.status);
  for (int i = 0; i < kPlaneParameterCount; ++i) {
    json[kPlaneValueNames[static_cast<std::size_t>(i)]] = {
        {"value", values.value[i]}, {"sigma", std::sqrt(values.covariance(i, i))}};
  }
  json["degrees_of_freedom"] = fit.degrees_of_freedom;
  json["noise_scale"] = fit.noise_scale;
  json["origin_below_camera"] = fit.origin_below_camera;
  json["heading_of_base"] = fit.heading_of_base;
  json["data"] = Json::array();
  for (std::size_t i = 0; i < fit.data.size(); ++i) {
    Json datum;
    datum["kind"] = to_string(evidence.data[i].kind);
    datum["name"] = evidence.data[i].name;
    datum["misfit"] = nullptr;
    if (fit.data[i].misfit) datum["misfit"] = *fit.data[i].misfit;
    datum["checked"] = fit.data[i].checked;
    json["data"].push_back(datum);
  }
  return json;
}

Json plane_point_json(const PlaneEstimate& estimate, const Vector3<double>& d_b,
                      const Matrix2<double>& cov_d) {
  PlanePoint point;
  const PlaneStatus status = plane_point(estimate.plane, d_b, cov_d, {}, &point);
  if (status != PlaneStatus::kOk) return Json{{"error", to_string(status)}};
  const Matrix2<double>& cov = point.covariance;
  const double off_diagonal = (cov(0, 1) + cov(1, 0)) / 2;
  Json out;
  out["position_m"] = {point.position.x(), point.position.y()};
  out["covariance_m2"] = {{cov(0, 0), off_diagonal}, {off_diagonal, cov(1, 1)}};
  out["distance_m"] = point.distance;
  if (estimate.origin) {
    const GeodeticPosition on_earth =
        LocalFrame(*estimate.origin).geodetic({point.position.x(), point.position.y(), 0});
    out["latitude_deg"] = on_earth.latitude * 180 / kPi;
    out["longitude_deg"] = on_earth.longitude * 180 / kPi;
  }
  return out;
}

}  // namespace alidade
