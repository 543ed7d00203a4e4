#include "test/simulator/config.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <cstdlib>
#include <functional>
#include <limits>
#include <set>
#include <utility>

namespace alidade::simulator {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr double kMilli = 1e-3;
constexpr double kMicro = 1e-6;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

struct Range {
  double lowest;
  double highest;
};
constexpr Range kAny{-kInfinity, kInfinity};
constexpr Range kNotNegative{0, kInfinity};
constexpr Range kPositive{std::numeric_limits<double>::min(), kInfinity};
constexpr Range kUnitInterval{0, 1};
constexpr Range kPort{0, 65535};

// One mapping of the file: every key is asked for by name, and finish() rejects what nobody asked
// for. A key that is absent leaves the value as it was.
class Section {
 public:
  Section(std::filesystem::path file, const YAML::Node& node, std::string name)
      : file_(std::move(file)), node_(node), name_(std::move(name)) {
    if (!node_.IsMap()) fail(node_, "'" + name_ + "' must hold keys with values");
  }

  [[noreturn]] void fail(const YAML::Node& node, const std::string& what) const {
    throw ConfigError(file_.string() + ":" + std::to_string(node.Mark().line + 1) + ": " + what);
  }
  [[noreturn]] void fail(const std::string& what) const { fail(node_, what); }

  // The number in the file times `unit` becomes the value; the range is that of the file.
  void number(const char* key, double* value, Range range = kAny, double unit = 1) {
    if (const YAML::Node node = take(key)) *value = scalar(node, key, range) * unit;
  }

  void integer(const char* key, int* value, Range range) {
    if (const YAML::Node node = take(key)) {
      const double number = scalar(node, key, range);
      if (number != std::floor(number)) fail(node, std::string(key) + " must be a whole number");
      *value = static_cast<int>(number);
    }
  }

  void pair(const char* key, Eigen::Vector2d* value, double unit) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsSequence() || node.size() != 2) {
        fail(node, std::string(key) + " must be two numbers: [a, b]");
      }
      *value = Eigen::Vector2d(scalar(node[0], key, kAny), scalar(node[1], key, kAny)) * unit;
    }
  }

  void text(const char* key, std::string* value) {
    if (const YAML::Node node = take(key)) {
      if (!node.IsScalar()) fail(node, std::string(key) + " must be a text");
      *value = node.Scalar();
    }
  }

  void path(const char* key, std::filesystem::path* value) {
    std::string name;
    text(key, &name);
    if (!name.empty()) *value = file_.parent_path() / name;
  }

  template <class Value>
  void choice(const char* key, Value* value,
              const std::vector<std::pair<const char*, Value>>& choices) {
    const YAML::Node node = take(key);
    if (!node) return;
    std::string names;
    for (const auto& [name, choice] : choices) {
      if (node.IsScalar() && node.Scalar() == name) {
        *value = choice;
        return;
      }
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    fail(node, std::string(key) + " must be one of: " + names);
  }

  void section(const char* key, const std::function<void(Section&)>& read) {
    if (const YAML::Node node = take(key)) visit(node, key, read);
  }

  void list(const char* key, const std::function<void(Section&)>& read) {
    const YAML::Node node = take(key);
    if (!node) return;
    if (!node.IsSequence()) fail(node, std::string(key) + " must be a list");
    for (const YAML::Node& item : node) visit(item, key, read);
  }

  void finish() const {
    for (const auto& item : node_) {
      const std::string key = item.first.Scalar();
      if (known_.count(key) == 0) fail(item.first, "unknown key '" + key + "' in " + name_);
    }
  }

 private:
  YAML::Node take(const char* key) {
    known_.insert(key);
    return std::as_const(node_)[key];
  }

  void visit(const YAML::Node& node, const char* key, const std::function<void(Section&)>& read) {
    Section section(file_, node, key);
    read(section);
    section.finish();
  }

  double scalar(const YAML::Node& node, const char* key, Range range) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value) || !std::isfinite(value)) {
      fail(node, std::string(key) + " must be a number");
    }
    if (value < range.lowest || value > range.highest) {
      std::string bounds = range.lowest == kPositive.lowest ? "more than 0" : "";
      if (bounds.empty() && range.highest == kInfinity) bounds = "0 or more";
      if (bounds.empty()) {
        bounds = "between " + YAML::Node(range.lowest).Scalar() + " and " +
                 YAML::Node(range.highest).Scalar();
      }
      fail(node, std::string(key) + " is " + node.Scalar() + ", must be " + bounds);
    }
    return value;
  }

  std::filesystem::path file_;
  YAML::Node node_;
  std::string name_;
  std::set<std::string> known_;
};

