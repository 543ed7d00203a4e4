#include "platform/discovery/onvif_media.h"

#include <strings.h>

#include <cmath>
#include <optional>

#include "platform/pan_tilt/onvif_xml.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr std::size_t kMostStreams = 64;
constexpr std::size_t kMostTextBytes_ = 200;  // of a name
constexpr std::size_t kMostUrlBytes = 2000;

std::string bounded(std::string text) {
  if (text.size() > kMostTextBytes_) text.resize(kMostTextBytes_);
  return text;
}

// 0 if the text is not a number of this range.
double number_in(std::string_view text, double most) {
  const std::optional<double> value = parse_number(trimmed(text, kXmlBlanks));
  return value && *value > 0 && *value <= most ? *value : 0;
}

int count_in(std::string_view text) { return static_cast<int>(number_in(text, 1e6)); }

bool is_word(const std::string& a, const char* b) { return ::strcasecmp(a.c_str(), b) == 0; }

// Devices write H264, H.264, h264; MJPEG and JPEG.
std::string codec_of(const std::string& text) {
  for (const char* word : {"H264", "H.264"}) {
    if (is_word(text, word)) return "H264";
  }
  for (const char* word : {"H265", "H.265", "HEVC"}) {
    if (is_word(text, word)) return "H265";
  }
  for (const char* word : {"JPEG", "MJPEG", "MJPG"}) {
    if (is_word(text, word)) return "JPEG";
  }
  return bounded(text);
}

// Only the profile Baseline of H.264 has none by definition. Most cameras send none in the others,
// either, but do not say so.
VideoStream::BFrames b_frames_of(const std::string& codec, const std::string& profile) {
  if (codec == "JPEG" || is_word(profile, "Baseline")) return VideoStream::BFrames::kNone;
  return profile.empty() ? VideoStream::BFrames::kUnknown : VideoStream::BFrames::kPossible;
}

// The encoder's configuration, of media: elements; of media2: some are attributes.
void read_encoder(const pugi::xml_node& encoder, VideoStream* stream) {
  stream->codec = codec_of(xml_text(xml_child(encoder, "Encoding")));
  const pugi::xml_node size = xml_child(encoder, "Resolution");
  stream->width = count_in(xml_text(xml_child(size, "Width")));
  stream->height = count_in(xml_text(xml_child(size, "Height")));
  const pugi::xml_node rate = xml_child(encoder, "RateControl");
  stream->rate_hz = number_in(xml_text(xml_child(rate, "FrameRateLimit")), 1000);
  const double interval = number_in(xml_text(xml_child(rate, "EncodingInterval")), 1000);
  if (interval > 1) stream->rate_hz /= interval;  // only each so-many-th picture is encoded
  const pugi::xml_node h264 = xml_child(encoder, "H264");
  stream->key_frame_distance = count_in(xml_text(xml_child(h264, "GovLength")));
  if (stream->key_frame_distance == 0)
    stream->key_frame_distance = count_in(encoder.attribute("GovLength").value());
  stream->codec_profile = bounded(xml_text(xml_child(h264, "H264Profile")));
  if (stream->codec_profile.empty())
    stream->codec_profile = bounded(encoder.attribute("Profile").value());
  if (stream->codec == "JPEG") {
    stream->key_frame_distance = 1;
    stream->codec_profile.clear();
  }
  stream->b_frames = b_frames_of(stream->codec, stream->codec_profile);
}

pugi::xml_node answer_to(const char* call, std::string_view body, pugi::xml_document* document,
                         std::string* error) {
  const std::string name = std::string(call) + "Response";
  pugi::xml_node answer;
  if (document->load_buffer(body.data(), body.size()))
    answer = xml_descendant(document->root(), {"Envelope", "Body", name});
  if (!answer) {
    *error = std::string("no answer to ") + call + " in '" +
             shown(trimmed(body.substr(0, body.find('\n')), kXmlBlanks)) +
             "'; is it an ONVIF service?";
  }
  return answer;
}

}  // namespace

std::string onvif_media_content(const OnvifCall& call, const std::string& token) {
  const std::string profile = "<ProfileToken>" + xml_escaped(token) + "</ProfileToken>";
  const std::string_view name(call.name);
  const bool second = std::string_view(call.service) == kOnvifMedia2;
  if (name == kGetStreamUri.name && second) return "<Protocol>RTSP</Protocol>" + profile;
  if (name == kGetStreamUri.name) {
    return "<StreamSetup><Stream xmlns=\"http://www.onvif.org/ver10/schema\">RTP-Unicast</Stream>"
           "<Transport xmlns=\"http://www.onvif.org/ver10/schema\"><Protocol>RTSP</Protocol>"
           "</Transport></StreamSetup>" +
           profile;
  }
  return second ? "<Type>VideoEncoder</Type><Type>PTZ</Type>" : "";
}

bool parse_onvif_device(std::string_view body, DeviceReport* report, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = answer_to(kGetDeviceInformation.name, body, &document, error);
  if (!answer) return false;
  report->maker = bounded(xml_text(xml_child(answer, "Manufacturer")));
  report->model = bounded(xml_text(xml_child(answer, "Model")));
  report->firmware = bounded(xml_text(xml_child(answer, "FirmwareVersion")));
  return true;
}

std::string parse_onvif_media2(std::string_view body) {
  pugi::xml_document document;
  std::string ignored;
  const pugi::xml_node answer = answer_to(kGetServices.name, body, &document, &ignored);
  for (const pugi::xml_node& service : answer.children()) {
    if (xml_text(xml_child(service, "Namespace")) != kOnvifMedia2) continue;
    std::string address = xml_text(xml_child(service, "XAddr"));
    return address.size() <= kMostUrlBytes ? address : std::string();
  }
  return "";
}

bool parse_onvif_streams(std::string_view body, std::vector<VideoStream>* streams,
                         std::string* error) {
  pugi::xml_document document;
  streams->clear();
  const pugi::xml_node answer = answer_to(kGetProfiles.name, body, &document, error);
  if (!answer) return false;
  for (const pugi::xml_node& profile : answer.children()) {
    if (xml_local_name(profile.name()) != "Profiles" || streams->size() == kMostStreams) continue;
    const pugi::xml_node second = xml_child(profile, "Configurations");
    const pugi::xml_node encoder = second ? xml_child(second, "VideoEncoder")
                                          : xml_child(profile, "VideoEncoderConfiguration");
    const std::string token = profile.attribute("token").value();
    if (!encoder || token.empty() || token.size() > kMostTextBytes_) continue;
    VideoStream stream;
    stream.token = token;
    stream.name = bounded(xml_text(xml_child(profile, "Name")));
    stream.has_pan_tilt =
        second ? xml_child(second, "PTZ") : xml_child(profile, "PTZConfiguration");
    read_encoder(encoder, &stream);
    streams->push_back(std::move(stream));
  }
  if (streams->empty()) *error = "none of the device's profiles has a video encoder";
  return !streams->empty();
}

bool parse_onvif_stream_url(std::string_view body, std::string* url, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = answer_to(kGetStreamUri.name, body, &document, error);
  if (!answer) return false;
  *url = xml_text(xml_descendant(answer, {"MediaUri", "Uri"}));
  if (url->empty()) *url = xml_text(xml_child(answer, "Uri"));
  if (!url->empty() && url->size() <= kMostUrlBytes) return true;
  *error = "no Uri in the answer to GetStreamUri";
  return false;
}

}  // namespace alidade
