#pragma once
// RtspMessage: owns a message of GStreamer's RTSP library and reads the parts that RtspSession
// needs.

#include <gst/rtsp/gstrtspmessage.h>

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace alidade {

class RtspMessage {
 public:
  RtspMessage() { gst_rtsp_message_init(&message_); }
  ~RtspMessage() { gst_rtsp_message_unset(&message_); }
  RtspMessage(const RtspMessage&) = delete;
  RtspMessage& operator=(const RtspMessage&) = delete;

  GstRTSPMessage* get() { return &message_; }
  // Cleared, for a function that fills it.
  GstRTSPMessage* cleared() {
    gst_rtsp_message_unset(&message_);
    return &message_;
  }
  // Parses a message from RtspFraming. False: neither a request nor a response.
  [[nodiscard]] bool parse(std::string_view text);
  // The message as sent; only for our own messages, which have no body.
  [[nodiscard]] std::string text();
  GstRTSPMsgType type() { return gst_rtsp_message_get_type(&message_); }
  // Only of a response.
  int status() const { return message_.type_data.response.code; }
  const char* reason() const { return message_.type_data.response.reason; }
  std::string header(GstRTSPHeaderField field) {
    gchar* value = nullptr;
    gst_rtsp_message_get_header(&message_, field, &value, 0);
    return value == nullptr ? "" : value;
  }
  // True if a header of this name contains the item; there may be several.
  bool lists(GstRTSPHeaderField field, const char* item) {
    gchar* value = nullptr;
    for (int i = 0; gst_rtsp_message_get_header(&message_, field, &value, i) == GST_RTSP_OK; ++i) {
      if (std::string(value).find(item) != std::string::npos) return true;
    }
    return false;
  }
  std::pair<const std::uint8_t*, std::size_t> body() {
    guint8* data = nullptr;
    guint size = 0;
    gst_rtsp_message_get_body(&message_, &data, &size);
    return {data, size};
  }

 private:
  GstRTSPMessage message_{};
};

}  // namespace alidade