void read_image(Section& section, ImageConfig* image) {
  section.integer("width", &image->width, {16, 16384});
  section.integer("height", &image->height, {16, 16384});
  section.number("rate_hz", &image->rate_hz, kPositive);
}

void read_camera(Section& section, CameraConfig* camera) {
  section.number("focal_length_px", &camera->focal_length, kPositive);
  section.number("aspect", &camera->aspect, kPositive);
  section.number("radial_distortion", &camera->radial_distortion);
  section.number("line_delay_us", &camera->line_delay, kAny, kMicro);
  section.pair("pan_axis_mrad", &camera->pan_axis_offset, kMilli);
  section.pair("tilt_axis_mrad", &camera->tilt_axis_offset, kMilli);
  section.number("pan_scale", &camera->pan_scale, kPositive);
  section.number("tilt_scale", &camera->tilt_scale, kPositive);
  section.number("clock_offset_ms", &camera->clock_offset, kAny, kMilli);
}

void read_path(Section& section, PathConfig* path) {
  using Type = PathConfig::Type;
  section.choice<Type>("type", &path->type,
                       {{"triple_cosine", Type::kTripleCosine},
                        {"sweep", Type::kSweep},
                        {"jerky", Type::kJerky},
                        {"csv", Type::kCsv}});
  section.number("amplitude", &path->amplitude, kNotNegative);
  section.number("period_s", &path->period, kPositive);
  section.number("stop_s", &path->stop, kNotNegative);
  section.number("pan_deg", &path->pan, kAny, kDegree);
  section.number("tilt_deg", &path->tilt, kAny, kDegree);
  section.path("file", &path->file);
  if ((path->type == Type::kCsv) != !path->file.empty()) {
    section.fail("path needs 'file' with 'type: csv', and only then");
  }
  if (path->type == Type::kSweep && path->stop * 4 >= path->period) {
    section.fail("stop_s must be less than a quarter of period_s");
  }
}

PatchConfig read_direction(Section& section) {
  PatchConfig patch;
  section.number("azimuth_deg", &patch.azimuth, kAny, kDegree);
  section.number("elevation_deg", &patch.elevation, {-90, 90}, kDegree);
  section.number("width_deg", &patch.width, kPositive, kDegree);
  return patch;
}

void read_projection(Section& section, PatchConfig* patch) {
  using Projection = PatchConfig::Projection;
  section.choice<Projection>(
      "projection", &patch->projection,
      {{"tangent", Projection::kTangent}, {"equirectangular", Projection::kEquirectangular}});
}

// A photo's height follows from its picture and is checked when that is read.
void check_size(Section& section, const PatchConfig& patch, bool needs_height) {
  if (patch.width <= 0) section.fail("width_deg is missing");
  if (needs_height && patch.height <= 0) section.fail("height_deg is missing");
  const double largest =
      (patch.projection == PatchConfig::Projection::kTangent ? 170 : 360) * kDegree;
  if (patch.width > largest * (1 + 1e-12) || patch.height > largest * (1 + 1e-12)) {
    section.fail(
        "a patch is at most 170 degrees wide and high, or 360 with projection: equirectangular");
  }
}

