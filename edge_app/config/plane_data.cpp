#include "edge_app/config/plane_data.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <vector>

#include "core/model/rolling_shutter.h"
#include "edge_app/config/yaml_section.h"

namespace alidade {
namespace {

constexpr double kRadiansPerDegree = kPi / 180;
constexpr NumberRange kMetres{-1e7, 1e7, "m"};
constexpr NumberRange kLengthMetres{1e-3, 1e5, "m"};
constexpr NumberRange kSigmaMetres{1e-6, 1e6, "m"};
constexpr NumberRange kTurnDegrees{-360, 360, "degrees"};
constexpr NumberRange kSigmaDegrees{1e-6, 90, "degrees"};

// A picture whose pixels are used as sights.
struct NamedPicture {
  Camera<double> camera;
  double focal_length_sigma_px = 0;
  double line_delay_s = 0;
  FrameMotion<double> motion;
  // The record's orientation times the inverse of the orientation that nominal axes give.
  Matrix3<double> R_base_from_nominal;
  int look = 0;
};

double required(YamlSection& section, const std::string& key, const NumberRange& range,
                const std::string& expected) {
  const std::optional<double> value = section.number(key, range);
  if (!value) section.fail_missing(key, expected);
  return *value;
}

std::vector<double> required_list(YamlSection& section, const std::string& key, std::size_t count,
                                  const NumberRange& range, const std::string& expected) {
  const std::optional<std::vector<double>> values = section.numbers(key, count, range);
  if (!values) section.fail_missing(key, expected);
  return *values;
}

class PlaneDataReader {
 public:
  explicit PlaneDataReader(PlaneData* data) : data_(*data) {}

  void read(YamlSection& top) {
    if (top.integer("format", {1, 1, "version"}).value_or(0) != 1)
      top.fail_missing("format", "write `format: 1`");
    if (top.has("origin")) read_origin(top.section("origin"));
    read_pictures(top);
    read_base(top);
    for (YamlSection& point : top.sections("points")) read_point(point);
    for (YamlSection& item : top.sections("horizon"))
      add(item, on_horizon(name_of(item), sight_of(item)));
    for (YamlSection& item : top.sections("bearings")) {
      const double heading = required(item, "heading_deg", kTurnDegrees, "clockwise from y");
      const double sigma = required(item, "heading_sigma_deg", kSigmaDegrees, "of heading_deg");
      add(item, known_bearing(name_of(item), sight_of(item), heading * kRadiansPerDegree,
                              sigma * kRadiansPerDegree));
    }
    for (YamlSection& item : top.sections("verticals"))
      add(item, vertical(name_of(item), sight_of(item)));
    for (YamlSection& item : top.sections("lengths")) {
      const double length = required(item, "length_m", kLengthMetres, "the known length");
      add(item, known_length(name_of(item), sight_in(item, "from"), sight_in(item, "to"), length,
                             sigma_of(item)));
    }
    for (YamlSection& item : top.sections("uprights")) {
      const double height = required(item, "height_m", kLengthMetres, "of head above foot");
      add(item, upright(name_of(item), sight_in(item, "foot"), sight_in(item, "head"), height,
                        sigma_of(item)));
    }
    top.finish();
  }

 private:
  void add(const YamlSection& section, PlaneDatum datum) {
    section.finish();
    data_.evidence.data.push_back(std::move(datum));
  }

  static std::string name_of(YamlSection& section) {
    const std::optional<std::string> name = section.text("name");
    if (!name) section.fail_missing("name", "the report calls it by that");
    const auto is_control = [](char c) {
      return static_cast<unsigned char>(c) < 0x20 || c == 0x7F;
    };
    if (std::any_of(name->begin(), name->end(), is_control))
      section.fail("name", "has characters that are no text; give one line");
    return *name;
  }
  static double sigma_of(YamlSection& section) {
    return required(section, "sigma_m", kSigmaMetres, "one standard deviation");
  }

  void read_origin(YamlSection section) {
    data_.origin = geodetic(section, required(section, "height_m", kMetres, "above the ellipsoid"));
    frame_ = LocalFrame(*data_.origin);
    data_.evidence.y_is_north = true;
    section.finish();
  }

  static GeodeticPosition geodetic(YamlSection& section, double height_m) {
    const double latitude =
        required(section, "latitude_deg", {-90, 90, "degrees"}, "beside longitude_deg");
    const double longitude =
        required(section, "longitude_deg", {-360, 360, "degrees"}, "beside latitude_deg");
    return {latitude * kRadiansPerDegree, longitude * kRadiansPerDegree, height_m};
  }

