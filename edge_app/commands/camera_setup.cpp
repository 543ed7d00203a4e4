#include "edge_app/commands/camera_setup.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>

#include "edge_app/commands/command.h"
#include "edge_app/commands/link_trial.h"
#include "edge_app/setup/config_text.h"
#include "platform/pan_tilt/heads.h"
#include "platform/system/shown.h"
#include "platform/system/url.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFieldMissing =
    "the horizontal field of view is missing; give it from the data sheet with --field-of-view, in "
    "degrees: 3.4, or of a lens that zooms wide:tele, 62:2.3 (20 % off is near enough)";

// camera.password beside camera.yaml.
std::string default_password_file(const std::string& config) {
  return fs::path(config).replace_extension(".password").string();
}

// As the configuration names it: a file beside it moves with it.
std::string name_for(const std::string& config, const std::string& file) {
  const fs::path absolute = fs::absolute(file).lexically_normal();
  return absolute.parent_path() == fs::absolute(config).lexically_normal().parent_path()
             ? absolute.filename().string()
             : absolute.string();
}

// Removes a file that was written, unless all went well.
class Undo {
 public:
  explicit Undo(std::string path) : path_(std::move(path)) {}
  ~Undo() {
    if (!path_.empty()) ::unlink(path_.c_str());
  }
  Undo(const Undo&) = delete;
  Undo& operator=(const Undo&) = delete;
  void keep() { path_.clear(); }

 private:
  std::string path_;
};

class CameraSetup {
 public:
  CameraSetup(const CameraFindings& findings, const CameraSetupOptions& options)
      : findings_(findings), options_(options) {}

  CameraSetupResult run();

 private:
  void take_camera(const FoundCamera& camera);
  void take_video_device(const VideoDevice& device);
  void take_head();
  void set_size(int width, int height);
  void set_login(const std::string& section);
  void take_keys();
  [[nodiscard]] Config read() const;
  void try_links();
  [[nodiscard]] std::string text() const;

  const CameraFindings& findings_;
  const CameraSetupOptions& options_;
  ConfigText config_;
  std::string camera_name_;
  std::string password_name_;  // as the configuration names it; empty: no password
  int width_ = 0;
  bool holds_secret_ = false;  // the stream's URL holds one
  CameraSetupResult result_;
};

void CameraSetup::set_size(int width, int height) {
  width_ = width;
  config_.set("video", "width", std::to_string(width));
  config_.set("video", "height", std::to_string(height));
}

void CameraSetup::set_login(const std::string& section) {
  if (options_.user.empty()) return;
  config_.set_text(section, "user", options_.user);
  if (!password_name_.empty()) config_.set_text(section, "password_file", password_name_);
}

void CameraSetup::take_camera(const FoundCamera& camera) {
  const DeviceReport& report = camera.report;
  camera_name_ = name_of(camera) + " at " + camera.device.host;
  const VideoStream& stream = report.streams[*camera.choice.best];
  config_.set("video", "type", "rtsp");
  config_.set_text("video", "url", stream.url);
  holds_secret_ = without_secrets(stream.url) != stream.url;
  if (stream.width > 0) set_size(stream.width, stream.height);
  set_login("video");
  if (!camera.choice.reason.empty()) result_.remarks.push_back("stream: " + camera.choice.reason);
  if (!options_.head.empty()) return;
  DeviceLogin login;
  login.user = options_.user;
  const auto telemetry = telemetry_of(camera.device, report, login);
  if (!telemetry) {
    throw CommandError(kExitFailed, camera.device.host +
                                        ": has no pan and tilt of its own; name its head with "
                                        "--head, as pelco_d:/dev/ttyUSB0");
  }
  config_.set("pan_tilt", "type",
              telemetry->type == PanTiltConfig::Type::kVapix ? "vapix" : "onvif");
  config_.set_text("pan_tilt", "url", telemetry->url);
  set_login("pan_tilt");
  if (telemetry->type == PanTiltConfig::Type::kOnvif && stream.has_pan_tilt)
    config_.set_text("pan_tilt", "profile", stream.token);
}