void read_scene(Section& section, SceneConfig* scene) {
  section.number("background", &scene->background, kUnitInterval);
  section.number("detail", &scene->detail, kNotNegative);
  section.list("photos", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.path("file", &patch.file);
    read_projection(item, &patch);
    if (patch.file.empty()) item.fail("file is missing");
    check_size(item, patch, false);
    scene->photos.push_back(patch);
  });
  section.list("procedural", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.number("height_deg", &patch.height, kPositive, kDegree);
    read_projection(item, &patch);
    check_size(item, patch, true);
    scene->procedural.push_back(patch);
  });
  section.list("flat", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.number("height_deg", &patch.height, kPositive, kDegree);
    item.number("brightness", &patch.brightness, kUnitInterval);
    check_size(item, patch, true);
    scene->flat.push_back(patch);
  });
  section.list("moving", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.number("height_deg", &patch.height, kPositive, kDegree);
    item.number("brightness", &patch.brightness, kUnitInterval);
    item.number("azimuth_rate_deg_s", &patch.azimuth_rate, kAny, kDegree);
    item.number("elevation_rate_deg_s", &patch.elevation_rate, kAny, kDegree);
    check_size(item, patch, true);
    scene->moving.push_back(patch);
  });
}

void read_sensor(Section& section, SensorConfig* sensor) {
  section.number("exposure_ms", &sensor->exposure, kNotNegative, kMilli);
  section.number("shot_noise", &sensor->shot_noise, kNotNegative);
  section.number("read_noise", &sensor->read_noise, kNotNegative);
  section.number("vignetting", &sensor->vignetting, kUnitInterval);
  section.number("boil_px", &sensor->boil, kNotNegative);
  section.integer("jpeg_quality", &sensor->jpeg_quality, {1, 100});
  section.list("brightness_steps", [&](Section& item) {
    SensorConfig::Step step;
    item.number("time_s", &step.time);
    item.number("factor", &step.factor, kNotNegative);
    sensor->brightness_steps.push_back(step);
  });
  section.list("covered", [&](Section& item) {
    SensorConfig::Interval interval;
    item.number("from_s", &interval.from);
    item.number("to_s", &interval.to);
    sensor->covered.push_back(interval);
  });
}

void read_telemetry(Section& section, TelemetryConfig* telemetry) {
  section.number("rate_hz", &telemetry->rate_hz, kPositive);
  section.number("sigma_rad", &telemetry->sigma, kNotNegative);
  section.number("quantum_deg", &telemetry->quantum, kNotNegative, kDegree);
  section.number("internal_rate_hz", &telemetry->internal_rate_hz, kNotNegative);
  section.number("stale_repeat_probability", &telemetry->stale_repeat_probability, kUnitInterval);
  section.number("latency_ms", &telemetry->latency, kNotNegative, kMilli);
}

void read_jitter(Section& section, JitterConfig* jitter) {
  section.number("sigma_ms", &jitter->sigma, kNotNegative, kMilli);
  section.number("exponential_ms", &jitter->exponential, kNotNegative, kMilli);
  section.number("burst_ms", &jitter->burst, kNotNegative, kMilli);
  section.number("burst_probability", &jitter->burst_probability, kUnitInterval);
}

void read_timing(Section& section, TimingConfig* timing) {
  section.section("image_jitter", [&](Section& item) { read_jitter(item, &timing->image); });
  section.section("telemetry_jitter",
                  [&](Section& item) { read_jitter(item, &timing->telemetry); });
  section.number("frame_loss", &timing->frame_loss, {0, 0.99});
  section.number("image_clock_ppm", &timing->image_clock_skew, {-1e5, 1e5}, kMicro);
  section.number("image_period_sigma_us", &timing->image_period_sigma, kNotNegative, kMicro);
  section.number("telemetry_period_sigma_us", &timing->telemetry_period_sigma, kNotNegative,
                 kMicro);
}

void read_recording(Section& section, RecordingConfig* recording) {
  using Images = RecordingConfig::Images;
  section.choice<Images>("images", &recording->images,
                         {{"video", Images::kVideo},
                          {"png", Images::kPng},
                          {"pgm", Images::kPgm},
                          {"none", Images::kNone}});
  section.number("landmark_spacing", &recording->landmark_spacing, kPositive);
  section.number("pixel_sigma_px", &recording->pixel_sigma, kNotNegative);
}

