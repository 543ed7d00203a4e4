#include "platform/video/session_description.h"

#include <gst/sdp/gstsdpmessage.h>

#include <memory>
#include <sstream>

namespace alidade {
namespace {

constexpr guint kLastPort = 65535;

struct FreeSdp {
  void operator()(GstSDPMessage* message) const { gst_sdp_message_free(message); }
};

std::string text(const char* value) { return value == nullptr ? "" : value; }

// " incl IN IP4 GROUP SENDER ..."
std::vector<std::string> senders_in(const std::string& source_filter) {
  std::istringstream words(source_filter);
  std::string mode;
  std::string net;
  std::string family;
  std::string to;
  words >> mode >> net >> family >> to;
  std::vector<std::string> senders;
  for (std::string sender; mode == "incl" && words >> sender;) senders.push_back(sender);
  return senders;
}

// "1234 cname:..."
std::optional<std::uint32_t> source_in_attribute(const std::string& ssrc) {
  std::istringstream words(ssrc);
  std::uint32_t source = 0;
  return words >> source ? std::optional<std::uint32_t>(source) : std::nullopt;
}

}  // namespace

std::optional<VideoDescription> find_video(const std::string& sdp) {
  GstSDPMessage* parsed = nullptr;
  gst_sdp_message_new(&parsed);
  const std::unique_ptr<GstSDPMessage, FreeSdp> message(parsed);
  if (gst_sdp_message_parse_buffer(reinterpret_cast<const guint8*>(sdp.data()),
                                   static_cast<guint>(sdp.size()), parsed) != GST_SDP_OK) {
    return std::nullopt;
  }
  for (guint i = 0; i < gst_sdp_message_medias_len(parsed); ++i) {
    const GstSDPMedia* media = gst_sdp_message_get_media(parsed, i);
    if (text(gst_sdp_media_get_media(media)) != "video") continue;
    VideoDescription video;
    const GstSDPConnection* connection = gst_sdp_media_connections_len(media) > 0
                                             ? gst_sdp_media_get_connection(media, 0)
                                             : gst_sdp_message_get_connection(parsed);
    video.address = connection == nullptr ? "" : text(connection->address);
    if (video.address.empty()) video.address = "0.0.0.0";
    if (gst_sdp_media_get_port(media) > kLastPort) return std::nullopt;
    video.port = static_cast<int>(gst_sdp_media_get_port(media));
    if (gst_sdp_media_formats_len(media) > 0) {
      const std::string format = text(gst_sdp_media_get_format(media, 0));
      const bool is_type = !format.empty() && format.size() <= 3 &&
                           format.find_first_not_of("0123456789") == std::string::npos;
      if (is_type) video.payload_type = std::stoi(format);
    }
    video.control = text(gst_sdp_media_get_attribute_val(media, "control"));
    video.session_control = text(gst_sdp_message_get_attribute_val(parsed, "control"));
    video.senders = senders_in(text(gst_sdp_media_get_attribute_val(media, "source-filter")));
    if (video.senders.empty()) {
      video.senders = senders_in(text(gst_sdp_message_get_attribute_val(parsed, "source-filter")));
    }
    video.source = source_in_attribute(text(gst_sdp_media_get_attribute_val(media, "ssrc")));
    return video;
  }
  return std::nullopt;
}

}  // namespace alidade
