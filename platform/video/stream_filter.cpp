#include "platform/video/stream_filter.h"

#include <cstdio>
#include <utility>

namespace alidade {

bool StreamFilter::takes(const std::uint8_t* data, std::size_t size, double arrival_s) {
  if (const auto reporter = reporting_source(data, size)) {
    if (reporter == source_ || reporter != foreign_source_) return true;
    ++foreign_;
    return false;
  }
  const auto header = parse_rtp_header(data, size);
  if (!header) return true;
  if (std::exchange(asides_are_old_, false)) asides_ = 0;
  const bool own_type = payload_type_ < 0 || header->payload_type == payload_type_;
  if (!own_type || !is_own_source(header->source, arrival_s)) return leave_out(*header);
  before_ = last_sequence_;
  last_sequence_ = header->sequence;
  asides_are_old_ = true;
  return true;
}

bool StreamFilter::is_own_source(std::uint32_t source, double arrival_s) {
  if (source != source_) {
    const bool agreed = source == agreed_;
    const bool came_back = source == left_;
    const bool silent = arrival_s - heard_s_ > kSilent_s;
    if (source_ && two_send_ && !agreed && !silent) return false;
    two_send_ = two_send_ || agreed || (came_back && !silent);
    left_ = std::exchange(source_, source);
  }
  heard_s_ = arrival_s;
  return true;
}

bool StreamFilter::leave_out(const RtpHeader& header) {
  ++foreign_;
  if (header.source != source_) {
    foreign_source_ = header.source;
  } else if (asides_ < aside_.size()) {
    aside_[asides_++] = header;
  }
  char text[64];
  if (payload_type_ >= 0 && header.payload_type != payload_type_) {
    std::snprintf(text, sizeof text, "payload type %d in place of %d", header.payload_type,
                  payload_type_);
  } else {
    std::snprintf(text, sizeof text, "another sender (SSRC %08X)",
                  static_cast<unsigned>(header.source));
  }
  kind_ = text;
  return false;
}

}  // namespace alidade
