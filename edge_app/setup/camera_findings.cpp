#include "edge_app/setup/camera_findings.h"

#include <fmt/format.h>

#include "platform/system/escaped.h"
#include "platform/system/text.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kMostModesShown = 6;

std::string b_frames_text(const VideoStream& stream) {
  switch (stream.b_frames) {
    case VideoStream::BFrames::kNone:
      return "no B-frames";
    case VideoStream::BFrames::kPossible:
      return "B-frames possible";
    case VideoStream::BFrames::kUnknown:
      break;
  }
  return "B-frames not told";
}

std::string stream_text(const VideoStream& stream) {
  std::string text = stream.width > 0 ? fmt::format("{}x{}", stream.width, stream.height)
                                      : std::string("size not told");
  text += " " + (stream.codec.empty() ? std::string("codec not told") : stream.codec);
  if (!stream.codec_profile.empty()) text += " " + stream.codec_profile;
  text += stream.rate_hz > 0 ? fmt::format(", {:g} Hz", stream.rate_hz) : ", rate not told";
  if (stream.codec != "JPEG") {
    text += stream.key_frame_distance > 0
                ? fmt::format(", key frame each {} pictures", stream.key_frame_distance)
                : std::string(", distance of key frames not told");
    text += ", " + b_frames_text(stream);
  }
  return text;
}

std::string mode_text(const V4l2Mode& mode) {
  return fmt::format("{} {}x{}", to_string(mode.format), mode.width, mode.height) +
         (mode.rate_hz > 0 ? fmt::format(", {:g} Hz", mode.rate_hz) : std::string());
}

std::string telemetry_text(const FoundCamera& camera) {
  const TelemetryTrial& trial = camera.telemetry;
  if (trial.type.empty()) {
    return camera.report.has_pan_tilt == false ? "none: the device has no pan and tilt"
                                               : "not known";
  }
  if (!trial.asked) return trial.type + ", not asked: it wants a login";
  // The configuration that is being written may have them already.
  if (wants_ranges(trial.error))
    return trial.type + " answers, in units of its own: " + trial.error;
  if (!trial.error.empty()) return trial.type + ", no angles: " + trial.error;
  return fmt::format("{} answers: pan {:.2f} deg, tilt {:.2f} deg", trial.type, trial.pan_deg,
                     trial.tilt_deg) +
         (trial.zoom ? fmt::format(", zoom {:g}", *trial.zoom) : std::string());
}

void add_line(const std::string& label, const std::string& text, std::string* out) {
  *out += fmt::format("  {:<13}{}\n", label, escaped(text));
}

void add_camera(const FoundCamera& camera, std::string* out) {
  const FoundDevice& device = camera.device;
  *out += fmt::format("{:<15}{}\n", escaped(device.host), escaped(name_of(camera)));
  const std::string via = device.interface.empty() ? std::string() : ", on " + device.interface;
  if (!device.vapix_url.empty()) add_line("VAPIX", shown_url(device.vapix_url) + via, out);
  if (!device.onvif_url.empty()) add_line("ONVIF", shown_url(device.onvif_url) + via, out);
  if (!camera.report.firmware.empty()) add_line("firmware", camera.report.firmware, out);
  const std::vector<VideoStream>& streams = camera.report.streams;
  for (std::size_t i = 0; i < streams.size(); ++i) {
    const bool best = camera.choice.best == i;
    add_line(best ? "take" : "stream", stream_text(streams[i]), out);
    add_line("", shown_url(streams[i].url), out);
    const std::string& why = best ? camera.choice.reason : camera.choice.remarks[i];
    if (!why.empty()) add_line("", why, out);
  }
  if (!streams.empty() && !camera.choice.best) add_line("take", camera.choice.reason, out);
  add_line("telemetry", telemetry_text(camera), out);
  if (camera.report.wants_login && !camera.report.error.empty()) {
    add_line("login", camera.report.error, out);
  } else if (!camera.report.error.empty()) {
    add_line("error", camera.report.error, out);
  }
  if (!device.note.empty()) add_line("note", device.note, out);
  for (const std::string& note : camera.report.notes) add_line("note", note, out);
}

void add_video_device(const VideoDevice& device, std::string* out) {
  *out += fmt::format("{:<15}{}\n", escaped(device.node), escaped(device.name));
  if (device.path != device.node) add_line("name", device.path, out);
  if (!device.error.empty()) {
    add_line("error", device.error, out);
    return;
  }
  const std::vector<V4l2Mode> modes = ordered_modes(device.offers);
  for (std::size_t i = 0; i < modes.size() && i < kMostModesShown; ++i)
    add_line(i == 0 ? "take" : "mode", mode_text(modes[i]), out);
  if (modes.size() > kMostModesShown)
    add_line("", fmt::format("and {} more", modes.size() - kMostModesShown), out);
  if (modes.empty()) add_line("error", "no format that can be used is listed", out);
}

Json or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }
Json or_null(double number) { return number > 0 ? Json(number) : Json(nullptr); }
Json or_null(int number) { return number > 0 ? Json(number) : Json(nullptr); }

