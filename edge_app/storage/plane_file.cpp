#include "edge_app/storage/plane_file.h"

#include <yaml-cpp/yaml.h>

#include <cmath>

#include "core/calibration/number_text.h"
#include "core/model/trigonometry.h"
#include "edge_app/storage/named_values.h"

namespace alidade {
namespace {

constexpr double kDegrees = 180 / kPi;

std::string degrees_text(double angle) { return exact_text(angle * kDegrees); }

}  // namespace

std::string format_plane(const PlaneEstimate& estimate, const PlaneFit& fit) {
  constexpr std::array<const char*, kPlaneParameterCount> kMeanings = {
      "rad, of the base's forward direction, clockwise from y",
      "rad, forward lifted",
      "rad, right side lowered",
      "m, east",
      "m, north",
      "m, above the plane"};
  const PlaneValues values = plane_values(estimate.plane);
  YAML::Emitter out;
  out << YAML::BeginMap << YAML::Key << "format" << YAML::Value << 1;
  if (estimate.origin) {
    out << YAML::Key << "origin" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key
        << "latitude_deg" << YAML::Value << degrees_text(estimate.origin->latitude) << YAML::Key
        << "longitude_deg" << YAML::Value << degrees_text(estimate.origin->longitude) << YAML::Key
        << "height_m" << YAML::Value << exact_text(estimate.origin->height_m) << YAML::EndMap;
  }
  for (int i = 0; i < kPlaneParameterCount; ++i) {
    const auto at = static_cast<std::size_t>(i);
    out << YAML::Key << kPlaneValueNames[at] << YAML::Value << YAML::Flow << YAML::BeginMap
        << YAML::Key << "value" << YAML::Value << exact_text(values.value[i]) << YAML::Key
        << "sigma" << YAML::Value << exact_text(std::sqrt(values.covariance(i, i))) << YAML::EndMap
        << YAML::Comment(kMeanings[at]);
  }
  write_covariance(kPlaneValueNames, values.covariance, &out);
  out << YAML::Key << "quality" << YAML::Value << YAML::BeginMap;
  out << YAML::Key << "data" << YAML::Value << fit.data.size();
  out << YAML::Key << "degrees_of_freedom" << YAML::Value << fit.degrees_of_freedom;
  out << YAML::Key << "noise_scale" << YAML::Value << short_text(fit.noise_scale)
      << YAML::Comment("residuals / their sigmas");
  out << YAML::Key << "origin_below_camera" << YAML::Value << fit.origin_below_camera;
  out << YAML::Key << "heading_of_base" << YAML::Value << fit.heading_of_base;
  out << YAML::EndMap << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

}  // namespace alidade
