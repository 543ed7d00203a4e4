#include "edge_app/config/pan_tilt_config.h"

#include <algorithm>
#include <vector>

#include "edge_app/config/link_keys.h"

namespace alidade {
namespace {

constexpr NumberRange kAngle{0, 0.1, "rad"};

// Printable ASCII without blanks.
bool is_printable(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7F'; });
}

// "/path" or ":8080/path".
bool is_path_of_a_service(const std::string& text) {
  const std::size_t path = text.find('/');
  if (path == std::string::npos) return false;
  const std::string port = text.substr(0, path);
  return port.empty() || (port.size() > 1 && port.size() <= 6 && port[0] == ':' &&
                          port.find_first_not_of("0123456789", 1) == std::string::npos);
}

// The angles at both ends of the device's scale. They must differ.
std::optional<std::array<double, 2>> read_range(YamlSection& section, const std::string& key) {
  const auto ends = section.numbers(key, 2, {-360, 360, "deg"});
  if (!ends) return std::nullopt;
  if (ends->front() == ends->back()) {
    section.fail(key, "spans no angle; give the angles at -1 and at 1");
  }
  return std::array<double, 2>{ends->front(), ends->back()};
}

// The positions that the device reports at these ends. They must differ.
std::optional<std::array<double, 2>> read_scale(YamlSection& section, const std::string& key) {
  const auto ends = section.numbers(key, 2, {-1e6, 1e6, "of the device's own scale"});
  if (!ends) return std::nullopt;
  if (ends->front() == ends->back()) {
    section.fail(key, "spans nothing; give what the device tells at both ends of the range");
  }
  return std::array<double, 2>{ends->front(), ends->back()};
}

void read_onvif(YamlSection& section, PanTiltConfig* pan_tilt) {
  pan_tilt->profile = section.text("profile").value_or("");
  pan_tilt->pan_range_deg = read_range(section, "pan_range_deg");
  pan_tilt->tilt_range_deg = read_range(section, "tilt_range_deg");
  pan_tilt->pan_scale = read_scale(section, "pan_scale");
  pan_tilt->tilt_scale = read_scale(section, "tilt_scale");
  pan_tilt->ptz_path = section.text("ptz_path").value_or("");
  if (!pan_tilt->ptz_path.empty() &&
      (!is_path_of_a_service(pan_tilt->ptz_path) || !is_printable(pan_tilt->ptz_path))) {
    section.fail("ptz_path",
                 "must be a path like /onvif/ptz_service, or with a port of its own like "
                 "':8080/onvif/ptz_service'; the host is that of url");
  }
  pan_tilt->rate_hz = 10;  // a SOAP request costs a camera much time
}

// After finish(): a key that seems missing may be there, mistyped.
void check_ranges(const YamlSection& section, const PanTiltConfig& pan_tilt) {
  if (pan_tilt.pan_range_deg.has_value() != pan_tilt.tilt_range_deg.has_value()) {
    section.fail(pan_tilt.pan_range_deg ? "tilt_range_deg" : "pan_range_deg",
                 "is missing; give pan_range_deg and tilt_range_deg, or neither");
  }
  if (pan_tilt.pan_scale.has_value() != pan_tilt.tilt_scale.has_value()) {
    section.fail(pan_tilt.pan_scale ? "tilt_scale" : "pan_scale",
                 "is missing; give pan_scale and tilt_scale, or neither");
  }
  if (pan_tilt.pan_scale && !pan_tilt.pan_range_deg) {
    section.fail("pan_scale",
                 "is what the device tells at both ends of pan_range_deg, which is missing; give "
                 "pan_range_deg and tilt_range_deg, too");
  }
}

// A value of pan_tilt.type.
struct PanTiltType {
  std::string key;
  PanTiltConfig::Type type;
  std::optional<HeadType> head;  // only for kHead
};

std::vector<PanTiltType> pan_tilt_types() {
  using Type = PanTiltConfig::Type;
  std::vector<PanTiltType> types = {{"vapix", Type::kVapix, {}}, {"onvif", Type::kOnvif, {}}};
  for (const Head& head : kHeads) types.push_back({head.key, Type::kHead, head.type});
  types.push_back({"recording", Type::kRecording, {}});
  types.push_back({"none", Type::kNone, {}});
  return types;
}

PanTiltType read_pan_tilt_type(YamlSection& section) {
  const std::vector<PanTiltType> types = pan_tilt_types();
  std::vector<std::string> keys(types.size());
  std::transform(types.begin(), types.end(), keys.begin(),
                 [](const PanTiltType& type) { return type.key; });
  const std::string key = required_choice(section, "type", keys);
  return *std::find_if(types.begin(), types.end(),
                       [&](const PanTiltType& type) { return type.key == key; });
}

// The keys of all devices that are polled over HTTP.
void read_http_device(YamlSection& section, const std::string& config_path,
                      PanTiltConfig* pan_tilt) {
  pan_tilt->url = required_url(section, "http://camera", {"http://", "https://"});
  read_login(section, config_path, &pan_tilt->user, &pan_tilt->password);
  pan_tilt->rules = read_link_rules(section);
}

// The keys that belong to one type only.
void read_device(YamlSection& section, const PanTiltType& type, const std::string& path,
                 PanTiltConfig* pan_tilt) {
  constexpr NumberRange kRate{0.1, 1000, "Hz"};
  switch (type.type) {
    case PanTiltConfig::Type::kVapix:
      read_http_device(section, path, pan_tilt);
      pan_tilt->camera =
          section.integer("camera", {1, 64, "camera number"}).value_or(pan_tilt->camera);
      pan_tilt->rate_hz = section.number("rate_hz", kRate).value_or(pan_tilt->rate_hz);
      pan_tilt->axes = read_axes(section, kRightAndUp);
      return;
    case PanTiltConfig::Type::kOnvif:
      read_http_device(section, path, pan_tilt);
      read_onvif(section, pan_tilt);
      pan_tilt->rate_hz = section.number("rate_hz", kRate).value_or(pan_tilt->rate_hz);
      pan_tilt->axes = read_axes(section, kRightAndUp);
      return;
    case PanTiltConfig::Type::kHead:
      pan_tilt->head = read_head(section, *type.head, path, &pan_tilt->rate_hz);
      pan_tilt->axes = read_axes(section, head_of(*type.head).signs);
      return;
    case PanTiltConfig::Type::kRecording:
      pan_tilt->directory =
          path_relative_to(path, required_text(section, "directory", "my-recording"));
      return;
    case PanTiltConfig::Type::kNone:
      return;
  }
}

}  // namespace

PanTiltConfig read_pan_tilt(YamlSection section, const std::string& path) {
  PanTiltConfig pan_tilt;
  const PanTiltType type = read_pan_tilt_type(section);
  pan_tilt.type = type.type;
  read_device(section, type, path, &pan_tilt);
  if (type.type == PanTiltConfig::Type::kNone) {
    section.finish();  // no telemetry: all other keys are unknown
    return pan_tilt;
  }
  if (type.type != PanTiltConfig::Type::kRecording) {
    pan_tilt.timeout_s = section.number("timeout_s", kSeconds).value_or(pan_tilt.timeout_s);
    pan_tilt.max_backoff_s =
        section.number("max_backoff_s", kSeconds).value_or(pan_tilt.max_backoff_s);
  }
  pan_tilt.angle_sigma_rad = section.number("angle_sigma_rad", kAngle);
  pan_tilt.angle_quantum_rad =
      section.number("angle_quantum_rad", kAngle).value_or(pan_tilt.angle_quantum_rad);
  if (pan_tilt.angle_sigma_rad == 0.0 && pan_tilt.angle_quantum_rad == 0) {
    section.fail("angle_sigma_rad",
                 "no head measures without error; give a sigma or angle_quantum_rad above 0");
  }
  pan_tilt.angle_accuracy_deg =
      section.number("angle_accuracy_deg", {0, 5, "deg"}).value_or(pan_tilt.angle_accuracy_deg);
  pan_tilt.acceleration_sigma_rad_s2 =
      section.number("acceleration_sigma_rad_s2", {0, 1000, "rad/s^2"})
          .value_or(pan_tilt.acceleration_sigma_rad_s2);
  pan_tilt.max_repeat_s =
      section.number("max_repeat_s", {0, 10, "s"}).value_or(pan_tilt.max_repeat_s);
  section.finish();
  check_ranges(section, pan_tilt);
  return pan_tilt;
}

}  // namespace alidade