Json json_of(const VideoStream& stream, const std::string& remark) {
  Json json;
  json["name"] = or_null(stream.name);
  json["url"] = shown_url(stream.url);
  json["codec"] = or_null(stream.codec);
  json["profile"] = or_null(stream.codec_profile);
  json["width"] = or_null(stream.width);
  json["height"] = or_null(stream.height);
  json["rate_hz"] = or_null(stream.rate_hz);
  json["key_frame_distance"] = or_null(stream.key_frame_distance);
  json["b_frames"] = stream.b_frames == VideoStream::BFrames::kUnknown
                         ? Json(nullptr)
                         : Json(stream.b_frames == VideoStream::BFrames::kPossible);
  json["remark"] = or_null(remark);
  return json;
}

Json json_of(const TelemetryTrial& trial) {
  Json json;
  json["type"] = or_null(trial.type);
  json["url"] = or_null(trial.url);
  const bool answers = trial.asked && trial.error.empty();
  json["answers"] = trial.asked ? Json(answers) : Json(nullptr);
  json["pan_deg"] = answers ? Json(trial.pan_deg) : Json(nullptr);
  json["tilt_deg"] = answers ? Json(trial.tilt_deg) : Json(nullptr);
  json["zoom"] = trial.zoom ? Json(*trial.zoom) : Json(nullptr);
  json["error"] = or_null(trial.error);
  return json;
}

Json json_of(const FoundCamera& camera) {
  Json json;
  json["host"] = camera.device.host;
  json["name"] = name_of(camera);
  json["maker"] = or_null(camera.report.maker);
  json["model"] = or_null(camera.report.model);
  json["firmware"] = or_null(camera.report.firmware);
  json["endpoint"] = or_null(camera.device.endpoint);
  json["interface"] = or_null(camera.device.interface);
  json["onvif"] = or_null(shown_url(camera.device.onvif_url));
  json["vapix"] = or_null(shown_url(camera.device.vapix_url));
  json["streams"] = Json::array();
  for (std::size_t i = 0; i < camera.report.streams.size(); ++i)
    json["streams"].push_back(json_of(camera.report.streams[i], camera.choice.remarks[i]));
  json["take"] = camera.choice.best ? Json(*camera.choice.best) : Json(nullptr);
  json["reason"] = or_null(camera.choice.reason);
  json["telemetry"] = json_of(camera.telemetry);
  json["wants_login"] = camera.report.wants_login;
  json["error"] = or_null(camera.report.error);
  json["notes"] = camera.report.notes;
  if (!camera.device.note.empty()) json["notes"].push_back(camera.device.note);
  return json;
}

}  // namespace

std::string name_of(const FoundCamera& camera) {
  const DeviceReport& report = camera.report;
  const FoundDevice& device = camera.device;
  if (!report.model.empty()) {
    const bool named = report.maker.empty() || report.model.rfind(report.maker, 0) == 0;
    return named ? report.model : report.maker + " " + report.model;
  }
  if (device.name.empty() && device.hardware.empty()) return "a camera without a name";
  if (device.hardware.empty() || device.name.find(device.hardware) != std::string::npos)
    return device.name;
  return device.name.empty() ? device.hardware : device.name + " " + device.hardware;
}

std::string text_of_findings(const CameraFindings& findings) {
  std::string out;
  for (const FoundCamera& camera : findings.cameras) add_camera(camera, &out);
  for (const VideoDevice& device : findings.video_devices) add_video_device(device, &out);
  for (const SerialPort& port : findings.serial_ports) {
    out += fmt::format("{:<15}serial port, {}\n", escaped(port.node),
                       escaped(port.name.empty() ? "unknown hardware" : port.name));
    if (port.path != port.node) add_line("name", port.path, &out);
    if (!port.error.empty()) add_line("error", port.error, &out);
  }
  for (const std::string& note : findings.notes) out += "note           " + escaped(note) + "\n";
  return out;
}

Json json_of_findings(const CameraFindings& findings) {
  Json json;
  json["interfaces"] = findings.interfaces;
  json["cameras"] = Json::array();
  for (const FoundCamera& camera : findings.cameras) json["cameras"].push_back(json_of(camera));
  json["video_devices"] = Json::array();
  for (const VideoDevice& device : findings.video_devices) {
    Json modes = Json::array();
    for (const V4l2Mode& mode : ordered_modes(device.offers)) {
      modes.push_back({{"format", to_string(mode.format)},
                       {"width", mode.width},
                       {"height", mode.height},
                       {"rate_hz", or_null(mode.rate_hz)}});
    }
    json["video_devices"].push_back({{"device", device.path},
                                     {"node", device.node},
                                     {"name", or_null(device.name)},
                                     {"modes", modes},
                                     {"error", or_null(device.error)}});
  }
  json["serial_ports"] = Json::array();
  for (const SerialPort& port : findings.serial_ports) {
    json["serial_ports"].push_back({{"device", port.path},
                                    {"node", port.node},
                                    {"name", or_null(port.name)},
                                    {"error", or_null(port.error)}});
  }
  json["notes"] = findings.notes;
  return json;
}

}  // namespace alidade