void CameraSetup::take_video_device(const VideoDevice& device) {
  camera_name_ = device.name.empty() ? device.node : device.name;
  const std::vector<V4l2Mode> modes = ordered_modes(device.offers);
  config_.set("video", "type", "v4l2");
  config_.set_text("video", "device", device.path);
  if (!modes.empty()) {
    config_.set("video", "format", to_string(modes.front().format));
    set_size(modes.front().width, modes.front().height);
    if (modes.front().rate_hz > 0)
      config_.set("video", "rate_hz", fmt::format("{:g}", modes.front().rate_hz));
  }
  if (options_.head.empty()) {
    throw CommandError(kExitUsage, device.node +
                                       ": a camera on this machine reports no angles; name its "
                                       "head with --head, as pelco_d:/dev/ttyUSB0");
  }
}

void CameraSetup::take_head() {
  if (options_.head.empty()) return;
  const std::size_t colon = options_.head.find(':');
  const std::string type = options_.head.substr(0, colon);
  std::string names;
  bool known = false;
  for (const Head& head : kHeads) {
    known = known || type == head.key;
    names += (names.empty() ? "" : ", ") + std::string(head.key);
  }
  if (!known || colon == std::string::npos || colon + 1 == options_.head.size()) {
    throw CommandError(kExitUsage,
                       fmt::format("--head: '{}' is no head; expected TYPE:ADDRESS with a type of "
                                   "{}, as pelco_d:/dev/ttyUSB0 or ptu:tcp://192.0.2.7:4000",
                                   shown(options_.head), names));
  }
  const std::string address = options_.head.substr(colon + 1);
  config_.set("pan_tilt", "type", type);
  config_.set_text("pan_tilt", address[0] == '/' ? "device" : "url", address);
}

void CameraSetup::take_keys() {
  std::string error;
  for (const std::string& word : options_.keys) {
    if (!config_.set_by_word(word, &error)) throw CommandError(kExitUsage, "--set: " + error);
  }
}

std::string CameraSetup::text() const {
  return config_.text({"Written by alidade for " + escaped(camera_name_) + ".",
                       "Every key: /usr/share/doc/alidade/examples/alidade.yaml"});
}

Config CameraSetup::read() const {
  Config config;
  std::string error;
  if (!parse_config(text(), options_.path, &config, &error)) {
    throw CommandError(kExitUsage, error +
                                       "; nothing was written. A key is given with --set, as "
                                       "--set pan_tilt.pan_positive=left");
  }
  return config;
}

void CameraSetup::try_links() {
  const Config config = read();
  std::string error;
  VideoConfig video = config.video;
  video.width = video.height = 0;  // whatever size comes is taken
  if (video.type == VideoConfig::Type::kV4l2) video = config.video;
  int width = 0;
  int height = 0;
  if (!first_picture(video, &width, &height, &error)) {
    throw CommandError(kExitFailed, "the video does not come: " + error +
                                        "; nothing was written (--untried writes all the same)");
  }
  if (width != config.video.width || height != config.video.height) {
    if (config.video.width > 0) {
      result_.remarks.push_back(fmt::format("its pictures are {}x{}, not {}x{} as it says", width,
                                            height, config.video.width, config.video.height));
    }
    set_size(width, height);
  }
  PanTiltSample sample;
  if (!first_sample(config.pan_tilt, &sample, &error)) {
    const char* angles =
        wants_ranges(error) ? "; give both with --set, as --set 'pan_tilt.pan_range_deg=[-180,180]'"
                            : "";
    throw CommandError(kExitFailed, "the telemetry does not come: " + error + angles +
                                        "; nothing was written (--untried writes all the same)");
  }
}

