#include "edge_app/config/video_config.h"

#include <algorithm>

#include "edge_app/config/link_keys.h"
#include "platform/streams/picture_size.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

constexpr NumberRange kPixels{1, kMostPictureSide, "px"};

using Read = void (*)(YamlSection& section, const std::string& config_path, VideoConfig* video);

void read_rtsp(YamlSection& section, const std::string& config_path, VideoConfig* video) {
  video->url = required_url(section, "rtsp://camera/stream", {"rtsp://", "rtsps://"});
  read_login(section, config_path, &video->user, &video->password);
  video->rules = read_link_rules(section);
  const bool by_tls = is_by_tls(video->url);
  if (section.choice("transport", {"tcp", "udp"}).value_or("tcp") == "udp") {
    if (by_tls)
      section.fail("transport", "udp does not go with rtsps://; leave it out, or set tcp");
    video->transport = VideoConfig::Transport::kUdp;
  }
  if (const auto file = section.text("certificate_file")) {
    if (!by_tls) section.fail("certificate_file", "is for rtsps:// only");
    video->certificate_file = path_relative_to(config_path, *file);
    refuse_other_than_file(section, "certificate_file", video->certificate_file);
  }
}

void read_rtp(YamlSection& section, const std::string& config_path, VideoConfig* video) {
  video->url = required_text(section, "url", "camera.sdp");
  if (video->url.rfind("rtp://", 0) == 0) {
    video->format = section.choice("format", {"MJPG", "H264", "H265"}).value_or(video->format);
  } else {
    video->url = path_relative_to(config_path, video->url);
    refuse_other_than_file(section, "url", video->url);
  }
}

void read_mjpeg(YamlSection& section, const std::string& config_path, VideoConfig* video) {
  video->url = required_url(section, "http://camera/mjpg/video.mjpg", {"http://", "https://"});
  read_login(section, config_path, &video->user, &video->password);
  video->rules = read_link_rules(section);
}

void read_v4l2(YamlSection& section, const std::string& config_path, VideoConfig* video) {
  video->device = path_relative_to(config_path, required_text(section, "device", "/dev/video0"));
  if (const auto format = section.choice("format", {"GREY", "NV12", "YUYV", "UYVY", "MJPG"}))
    video->pixel_format = v4l2_format_of_name(*format);
  video->rate_hz = section.number("rate_hz", {0.1, 1000, "Hz"}).value_or(video->rate_hz);
}

void read_recording(YamlSection& section, const std::string& config_path, VideoConfig* video) {
  video->directory =
      path_relative_to(config_path, required_text(section, "directory", "my-recording"));
}

struct VideoTypeRow {
  VideoConfig::Type type;
  const char* name;
  Read read;     // the keys of this type
  bool is_live;  // has the keys of live video: size, time-out, back-off
};

constexpr std::array<VideoTypeRow, kVideoTypeCount> kVideoTypes = {
    {{VideoConfig::Type::kRtsp, "rtsp", read_rtsp, true},
     {VideoConfig::Type::kRtp, "rtp", read_rtp, true},
     {VideoConfig::Type::kMjpeg, "mjpeg", read_mjpeg, true},
     {VideoConfig::Type::kV4l2, "v4l2", read_v4l2, true},
     {VideoConfig::Type::kRecording, "recording", read_recording, false}}};

constexpr bool rows_are_whole() {
  for (std::size_t i = 0; i < kVideoTypeCount; ++i) {
    if (static_cast<std::size_t>(kVideoTypes[i].type) != i || kVideoTypes[i].name == nullptr)
      return false;
  }
  return true;
}
static_assert(rows_are_whole(), "each VideoConfig::Type has one row, in the enum's order");

void read_live_keys(YamlSection& section, VideoConfig* video) {
  video->width = section.integer("width", kPixels).value_or(0);
  video->height = section.integer("height", kPixels).value_or(0);
  if ((video->width == 0) != (video->height == 0))
    section.fail(video->width == 0 ? "height" : "width", "is given alone; give width and height");
  video->timeout_s = section.number("timeout_s", kSeconds).value_or(video->timeout_s);
  video->max_backoff_s = section.number("max_backoff_s", kSeconds).value_or(video->max_backoff_s);
}

}  // namespace

const std::array<const char*, kVideoTypeCount>& video_type_names() {
  static constexpr auto kNames = [] {
    std::array<const char*, kVideoTypeCount> names{};
    for (std::size_t i = 0; i < kVideoTypeCount; ++i) names[i] = kVideoTypes[i].name;
    return names;
  }();
  return kNames;
}

VideoConfig read_video(YamlSection section, const std::string& config_path) {
  const auto& names = video_type_names();
  const std::string type = required_choice(section, "type", {names.begin(), names.end()});
  const VideoTypeRow& row =
      *std::find_if(kVideoTypes.begin(), kVideoTypes.end(),
                    [&type](const VideoTypeRow& one) { return type == one.name; });
  VideoConfig video;
  video.type = row.type;
  row.read(section, config_path, &video);
  if (row.is_live) read_live_keys(section, &video);
  section.finish();
  return video;
}

}  // namespace alidade
