#include "platform/discovery/vapix_parameters.h"

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <tuple>
#include <utility>
#include <vector>

#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr std::size_t kMostParameters = 4096;
constexpr std::size_t kMostValueBytes = 2000;
constexpr int kMostChannels = 8;
constexpr const char* kLineBlanks = " \t\r";

using Parameters = std::map<std::string, std::string>;

Parameters parameters_of(std::string_view body) {
  Parameters parameters;
  while (!body.empty() && parameters.size() < kMostParameters) {
    const std::size_t end = std::min(body.find('\n'), body.size());
    const std::string_view line = trimmed(body.substr(0, end), kLineBlanks);
    body.remove_prefix(std::min(end + 1, body.size()));
    const std::size_t equals = line.find('=');
    if (equals == std::string_view::npos || line.size() > kMostValueBytes) continue;
    std::string_view key = line.substr(0, equals);
    constexpr std::string_view kRoot = "root.";
    if (key.substr(0, kRoot.size()) == kRoot) key.remove_prefix(kRoot.size());
    parameters[std::string(key)] = std::string(line.substr(equals + 1));
  }
  return parameters;
}

std::string value_of(const Parameters& parameters, const std::string& key) {
  const auto found = parameters.find(key);
  return found == parameters.end() ? std::string() : found->second;
}

std::vector<std::string> list_of(const std::string& text) {
  std::vector<std::string> list;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    list.emplace_back(trimmed(std::string_view(text).substr(begin, end - begin), kLineBlanks));
    begin = end + 1;
  }
  return list;
}

int whole_number(std::string_view text) {
  const std::optional<double> value = parse_number(text);
  return value && *value > 0 && *value <= 65535 ? static_cast<int>(*value) : 0;
}

// "1920x1080"; zeros: not a size.
std::pair<int, int> size_of_text(const std::string& text) {
  const std::size_t cross = text.find('x');
  if (cross == std::string::npos) return {0, 0};
  const int width = whole_number(std::string_view(text).substr(0, cross));
  const int height = whole_number(std::string_view(text).substr(cross + 1));
  return width > 0 && height > 0 ? std::pair(width, height) : std::pair(0, 0);
}

// The device's word for a codec in a URL, and ours.
struct VapixCodec {
  const char* format;
  const char* codec;
};
constexpr std::array<VapixCodec, 3> kVapixCodecs = {
    {{"h264", "H264"}, {"h265", "H265"}, {"mjpeg", "JPEG"}}};

class ChannelReader {
 public:
  ChannelReader(const Parameters& parameters, std::string host)
      : parameters_(parameters),
        host_(std::move(host)),
        formats_(list_of(value_of(parameters, "Properties.Image.Format"))),
        sizes_(list_of(value_of(parameters, "Properties.Image.Resolution"))) {}

  void add_streams(int channel, bool several, DeviceReport* report) const {
    const std::string image = "Image.I" + std::to_string(channel) + ".";
    if (value_of(parameters_, image + "Enabled") == "no") return;
    const std::string set = value_of(parameters_, image + "Appearance.Resolution");
    std::vector<std::string> sizes = {set};
    const auto [width, height] = size_of_text(set);
    if (width == 0) return;
    const std::string full_hd = "1920x1080";
    if (width > 1920 && std::find(sizes_.begin(), sizes_.end(), full_hd) != sizes_.end())
      sizes.push_back(full_hd);
    for (const VapixCodec& codec : kVapixCodecs) {
      if (std::find(formats_.begin(), formats_.end(), codec.format) == formats_.end()) continue;
      for (const std::string& size : sizes)
        report->streams.push_back(stream(image, codec, size, several ? channel + 1 : 0));
    }
    if (value_of(parameters_, image + "MPEG.ZGopMode") == "dynamic") {
      report->notes.push_back(
          "its key frames come at changing distances (Zipstream's dynamic GOP): set it to fixed in "
          "the device's settings, so that a lost picture costs no more than a second");
    }
  }

 private:
  [[nodiscard]] VideoStream stream(const std::string& image, const VapixCodec& codec,
                                   const std::string& size, int camera) const {
    VideoStream stream;
    stream.name = value_of(parameters_, image + "Name");
    std::tie(stream.width, stream.height) = size_of_text(size);
    stream.codec = codec.codec;
    stream.rate_hz = whole_number(value_of(parameters_, image + "Stream.FPS"));
    const int port = whole_number(value_of(parameters_, "Network.RTSP.Port"));
    stream.url = "rtsp://" + host_ + (port == 0 || port == 554 ? "" : ":" + std::to_string(port)) +
                 "/axis-media/media.amp?videocodec=" + std::string(codec.format) +
                 "&resolution=" + std::to_string(stream.width) + "x" +
                 std::to_string(stream.height) +
                 (camera > 0 ? "&camera=" + std::to_string(camera) : "");
    const bool is_jpeg = stream.codec == "JPEG";
    const int between = whole_number(value_of(parameters_, image + "MPEG.PCount"));
    stream.key_frame_distance = is_jpeg ? 1 : between > 0 ? between + 1 : 0;
    if (stream.codec == "H264")
      stream.codec_profile = value_of(parameters_, image + "MPEG.H264.Profile");
    stream.b_frames = is_jpeg || stream.codec_profile == "baseline"
                          ? VideoStream::BFrames::kNone
                          : VideoStream::BFrames::kUnknown;
    stream.has_pan_tilt = value_of(parameters_, "Properties.PTZ.PTZ") == "yes";
    return stream;
  }

  const Parameters& parameters_;
  std::string host_;
  std::vector<std::string> formats_;
  std::vector<std::string> sizes_;
};

}  // namespace

bool parse_vapix_parameters(std::string_view body, const std::string& host, DeviceReport* report,
                            std::string* error) {
  const Parameters parameters = parameters_of(body);
  if (parameters.empty()) {
    *error = "no parameters in '" + shown(trimmed(body.substr(0, body.find('\n')), kLineBlanks)) +
             "'; is it an Axis device?";
    return false;
  }
  report->maker = value_of(parameters, "Brand.Brand");
  report->model = value_of(parameters, "Brand.ProdFullName");
  report->firmware = value_of(parameters, "Properties.Firmware.Version");
  const std::string pan_tilt = value_of(parameters, "Properties.PTZ.PTZ");
  if (!pan_tilt.empty()) report->has_pan_tilt = pan_tilt == "yes";
  const ChannelReader reader(parameters, host);
  const bool several = parameters.count("Image.I1.Appearance.Resolution") > 0;
  for (int channel = 0; channel < kMostChannels; ++channel)
    reader.add_streams(channel, several, report);
  if (report->streams.empty()) *error = "the device tells no size of its pictures";
  return !report->streams.empty();
}

}  // namespace alidade
