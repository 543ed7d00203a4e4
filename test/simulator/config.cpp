#include "test/simulator/config.h"

#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "test/simulator/config_section.h"
#include "test/simulator/pattern_board.h"
#include "test/simulator/zoom.h"

namespace alidade::simulator {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr double kMilli = 1e-3;
constexpr double kMicro = 1e-6;
constexpr Range kDistance{0.6, 1e6};  // more than the pupil may be off

void read_image(Section& section, ImageConfig* image) {
  section.integer("width", &image->width, {16, 16384});
  section.integer("height", &image->height, {16, 16384});
  section.number("rate_hz", &image->rate_hz, kPositive);
}

void read_camera(Section& section, bool zooms, CameraConfig* camera) {
  for (const char* key : {"focal_length_px", "radial_distortion", "radial_distortion_2",
                          "tangential_distortion", "centre_px"}) {
    if (zooms && section.has(key)) {
      section.fail(std::string(key) + " belongs to a lens without zoom: zoom has its own");
    }
  }
  section.number("focal_length_px", &camera->focal_length, kPositive);
  section.number("aspect", &camera->aspect, kPositive);
  section.number("radial_distortion", &camera->radial_distortion);
  section.number("radial_distortion_2", &camera->radial_distortion_2);
  section.pair("tangential_distortion", &camera->tangential, 1);
  section.pair("centre_px", &camera->centre, 1);
  section.triple("pupil_cm", &camera->pupil, {-50, 50}, 1e-2);
  section.list("sway", [&](Section& item) {
    using Axis = Swing::Axis;
    Swing swing;
    item.choice<Axis>(
        "axis", &swing.axis,
        {{"forward", Axis::kForward}, {"right", Axis::kRight}, {"down", Axis::kDown}});
    item.number("amplitude_mrad", &swing.amplitude, {0, 100}, kMilli);
    item.number("frequency_hz", &swing.frequency, kNotNegative);
    item.number("phase_deg", &swing.phase, kAny, kDegree);
    camera->sway.push_back(swing);
  });
  section.section("breathing", [&](Section& item) {
    using Type = Breathing::Type;
    item.choice<Type>("type", &camera->breathing.type,
                      {{"linear", Type::kLinear}, {"sine", Type::kSine}});
    item.number("part", &camera->breathing.part, {-0.05, 0.05});
    item.number("period_s", &camera->breathing.period, kPositive);
  });
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
  section.number("focal_length_px", &path->focal_length, kPositive);
  section.flag("follows_zoom", &path->follows_zoom);
  section.number("pan_deg", &path->pan, kAny, kDegree);
  section.number("tilt_deg", &path->tilt, kAny, kDegree);
  section.path("file", &path->file);
  if ((path->type == Type::kCsv) != !path->file.empty()) {
    section.fail("path needs 'file' with 'type: csv', and only then");
  }
  if (path->follows_zoom && (path->type == Type::kCsv || path->focal_length > 0)) {
    section.fail("follows_zoom: neither 'type: csv' nor focal_length_px goes with it");
  }
  if (path->type == Type::kSweep && path->stop * 4 >= path->period) {
    section.fail("stop_s must be less than a quarter of period_s");
  }
}

// A number, or nearest and farthest.
void read_distance(Section& section, const char* key, bool map,
                   std::optional<DistanceConfig>* distance) {
  if (!section.has(key)) return;
  DistanceConfig& given = distance->emplace();
  if (!section.is_section(key)) {
    section.number(key, &given.nearest, kDistance);
    given.farthest = given.nearest;
    return;
  }
  section.section(key, [&](Section& item) {
    item.number("nearest", &given.nearest, kDistance);
    item.number("farthest", &given.farthest, kDistance);
    if (map) {
      item.integer("layers", &given.layers, {0, 16});
      item.number("length_deg", &given.length, {0.01, 180}, kDegree);
    }
    if (given.nearest == 0 || given.farthest < given.nearest) {
      item.fail(std::string(key) + " needs nearest, and farthest that is not less");
    }
  });
}

PatchConfig read_direction(Section& section) {
  PatchConfig patch;
  section.number("azimuth_deg", &patch.azimuth, kAny, kDegree);
  section.number("elevation_deg", &patch.elevation, {-90, 90}, kDegree);
  section.number("width_deg", &patch.width, kPositive, kDegree);
  read_distance(section, "distance_m", true, &patch.distance);
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

void read_clouds(Section& section, CloudsConfig* clouds) {
  section.number("fraction", &clouds->fraction, kUnitInterval);
  section.number("rate_deg_s", &clouds->rate, {0, 360}, kDegree);
  section.number("rate_px_s", &clouds->rate_px, {0, 1e5});
  section.number("heading_deg", &clouds->heading, kAny, kDegree);
  section.number("size_px", &clouds->size_px, {8, 1e5});
  section.number("brightness", &clouds->brightness, kUnitInterval);
  section.number("contrast", &clouds->contrast, kUnitInterval);
  section.number("above_deg", &clouds->above, {-90, 90}, kDegree);
  if (clouds->rate > 0 && clouds->rate_px > 0) {
    section.fail("clouds have rate_deg_s or rate_px_s, not both");
  }
}

void read_water(Section& section, WaterConfig* water) {
  section.number("below_deg", &water->below, {-90, 90}, kDegree);
  section.number("rate_px_s", &water->rate_px, {0, 1e5});
  section.number("size_px", &water->size_px, {8, 1e5});
  section.number("brightness", &water->brightness, kUnitInterval);
  section.number("contrast", &water->contrast, kUnitInterval);
}

void read_flutter(Section& section, PatchConfig* patch) {
  section.section("flutter", [&](Section& item) {
    FlutterConfig& flutter = patch->flutter.emplace();
    item.number("rms_px", &flutter.rms_px, {0, 100});
    item.number("size_px", &flutter.size_px, {4, 1e5});
    item.number("rate_hz", &flutter.rate_hz, {0, 100});
  });
}

void read_scene(Section& section, SceneConfig* scene) {
  section.section("clouds", [&](Section& item) { read_clouds(item, &scene->clouds.emplace()); });
  section.section("water", [&](Section& item) { read_water(item, &scene->water.emplace()); });
  section.number("background", &scene->background, kUnitInterval);
  section.number("detail", &scene->detail, kNotNegative);
  section.list("photos", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.path("file", &patch.file);
    read_projection(item, &patch);
    read_flutter(item, &patch);
    if (patch.file.empty()) item.fail("file is missing");
    check_size(item, patch, false);
    scene->photos.push_back(patch);
  });
  section.list("procedural", [&](Section& item) {
    PatchConfig patch = read_direction(item);
    item.number("height_deg", &patch.height, kPositive, kDegree);
    read_projection(item, &patch);
    read_flutter(item, &patch);
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
  section.number("boil_length_px", &sensor->boil_length, {4, 1e5});
  section.number("boil_time_s", &sensor->boil_time, {1e-3, 1e5});
  section.number("noise_reduction", &sensor->noise_reduction, {0, 0.95});
  section.section("sharpening", [&](Section& item) {
    item.number("amount", &sensor->sharpening, {0, 5});
    item.number("radius_px", &sensor->sharpening_radius, {0.3, 20});
  });
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

void read_gear(Section& section, double quantum, TelemetryConfig* telemetry) {
  for (const auto& [axis, gear] :
       {std::pair{"pan", &telemetry->pan_gear}, {"tilt", &telemetry->tilt_gear}}) {
    section.list(axis, [&, harmonics = gear](Section& item) {
      GearHarmonic harmonic;
      item.number("amplitude_mrad", &harmonic.amplitude, {0, 100}, kMilli);
      item.number("period_deg", &harmonic.period, {0.01, 360}, kDegree);
      item.number("phase_deg", &harmonic.phase, kAny, kDegree);
      if (harmonic.period <= quantum) item.fail("period_deg must be more than quantum_deg");
      harmonics->push_back(harmonic);
    });
  }
}

void read_telemetry(Section& section, TelemetryConfig* telemetry) {
  section.number("rate_hz", &telemetry->rate_hz, kPositive);
  section.number("sigma_rad", &telemetry->sigma, kNotNegative);
  section.number("quantum_deg", &telemetry->quantum, kNotNegative, kDegree);
  section.number("internal_rate_hz", &telemetry->internal_rate_hz, kNotNegative);
  section.number("stale_repeat_probability", &telemetry->stale_repeat_probability, kUnitInterval);
  section.number("latency_ms", &telemetry->latency, kNotNegative, kMilli);
  section.section("gear", [&](Section& item) { read_gear(item, telemetry->quantum, telemetry); });
  section.section("play", [&](Section& item) {
    using Encoder = PlayConfig::Encoder;
    item.number("pan_mrad", &telemetry->play.pan, {0, 100}, kMilli);
    item.number("tilt_mrad", &telemetry->play.tilt, {0, 100}, kMilli);
    item.choice<Encoder>("encoder", &telemetry->play.encoder,
                         {{"motor", Encoder::kMotor}, {"output", Encoder::kOutput}});
  });
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

void read_encoding(Section& section, EncodingConfig* encoding) {
  section.choice<VideoCodec>(
      "codec", &encoding->codec,
      {{"mjpeg", VideoCodec::kMjpeg}, {"h264", VideoCodec::kH264}, {"h265", VideoCodec::kH265}});
  section.integer("kbit_s", &encoding->kbit_s, {10, 1e6});
  section.integer("gop", &encoding->gop, {1, 1e5});
  if (encoding->codec == VideoCodec::kMjpeg && (encoding->kbit_s > 0 || encoding->gop > 0)) {
    section.fail("kbit_s and gop need codec: h264 or h265");
  }
}

void read_recording(Section& section, RecordingConfig* recording) {
  using Images = RecordingConfig::Images;
  section.choice<Images>("images", &recording->images,
                         {{"video", Images::kVideo},
                          {"png", Images::kPng},
                          {"pgm", Images::kPgm},
                          {"none", Images::kNone}});
  read_encoding(section, &recording->encoding);
  if (recording->images != Images::kVideo && recording->encoding.codec != VideoCodec::kMjpeg) {
    section.fail("codec needs images: video");
  }
  section.number("landmark_spacing", &recording->landmark_spacing, kPositive);
  section.number("pixel_sigma_px", &recording->pixel_sigma, kNotNegative);
  read_distance(section, "landmark_distance_m", false, &recording->landmark_distance);
}

void read_live(Section& section, LiveConfig* live) {
  section.integer("rtsp_port", &live->rtsp_port, kPort);
  section.integer("http_port", &live->http_port, kPort);
  read_encoding(section, &live->encoding);
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
  if (live->mjpeg_port && live->encoding.codec != VideoCodec::kMjpeg) {
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

void read_pattern(Section& section, PatternConfig* pattern) {
  using Kind = PatternConfig::Kind;
  section.choice<Kind>("kind", &pattern->kind,
                       {{"chessboard", Kind::kChessboard},
                        {"circles", Kind::kCircles},
                        {"symmetric_circles", Kind::kSymmetricCircles},
                        {"april_grid", Kind::kAprilGrid},
                        {"charuco", Kind::kCharuco}});
  section.integer("columns", &pattern->columns, {1, 100});
  section.integer("rows", &pattern->rows, {1, 100});
  section.number("size_mm", &pattern->size, kPositive, kMilli);
  section.number("gap", &pattern->gap, kPositive);
  section.integer("border", &pattern->border, {1, 2});
  section.flag("corner_squares", &pattern->corner_squares);
  section.number("marker_mm", &pattern->marker, kPositive, kMilli);
  section.integer("dictionary", &pattern->dictionary, {0, 20});
  section.flag("old_layout", &pattern->old_layout);
  section.path("page", &pattern->page);
  section.number("black", &pattern->black, kUnitInterval);
  section.number("white", &pattern->white, kUnitInterval);
  section.number("table", &pattern->table, kUnitInterval);
  section.number("finger_mm", &pattern->finger, kNotNegative, kMilli);
  section.section("lens", [&](Section& item) {
    PatternConfig::Lens& lens = pattern->lens;
    item.number("focal_length_u_px", &lens.focal_length_u, kPositive);
    item.number("focal_length_v_px", &lens.focal_length_v, kPositive);
    item.number("centre_u_px", &lens.centre_u);
    item.number("centre_v_px", &lens.centre_v);
    item.number("k1", &lens.k1);
    item.number("k2", &lens.k2);
    item.number("p1", &lens.p1);
    item.number("p2", &lens.p2);
  });
  section.section("hand", [&](Section& item) {
    item.number("distance_mm", &pattern->hand.distance, kPositive, kMilli);
    item.number("speed", &pattern->hand.speed, kNotNegative);
    item.number("reach", &pattern->hand.reach, kNotNegative);
  });
  if (pattern->kind == Kind::kAprilGrid && pattern->columns * pattern->rows > 587) {
    section.fail("pattern has more than the 587 tags of family 36h11");
  }
  if (pattern->kind != Kind::kCharuco) return;
  if (!PatternBoard::has_charuco())
    section.fail("this build has no ChArUco boards, which need libopencv-contrib-dev");
  if (pattern->marker >= pattern->size) section.fail("marker_mm is not smaller than size_mm");
  if (pattern->columns * pattern->rows / 2 > PatternBoard::charuco_markers(pattern->dictionary))
    section.fail("pattern has more markers than its dictionary");
}

void read_config(Section& section, Config* config) {
  double seed = 1;
  section.number("seed", &seed, {0, 9007199254740992.0});
  config->seed = static_cast<std::uint64_t>(seed);
  section.number("duration_s", &config->duration, kNotNegative);
  section.section("image", [&](Section& item) { read_image(item, &config->image); });
  section.section("zoom", [&](Section& item) { read_zoom(item, &config->zoom.emplace()); });
  section.section("camera", [&](Section& item) {
    read_camera(item, config->zoom.has_value(), &config->camera);
  });
  section.section("path", [&](Section& item) { read_path(item, &config->path); });
  section.section("scene", [&](Section& item) { read_scene(item, &config->scene); });
  section.section("sensor", [&](Section& item) { read_sensor(item, &config->sensor); });
  section.section("telemetry", [&](Section& item) { read_telemetry(item, &config->telemetry); });
  section.section("timing", [&](Section& item) { read_timing(item, &config->timing); });
  section.section("recording", [&](Section& item) { read_recording(item, &config->recording); });
  section.section("live", [&](Section& item) { read_live(item, &config->live); });
  section.section("pattern", [&](Section& item) {
    config->pattern.emplace();
    read_pattern(item, &*config->pattern);
  });
  section.section("guess", [&](Section& item) {
    double focal_length = 0;
    item.number("focal_length_px", &focal_length, kPositive);
    if (focal_length > 0) config->guess_focal_length = focal_length;
  });
  section.path("truth_dir", &config->truth_dir);
  section.finish();
  const Eigen::Vector2d centre = config->camera.centre.cwiseAbs();
  if (centre.x() > config->image.width / 2.0 || centre.y() > config->image.height / 2.0) {
    section.fail("camera: centre_px is beyond the image's border");
  }
  if (std::abs(config->camera.line_delay) * config->image.height * config->image.rate_hz > 1) {
    section.fail("camera: reading out all rows (line_delay_us x height) outlasts a frame");
  }
  if (config->path.follows_zoom && !config->zoom) {
    section.fail("path: follows_zoom needs a 'zoom' section");
  }
  if (config->pattern && config->zoom) section.fail("a pattern is seen without zoom");
  if (config->pattern && config->recording.images == RecordingConfig::Images::kNone) {
    section.fail("recording: a pattern needs images: video, png or pgm");
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

double field_of_view(const ImageConfig& image, double focal_length) {
  return 2 * std::atan2(image.width, 2 * focal_length);
}

double horizontal_field_of_view(const Config& config) {
  const std::optional<Zoom> zoom = make_zoom(config);
  const double focal_length = config.path.focal_length > 0 ? config.path.focal_length
                              : zoom                       ? zoom->focal_lengths().tele
                                                           : config.camera.focal_length;
  return field_of_view(config.image, focal_length);
}

}  // namespace alidade::simulator