void read_live(Section& section, LiveConfig* live) {
  using Codec = LiveConfig::Codec;
  section.integer("rtsp_port", &live->rtsp_port, kPort);
  section.integer("http_port", &live->http_port, kPort);
  section.choice<Codec>("codec", &live->codec,
                        {{"mjpeg", Codec::kMjpeg}, {"h264", Codec::kH264}, {"h265", Codec::kH265}});
  section.text("rtp_host", &live->rtp_host);
  section.integer("rtp_port", &live->rtp_port, kPort);
  section.path("sdp_file", &live->sdp_file);
  const auto optional_port = [&](const char* key, std::optional<int>* port) {
    int given = -1;
    section.integer(key, &given, kPort);
    if (given >= 0) *port = given;
  };
  optional_port("mjpeg_port", &live->mjpeg_port);
  optional_port("onvif_port", &live->onvif_port);
  if (live->mjpeg_port && live->codec != Codec::kMjpeg) {
    section.fail("mjpeg_port needs codec: mjpeg");
  }
  using Link = LiveConfig::Link;
  std::vector<std::pair<const char*, const HeadModel*>> heads;
  for (const HeadModel& model : kHeadModels) heads.emplace_back(model.name, &model);
  section.choice<const HeadModel*>("head", &live->head, heads);
  section.choice<Link>("head_link", &live->head_link,
                       {{"serial", Link::kSerial}, {"tcp", Link::kTcp}, {"udp", Link::kUdp}});
  section.text("user", &live->user);
  std::string variable;
  section.text("password_env", &variable);
  if (live->user.empty() != variable.empty()) {
    section.fail("user and password_env come together");
  }
  if (!variable.empty()) {
    const char* password = std::getenv(variable.c_str());
    if (password == nullptr) {
      section.fail("environment variable " + variable + " (password_env) is not set");
    }
    live->password = password;
  }
  if (live->rtp_host.empty() != (live->rtp_port == 0)) {
    section.fail("rtp_host and rtp_port come together");
  }
}

void read_config(Section& section, Config* config) {
  double seed = 1;
  section.number("seed", &seed, {0, 9007199254740992.0});
  config->seed = static_cast<std::uint64_t>(seed);
  section.number("duration_s", &config->duration, kNotNegative);
  section.section("image", [&](Section& item) { read_image(item, &config->image); });
  section.section("camera", [&](Section& item) { read_camera(item, &config->camera); });
  section.section("path", [&](Section& item) { read_path(item, &config->path); });
  section.section("scene", [&](Section& item) { read_scene(item, &config->scene); });
  section.section("sensor", [&](Section& item) { read_sensor(item, &config->sensor); });
  section.section("telemetry", [&](Section& item) { read_telemetry(item, &config->telemetry); });
  section.section("timing", [&](Section& item) { read_timing(item, &config->timing); });
  section.section("recording", [&](Section& item) { read_recording(item, &config->recording); });
  section.section("live", [&](Section& item) { read_live(item, &config->live); });
  section.section("guess", [&](Section& item) {
    double focal_length = 0;
    item.number("focal_length_px", &focal_length, kPositive);
    if (focal_length > 0) config->guess_focal_length = focal_length;
  });
  section.path("truth_dir", &config->truth_dir);
  section.finish();
  if (std::abs(config->camera.line_delay) * config->image.height * config->image.rate_hz > 1) {
    section.fail("camera: reading out all rows (line_delay_us x height) outlasts a frame");
  }
}

}  // namespace

Config load_config(const std::filesystem::path& file) {
  YAML::Node root;
  try {
    root = YAML::LoadFile(file.string());
  } catch (const YAML::BadFile&) {
    throw ConfigError(file.string() + ": cannot be read");
  } catch (const YAML::Exception& error) {
    throw ConfigError(file.string() + ":" + std::to_string(error.mark.line + 1) + ": " + error.msg);
  }
  Section section(file, root, "the configuration");
  Config config;
  read_config(section, &config);
  return config;
}

double horizontal_field_of_view(const Config& config) {
  return 2 * std::atan2(config.image.width, 2 * config.camera.focal_length);
}

}  // namespace alidade::simulator
