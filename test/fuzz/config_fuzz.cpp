// alidade.yaml: a configuration whose every number is within its limits, or one line that says what is
// wrong.

#include "edge_app/config/config.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

bool is_within(double value, double low, double high) { return value >= low && value <= high; }

void require_sound_head(const HeadConfig& head) {
  FUZZ_REQUIRE(make_protocol(head.protocol) != nullptr);
  FUZZ_REQUIRE(!head.link.address.empty() && is_baud(head.link.baud));
}

void require_sound_broker(const MqttOptions& mqtt) {
  FUZZ_REQUIRE(!mqtt.host.empty() && is_within(mqtt.port, 1, 65535));
  FUZZ_REQUIRE(is_within(mqtt.qos, 0, 2) && is_within(mqtt.keep_alive_s, 5, 3600));
  FUZZ_REQUIRE(is_within(mqtt.timeout_s, 0.1, 3600) && is_within(mqtt.max_backoff_s, 0.1, 3600));
  FUZZ_REQUIRE(is_within(mqtt.orientation_rate_hz, 0, 1000));
}

void require_sound(const Config& config) {
  const VideoConfig& video = config.video;
  FUZZ_REQUIRE(is_within(video.width, 0, 65536) && is_within(video.height, 0, 65536));
  FUZZ_REQUIRE((video.width == 0) == (video.height == 0));
  FUZZ_REQUIRE(is_within(video.timeout_s, 0.1, 3600) && is_within(video.max_backoff_s, 0.1, 3600));
  FUZZ_REQUIRE(!video.url.empty() || !video.directory.empty() || !video.device.empty());
  const PanTiltConfig& pan_tilt = config.pan_tilt;
  FUZZ_REQUIRE(is_within(pan_tilt.rate_hz, 0.1, 1000) && is_within(pan_tilt.camera, 0, 64));
  FUZZ_REQUIRE(is_within(pan_tilt.timeout_s, 0.1, 3600));
  for (const AxisMapping& axis : {pan_tilt.axes.pan, pan_tilt.axes.tilt}) {
    FUZZ_REQUIRE(axis.sign == 1 || axis.sign == -1);
    FUZZ_REQUIRE(is_within(axis.zero_deg, -360, 360));
  }
  FUZZ_REQUIRE(is_within(pan_tilt.angle_sigma_rad.value_or(0), 0, 0.1));
  FUZZ_REQUIRE(is_within(pan_tilt.angle_quantum_rad, 0, 0.1));
  FUZZ_REQUIRE(is_within(pan_tilt.angle_accuracy_deg, 0, 5));
  FUZZ_REQUIRE(is_within(pan_tilt.acceleration_sigma_rad_s2, 0, 1000));
  FUZZ_REQUIRE(is_within(pan_tilt.max_repeat_s, 0, 10));
  if (pan_tilt.type == PanTiltConfig::Type::kHead) require_sound_head(pan_tilt.head);
  FUZZ_REQUIRE(is_within(config.camera.focal_length_px.value_or(1), 1, 1e8));
  FUZZ_REQUIRE(is_within(config.camera.aspect, 0.5, 2));
  FUZZ_REQUIRE(is_within(config.camera.line_delay_s, -1e-3, 1e-3));
  FUZZ_REQUIRE(is_within(config.camera.centre_sigma_px.value_or(0), 0, 1e4));
  FUZZ_REQUIRE(is_within(config.calibration.zoom_tolerance.value_or(0), 0, 1e6));
  FUZZ_REQUIRE(is_within(config.calibration.clock_offset_sigma_s.value_or(0), 0, 1));
  FUZZ_REQUIRE(is_within(config.scene_map.interval_s, 0.1, 3600));
  FUZZ_REQUIRE(is_within(config.scene_map.zero_sigma_rad, 1e-7, 0.5));
  FUZZ_REQUIRE(is_within(config.realtime.max_extrapolation_s, 0, 10));
  const double repeat_s = pan_tilt.max_repeat_s;
  FUZZ_REQUIRE(repeat_s == 0 || repeat_s < config.realtime.max_extrapolation_s);
  FUZZ_REQUIRE(config.camera.pupil.place_m.cwiseAbs().maxCoeff() <= kFarthestPupil_m);
  FUZZ_REQUIRE(!config.scene || (config.scene->nearest_m >= kNearestScene_m &&
                                 config.scene->nearest_m < config.scene->farthest_m));
  FUZZ_REQUIRE(is_within(config.realtime.priority, 0, 99));
  FUZZ_REQUIRE(is_within(config.realtime.cpu, -1, 1023));
  FUZZ_REQUIRE(!config.tracking.targets || config.tracking.targets->validate());
  FUZZ_REQUIRE(!config.calibration.file.empty() || config.camera.focal_length_px);
  if (config.mqtt) require_sound_broker(*config.mqtt);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  Config config;
  std::string error;
  if (parse_config(std::string(text_of(data, size)), "alidade.yaml", &config, &error)) {
    FUZZ_REQUIRE(error.empty());
    require_sound(config);
  } else {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.rfind("alidade.yaml:", 0) == 0);
  }
  return 0;
}
