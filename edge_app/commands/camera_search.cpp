#include "edge_app/commands/camera_search.h"

#include <strings.h>

#include <algorithm>
#include <thread>
#include <vector>

#include "core/model/trigonometry.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/link_trial.h"
#include "platform/discovery/onvif_inquiry.h"
#include "platform/discovery/vapix_inquiry.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

constexpr std::size_t kAskedAtOnce = 16;
constexpr double kDegrees = 180 / kPi;

bool is_device_file(const std::string& device) { return !device.empty() && device[0] == '/'; }

bool is_meant(const FoundDevice& found, const std::string& device) {
  return !device.empty() && (device == found.host || device == found.onvif_url ||
                             device == found.vapix_url || device == found.endpoint);
}

// One that is named but did not answer the search: it may speak either.
FoundDevice unseen_device(const std::string& device) {
  FoundDevice found;
  const std::string url = device.find("://") == std::string::npos ? "http://" + device : device;
  Url parsed;
  std::string error;
  if (!parse_url(url, &parsed, &error) || (parsed.scheme != "http" && parsed.scheme != "https")) {
    throw CommandError(kExitUsage, device +
                                       ": is no device's address; expected for example "
                                       "192.0.2.10 or http://192.0.2.10:8080");
  }
  found.host = parsed.host;
  const std::string base =
      parsed.scheme + "://" + parsed.host + (parsed.port.empty() ? "" : ":" + parsed.port);
  const bool has_path = parsed.path.size() > 1;
  found.onvif_url = base + (has_path ? parsed.path : "/onvif/device_service");
  if (!has_path) found.vapix_url = base;
  return found;
}

bool is_axis(const DeviceReport& report) {
  return ::strncasecmp(report.maker.c_str(), "axis", 4) == 0;
}

// VAPIX first where it is offered: it can be asked more often, and knows more of an Axis device.
void inquire(const DeviceLogin& login, FoundCamera* camera) {
  FoundDevice& device = camera->device;
  if (device.vapix_url.empty() && device.note == kLinkLocalOnly) {
    camera->report.error = kLinkLocalOnly;
    device.note.clear();
    return;
  }
  if (!device.vapix_url.empty()) {
    camera->report = inquire_vapix(device.vapix_url, login);
    if (camera->report.error.empty() || device.onvif_url.empty()) return;
  }
  DeviceReport by_onvif = inquire_onvif(device.onvif_url, login);
  if (!by_onvif.error.empty() && camera->report.wants_login) return;
  if (by_onvif.error.empty() && !is_axis(by_onvif)) device.vapix_url.clear();
  camera->report = std::move(by_onvif);
}

void try_telemetry(const DeviceLogin& login, FoundCamera* camera) {
  const auto config = telemetry_of(camera->device, camera->report, login);
  if (!config || camera->report.error == kLinkLocalOnly) return;
  TelemetryTrial& trial = camera->telemetry;
  trial.type = config->type == PanTiltConfig::Type::kVapix ? "vapix" : "onvif";
  trial.url = config->url;
  // A further wrong login might lock the user out.
  if (camera->report.wants_login) return;
  trial.asked = true;
  PanTiltSample sample;
  if (!first_sample(*config, &sample, &trial.error)) return;
  trial.pan_deg = kDegrees * sample.pan_rad;
  trial.tilt_deg = kDegrees * sample.tilt_rad;
  trial.zoom = sample.zoom;
}

// Each on a thread of its own, as one that is silent takes seconds.
void ask_all(const CameraSearchOptions& options, const FoundCamera* chosen,
             std::vector<FoundCamera>* cameras) {
  for (std::size_t begin = 0; begin < cameras->size(); begin += kAskedAtOnce) {
    const std::size_t end = std::min(begin + kAskedAtOnce, cameras->size());
    std::vector<std::thread> threads;
    for (std::size_t i = begin; i < end; ++i) {
      FoundCamera* const camera = &(*cameras)[i];
      threads.emplace_back([&options, chosen, camera] {
        const DeviceLogin login = camera == chosen ? options.login : DeviceLogin();
        inquire(login, camera);
        camera->choice = choose_stream(camera->report.streams);
        if (options.try_telemetry) try_telemetry(login, camera);
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
}

}  // namespace

std::string onvif_url_for_config(const std::string& url) {
  Url parsed;
  std::string ignored;
  if (!parse_url(url, &parsed, &ignored)) return url;
  const bool usual_port = parsed.port.empty() || (parsed.scheme == "http" && parsed.port == "80") ||
                          (parsed.scheme == "https" && parsed.port == "443");
  return parsed.scheme + "://" + parsed.host + (usual_port ? "" : ":" + parsed.port) +
         (parsed.path == "/onvif/device_service" || parsed.path == "/" ? "" : parsed.path);
}

std::optional<PanTiltConfig> telemetry_of(const FoundDevice& device, const DeviceReport& report,
                                          const DeviceLogin& login) {
  if (report.has_pan_tilt == false) return std::nullopt;
  PanTiltConfig config;
  config.user = login.user;
  config.password = login.password;
  config.rules = login.rules;
  if (!device.vapix_url.empty()) {
    config.type = PanTiltConfig::Type::kVapix;
    config.url = device.vapix_url;
    return config;
  }
  if (device.onvif_url.empty()) return std::nullopt;
  config.type = PanTiltConfig::Type::kOnvif;
  config.url = onvif_url_for_config(device.onvif_url);
  config.rate_hz = 10;
  return config;
}

const FoundCamera* find_camera(const CameraFindings& findings, const std::string& device) {
  if (device.empty()) return findings.cameras.size() == 1 ? &findings.cameras.front() : nullptr;
  const auto found = std::find_if(
      findings.cameras.begin(), findings.cameras.end(),
      [&device](const FoundCamera& camera) { return is_meant(camera.device, device); });
  if (found != findings.cameras.end()) return &*found;
  // One that did not answer the search is found by what it was asked at.
  if (is_device_file(device)) return nullptr;
  const FoundDevice unseen = unseen_device(device);
  const auto same = std::find_if(
      findings.cameras.begin(), findings.cameras.end(),
      [&unseen](const FoundCamera& camera) { return camera.device.onvif_url == unseen.onvif_url; });
  return same == findings.cameras.end() ? nullptr : &*same;
}

const VideoDevice* find_video_device(const CameraFindings& findings, const std::string& device) {
  const auto found = std::find_if(
      findings.video_devices.begin(), findings.video_devices.end(),
      [&device](const VideoDevice& each) { return each.node == device || each.path == device; });
  return found == findings.video_devices.end() ? nullptr : &*found;
}

CameraFindings find_cameras(const CameraSearchOptions& options) {
  CameraFindings findings;
  if (options.network.duration_s > 0) {
    NetworkSearchResult found = search_network(options.network);
    findings.interfaces = std::move(found.interfaces);
    findings.notes = std::move(found.notes);
    for (FoundDevice& device : found.devices) {
      findings.cameras.emplace_back();
      findings.cameras.back().device = std::move(device);
    }
  }
  const bool by_network = !options.device.empty() && !is_device_file(options.device);
  if (by_network && find_camera(findings, options.device) == nullptr) {
    findings.cameras.emplace_back();
    findings.cameras.back().device = unseen_device(options.device);
  }
  const FoundCamera* const chosen =
      is_device_file(options.device) ? nullptr : find_camera(findings, options.device);
  ask_all(options, chosen, &findings.cameras);
  findings.video_devices = list_video_devices();
  findings.serial_ports = list_serial_ports();
  return findings;
}

}  // namespace alidade
