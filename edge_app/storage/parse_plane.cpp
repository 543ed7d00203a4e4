#include <string>
#include <vector>

#include "core/calibration/estimate_reader.h"
#include "core/calibration/number_text.h"
#include "core/model/trigonometry.h"
#include "edge_app/storage/named_values.h"
#include "edge_app/storage/plane_file.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr double kRadians = kPi / 180;

EstimateRange plausible_plane_range(std::size_t value) {
  switch (value) {
    case 0:
      return {-2 * kPi, 2 * kPi, "radians, clockwise from y"};
    case 1:
      return {-kPi / 2, kPi / 2, "radians, from -pi/2 to pi/2"};
    case 2:
      return {-kPi, kPi, "radians, from -pi to pi"};
    case 5:
      return {1e-3, 1e5, "metres above the plane"};
    default:
      return {-1e7, 1e7, "metres"};
  }
}

class PlaneReader {
 public:
  PlaneReader(const YAML::Node& root, const std::string& name) : file_(root, name) {}

  PlaneEstimate read() const {
    std::vector<std::string> known = {"format", "origin"};
    known.insert(known.end(), kPlaneValueNames.begin(), kPlaneValueNames.end());
    known.insert(known.end(), {"covariance", "quality"});
    file_.check_top("a plane", known);
    const YAML::Node& root = file_.root();
    PlaneEstimate estimate;
    if (root["origin"]) estimate.origin = read_origin(root["origin"]);
    const auto [value, cov] = read_named_values(
        file_, kPlaneValueNames, plausible_plane_range, [](const auto&) {}, "rad or m", "values");
    if (root["quality"] && !root["quality"].IsMap()) {
      file_.fail(root["quality"], "quality is not a map; write `quality: {name: value, ...}`");
    }
    const BaseAttitude attitude{value[0], value[1], value[2]};
    estimate.plane.R_base_from_world = R_base_from_world_of(value[0], value[1], value[2]);
    estimate.plane.position = value.tail<3>();
    PlaneCovariance J = PlaneCovariance::Identity();
    J.topLeftCorner<3, 3>() = attitude_jacobian(attitude);
    estimate.plane.covariance = J * cov * J.transpose();
    return estimate;
  }

 private:
  GeodeticPosition read_origin(const YAML::Node& origin) const {
    if (!origin.IsMap()) {
      file_.fail(
          origin,
          "origin is not a map; write {latitude_deg: ..., longitude_deg: ..., height_m: ...}");
    }
    file_.check_keys(origin, {"latitude_deg", "longitude_deg", "height_m"}, "origin.");
    const auto number = [&](const char* key, double most, const char* hint) {
      const YAML::Node node = file_.required(origin, key, "origin.");
      const double value = file_.number(node, std::string("origin.") + key);
      if (std::abs(value) > most)
        file_.fail(node, std::string("origin.") + key + " is " + node.Scalar() + "; give " + hint);
      return value;
    };
    return {number("latitude_deg", 90, "degrees from -90 to 90") * kRadians,
            number("longitude_deg", 360, "degrees from -180 to 180") * kRadians,
            number("height_m", 1e5, "metres above the ellipsoid")};
  }

  const EstimateReader file_;
};

}  // namespace

bool parse_plane(const std::string& text, const std::string& name, PlaneEstimate* estimate,
                 std::string* error) {
  return read_yaml(
      text, name, {"", "; valid YAML is needed"},
      [&](const YAML::Node& root) { *estimate = PlaneReader(root, name).read(); }, error);
}

bool load_plane(const std::string& path, PlaneEstimate* estimate, std::string* error) {
  std::string text;
  return read_file(path, &text, error) && parse_plane(text, path, estimate, error);
}

}  // namespace alidade