  // with_height: z is read, too; in metres (z_m) it defaults to 0. Otherwise the place is on the
  // plane.
  Vector3<double> place_of(YamlSection& section, bool with_height) {
    if (section.has("latitude_deg") || section.has("longitude_deg")) {
      if (!frame_) {
        section.fail("latitude_deg",
                     "needs an origin: give origin: {latitude_deg: ..., longitude_deg: ..., "
                     "height_m: ...} at the top");
      }
      const double height_m = with_height ? required(section, "height_m", kMetres,
                                                     "above the ellipsoid, as the origin's")
                                          : data_.origin->height_m;
      return frame_->local(geodetic(section, height_m));
    }
    const double x = required(section, "x_m", kMetres, "or latitude_deg and longitude_deg");
    const double y = required(section, "y_m", kMetres, "beside x_m");
    return {x, y, with_height ? section.number("z_m", kMetres).value_or(0) : 0};
  }

  void read_base(YamlSection& top) {
    if (top.has("height")) {
      YamlSection section = top.section("height");
      const double height =
          required(section, "height_m", kLengthMetres, "of the camera above the plane");
      add(section, camera_height(height, sigma_of(section)));
    }
    if (top.has("level")) {
      YamlSection section = top.section("level");
      const double pitch = section.number("pitch_deg", {-90, 90, "degrees"}).value_or(0);
      const double roll = section.number("roll_deg", {-180, 180, "degrees"}).value_or(0);
      const double sigma = required(section, "sigma_deg", kSigmaDegrees, "of each of the tilts");
      add(section, base_level(pitch * kRadiansPerDegree, roll * kRadiansPerDegree,
                              sigma * kRadiansPerDegree));
    }
    if (top.has("heading")) {
      YamlSection section = top.section("heading");
      const double heading = required(section, "heading_deg", kTurnDegrees, "clockwise from y");
      const double sigma = required(section, "sigma_deg", kSigmaDegrees, "of heading_deg");
      add(section, base_heading(heading * kRadiansPerDegree, sigma * kRadiansPerDegree));
    }
    if (top.has("place")) {
      YamlSection section = top.section("place");
      const Vector3<double> place = place_of(section, false);
      add(section, camera_place(place.head<2>(), sigma_of(section)));
    }
  }

  void read_point(YamlSection& section) {
    const Vector3<double> place = place_of(section, true);
    const double sigma = sigma_of(section);
    add(section,
        known_point(name_of(section), sight_of(section), place, Vector3<double>::Constant(sigma)));
  }

  PlaneSight sight_in(YamlSection& section, const std::string& key) {
    if (!section.has(key)) section.fail_missing(key, "give a direction, or a picture and a pixel");
    YamlSection inside = section.section(key);
    PlaneSight sight = sight_of(inside);
    inside.finish();
    return sight;
  }

  PlaneSight sight_of(YamlSection& section) {
    if (section.has("picture") || section.has("pixel")) return seen_in_picture(section);
    const std::vector<double> values =
        required_list(section, "direction", 3, {-1e6, 1e6, "forward, right, down"},
                      "give a direction, or a picture and a pixel");
    const double sigma =
        required(section, "sigma_rad", {1e-9, 1, "rad"}, "one standard deviation of the direction");
    PlaneSight sight;
    sight.d_b = {values[0], values[1], values[2]};
    if (!(sight.d_b.norm() > 1e-9)) section.fail("direction", "has no length");
    sight.d_b.normalize();
    sight.covariance = sigma * sigma * Matrix2<double>::Identity();
    return sight;
  }

  PlaneSight seen_in_picture(YamlSection& section) {
    const std::optional<std::string> name = section.text("picture");
    if (!name) section.fail_missing("picture", "which of the pictures the pixel is of");
    const auto found = pictures_.find(*name);
    if (found == pictures_.end())
      section.fail("picture", fmt::format("'{}' is none of the pictures", *name));
    const NamedPicture& picture = found->second;
    const std::vector<double> pixel =
        required_list(section, "pixel", 2, {-1e5, 1e5, "px"}, "right and down in the picture");
    const double sigma_px =
        required(section, "sigma_px", {1e-4, 1e3, "px"}, "one standard deviation of the pixel");
    Vector3<double> d;
    Matrix<double, 3, 2> J_d_u;
    Matrix<double, 3, kParameterCount> J_d_parameters;
    const ProjectionStatus status = rolling_shutter_unproject(
        picture.camera, Mechanics<double>(), picture.line_delay_s, picture.motion,
        Vector2<double>(pixel[0], pixel[1]), &d, &J_d_u, nullptr, &J_d_parameters);
    if (status != ProjectionStatus::kOk) section.fail("pixel", to_string(status));
    PlaneSight sight;
    sight.d_b = picture.R_base_from_nominal * d;
    sight.d_b.normalize();
    const Matrix<double, 2, 3> to_tangent =
        tangent_basis(sight.d_b).transpose() * picture.R_base_from_nominal;
    const Matrix2<double> J_u = to_tangent * J_d_u;
    const Vector2<double> J_f = to_tangent * J_d_parameters.col(index(Parameter::kFocalLength)) *
                                picture.focal_length_sigma_px;
    sight.covariance = sigma_px * sigma_px * J_u * J_u.transpose() + J_f * J_f.transpose();
    sight.look = picture.look;
    return sight;
  }

