#include "alidade_ros/record.h"

#include "alidade_ros/record_conversion.h"

namespace alidade_ros {
namespace {

template <typename Read>
bool parse(const std::string& text, const char* what, std::string* error, const Read& read) {
  try {
    read(Json::parse(text));
    return true;
  } catch (const Json::exception& e) {
    *error = std::string("the edge's ") + what + " cannot be understood: " + e.what();
    return false;
  }
}

ClockPair clock_pair(const Json& json) {
  return {json.at("monotonic_s").get<double>(), json.at("wall_s").get<double>(),
          json.at("bracket_s").get<double>()};
}

template <typename T>
void read_estimate(const Json& calibration, const char* name, T* value, T* sigma) {
  const auto found = calibration.find(name);
  if (found == calibration.end()) return;
  *value = found->at("value").get<T>();
  *sigma = found->at("sigma").get<T>();
}

ZoomNodeValues zoom_node(const Json& json) {
  ZoomNodeValues node;
  node.reading = json.at("reading").get<double>();
  read_estimate(json, "focal_length", &node.focal_length, &node.focal_length_sigma);
  read_estimate(json, "radial_distortion", &node.radial_distortion, &node.radial_distortion_sigma);
  read_estimate(json, "centre_offset", &node.centre_offset, &node.centre_offset_sigma);
  return node;
}

// A parameter of the calibration; if null or absent, the default stays.
template <typename T>
void read_value(const Json& calibration, const char* name, T* value) {
  const auto found = calibration.find(name);
  if (found != calibration.end() && found->is_object()) *value = found->at("value").get<T>();
}

}  // namespace

bool parse_record(const std::string& text, Record* record, std::string* error) {
  return parse(text, "record", error, [&](const Json& json) { *record = record_of(json); });
}

bool parse_hello(const std::string& text, Hello* hello, std::string* error) {
  return parse(text, "greeting", error, [&](const Json& json) {
    *hello = {json.at("alidade").get<std::string>(), json.at("start").get<std::string>(),
              clock_pair(json)};
  });
}

bool parse_clock_pair(const std::string& text, ClockPair* pair, std::string* error) {
  return parse(text, "clock", error, [&](const Json& json) { *pair = clock_pair(json); });
}

bool parse_image_size(const std::string& text, std::optional<ImageSize>* size, std::string* error) {
  return parse(text, "status", error, [&](const Json& json) {
    const auto width = optional_of<int>(json.at("image"), "width");
    const auto height = optional_of<int>(json.at("image"), "height");
    size->reset();
    if (width && height) *size = ImageSize{*width, *height};
  });
}

bool parse_calibration(const std::string& text, CalibrationValues* values, std::string* error) {
  return parse(text, "calibration", error, [&](const Json& json) {
    CalibrationValues v;
    v.width = json.at("image").at("width").get<int>();
    v.height = json.at("image").at("height").get<int>();
    v.focal_length = json.at("focal_length").at("value").get<double>();
    read_value(json, "aspect", &v.aspect);
    read_value(json, "radial_distortion", &v.radial_distortion);
    read_value(json, "line_delay", &v.line_delay);
    read_value(json, "pan_axis", &v.pan_axis);
    read_value(json, "tilt_axis", &v.tilt_axis);
    read_value(json, "pan_scale", &v.pan_scale);
    read_value(json, "tilt_scale", &v.tilt_scale);
    read_value(json, "clock_offset", &v.clock_offset);
    read_value(json, "centre_offset", &v.centre_offset);
    const auto curve = json.find("zoom_curve");
    if (curve != json.end() && curve->is_object()) {
      v.zoom_repeatability = curve->at("repeatability").get<double>();
      for (const Json& node : curve->at("nodes")) v.zoom_nodes.push_back(zoom_node(node));
    }
    v.zoom = optional_of<double>(json, "zoom");
    const auto covariance = json.find("covariance");
    if (covariance != json.end() && covariance->is_object()) {
      v.names = covariance->at("names").get<std::vector<std::string>>();
      for (const auto& row : covariance->at("matrix").get<std::vector<std::vector<double>>>()) {
        v.covariance.insert(v.covariance.end(), row.begin(), row.end());
      }
    }
    *values = v;
  });
}

bool parse_plane(const std::string& text, PlaneValues* plane, std::string* error) {
  return parse(text, "plane", error, [&](const Json& json) {
    const auto value = [&json](const char* name) {
      return json.at(name).at("value").get<double>();
    };
    *plane = {value("heading"), value("pitch"), value("roll"),
              value("x"),       value("y"),     value("height")};
  });
}

}  // namespace alidade_ros