CameraSetupResult CameraSetup::run() {
  refuse_existing_files(options_);
  refuse_unusable_camera(findings_, options_);
  const bool stores = !options_.password.empty() && options_.password_file.empty();
  const std::string stored = default_password_file(options_.path);
  if (stores) password_name_ = fs::path(stored).filename().string();
  if (!options_.password_file.empty())
    password_name_ = name_for(options_.path, options_.password_file);
  if (const VideoDevice* device = find_video_device(findings_, options_.device)) {
    take_video_device(*device);
  } else if (const FoundCamera* camera = find_camera(findings_, options_.device)) {
    take_camera(*camera);
  }
  take_head();
  config_.set("calibration", "file", "calibration.yaml");
  config_.set("output", "json", "false");
  config_.set_text("output", "http", "127.0.0.1:8080");
  config_.set_text("output", "recordings", "recordings");
  // Until the size of the pictures is known for certain.
  const auto set_focal_length = [this] {
    std::string value;
    std::string error;
    if (!focal_length_of(options_.field_of_view, width_, &value, &error))
      throw CommandError(kExitUsage, "--field-of-view: " + error);
    config_.set("camera", "focal_length_px", value);
  };
  const bool by_field = !options_.field_of_view.empty();
  if (lacks_field_of_view(options_)) throw CommandError(kExitUsage, kFieldMissing);
  if (by_field && width_ > 0) set_focal_length();
  take_keys();

  std::string error;
  if (stores && !write_file_atomically(stored, options_.password + "\n", &error, kForTheOwnerOnly))
    throw CommandError(kExitFailed, error);
  Undo password(stores ? stored : std::string());
  if (options_.try_links) try_links();
  if (by_field && width_ == 0) {
    throw CommandError(kExitFailed,
                       "the device does not tell the size of its pictures, and they were not "
                       "tried; give --set video.width=... and --set video.height=...");
  }
  if (by_field) set_focal_length();
  take_keys();
  static_cast<void>(read());
  if (!write_file_atomically(options_.path, text(), &error,
                             holds_secret_ ? kForTheOwnerOnly : kForAllToRead))
    throw CommandError(kExitFailed, error);
  password.keep();
  result_.path = options_.path;
  result_.password_file = stores ? stored : "";
  return result_;
}

}  // namespace

void refuse_unusable_camera(const CameraFindings& findings, const CameraSetupOptions& options) {
  if (const VideoDevice* device = find_video_device(findings, options.device)) {
    if (!device->error.empty())
      throw CommandError(kExitFailed, device->node + ": " + device->error);
    return;
  }
  const FoundCamera* const camera = find_camera(findings, options.device);
  if (camera == nullptr) {
    throw CommandError(
        kExitFailed,
        !options.device.empty() ? options.device + ": no such device was found"
        : findings.cameras.empty()
            ? "no camera was found on the network; name one with --device, by its address or as "
              "/dev/video0"
            : "several cameras were found; name one with --device, by its address or as "
              "/dev/video0");
  }
  const DeviceReport& report = camera->report;
  if (report.wants_login || !camera->choice.best) {
    throw CommandError(kExitFailed,
                       fmt::format("{}: {}", camera->device.host,
                                   report.error.empty() ? camera->choice.reason : report.error));
  }
}

bool lacks_field_of_view(const CameraSetupOptions& options) {
  return options.field_of_view.empty() &&
         std::none_of(options.keys.begin(), options.keys.end(), [](const std::string& word) {
           return word.rfind("camera.focal_length_px=", 0) == 0;
         });
}

void refuse_existing_files(const CameraSetupOptions& options) {
  std::error_code ignored;
  if (fs::exists(options.path, ignored)) {
    throw CommandError(kExitUsage,
                       options.path + ": exists already; give another name, or remove it first");
  }
  const std::string stored = default_password_file(options.path);
  if (!options.user.empty() && options.password_file.empty() && fs::exists(stored, ignored)) {
    throw CommandError(
        kExitUsage, stored + ": exists already; name it with --password-file, or remove it first");
  }
}

CameraSetupResult set_up_camera(const CameraFindings& findings, const CameraSetupOptions& options) {
  return CameraSetup(findings, options).run();
}

}  // namespace alidade