  void read_pictures(YamlSection& top) {
    std::vector<YamlSection> pictures = top.sections("pictures");
    if (pictures.empty() && !top.has("image")) return;
    if (!top.has("image"))
      top.fail_missing("image", "the pictures' size: {width: 1920, height: 1080}");
    YamlSection image = top.section("image");
    const NumberRange size{1, 1e5, "px"};
    const auto width = static_cast<int>(required(image, "width", size, "of the pictures"));
    const auto height = static_cast<int>(required(image, "height", size, "of the pictures"));
    image.finish();
    for (YamlSection& section : pictures) {
      const std::string name = name_of(section);
      if (!section.has("record"))
        section.fail_missing("record", "a line of `alidade run` or `replay --json`");
      NamedPicture picture = read_record(section.section("record"));
      picture.camera.width = width;
      picture.camera.height = height;
      if (!pictures_.emplace(name, picture).second)
        section.fail("name", fmt::format("'{}' is another picture's", name));
      section.finish();
    }
  }

  // Does not call finish(): a record has many more fields.
  NamedPicture read_record(YamlSection record) {
    const std::string needed = "a record with an orientation is needed";
    const NumberRange any{-1e9, 1e9, "1"};
    NamedPicture out;
    out.camera.focal_length = required(record, "focal_length_px", {1, 1e7, "px"}, needed);
    out.focal_length_sigma_px = required(record, "focal_length_sigma_px", {0, 1e7, "px"}, needed);
    out.camera.aspect = required(record, "aspect", {0.1, 10, "1"}, needed);
    out.camera.distortion.only_term() =
        required(record, "radial_distortion", {-1e12, 1e12, "1"}, needed);
    const std::vector<double> centre =
        required_list(record, "centre_offset_px", 2, {-1e5, 1e5, "px"}, needed);
    out.camera.set_centre_offset({centre[0], centre[1]});
    out.line_delay_s = required(record, "line_delay_s", {-1, 1, "s"}, needed);
    const auto pair = [&](const char* pan, const char* tilt) {
      return PanTilt<double>{required(record, pan, any, needed),
                             required(record, tilt, any, needed)};
    };
    out.motion.angle = pair("pan_rad", "tilt_rad");
    out.motion.rate = pair("pan_rate_rad_s", "tilt_rate_rad_s");
    out.motion.acceleration = pair("pan_acceleration_rad_s2", "tilt_acceleration_rad_s2");
    const std::vector<double> q =
        required_list(record, "q_base_from_camera", 4, {-1.01, 1.01, "1"}, needed);
    const Eigen::Quaterniond orientation(q[3], q[0], q[1], q[2]);
    if (std::abs(orientation.norm() - 1) > 1e-3)
      record.fail("q_base_from_camera", "is no rotation: expected x, y, z, w of length 1");
    const Matrix3<double> R = orientation.normalized().toRotationMatrix();
    out.R_base_from_nominal =
        R * R_base_from_camera(Mechanics<double>(), out.motion.angle).transpose();
    const std::vector<double> cov =
        required_list(record, "orientation_covariance_rad2", 9, {-10, 10, "rad^2"}, needed);
    const Matrix3<double> covariance =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(cov.data());
    const Matrix3<double> in_base = R * covariance * R.transpose();
    out.look = static_cast<int>(data_.evidence.looks.size());
    data_.evidence.looks.push_back((in_base + in_base.transpose()) / 2);
    return out;
  }

  PlaneData& data_;
  std::optional<LocalFrame> frame_;
  std::map<std::string, NamedPicture> pictures_;
};

}  // namespace

bool parse_plane_data(const std::string& text, const std::string& name, PlaneData* data,
                      std::string* error) {
  *data = PlaneData();
  return parse_yaml(
      text, name, [data](YamlSection& top) { PlaneDataReader(data).read(top); }, error);
}

bool load_plane_data(const std::string& path, PlaneData* data, std::string* error) {
  *data = PlaneData();
  return read_yaml_file(
      path, [data](YamlSection& top) { PlaneDataReader(data).read(top); }, error);
}

}  // namespace alidade
