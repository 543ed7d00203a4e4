#include "platform/video/stream_filter.h"

#include <algorithm>
#include <cstdio>
#include <utility>

namespace alidade {

bool StreamFilter::takes(const std::uint8_t* data, std::size_t size, double arrival_s) {
  if (const auto reporter = reporting_source(data, size)) {
    if (holds_ && reporter == holds_->source) {
      hold(data, size, arrival_s);
      return false;
    }
    if (reporter == source_ || reporter != foreign_source_) return true;
    ++foreign_;
    return false;
  }
  const auto header = parse_rtp_header(data, size);
  if (!header) return true;
  if (payload_type_ >= 0 && header->payload_type != payload_type_) return leave_out(*header);
  if (is_own_source(header->source)) {
    drop_held();
    if (header->source != source_) {
      two_send_ = two_send_ || (source_ && arrival_s - *heard_s_ <= kSilent_s);
      follow(header->source, arrival_s);
    }
    take(*header, arrival_s);
    return true;
  }
  if (!heard_s_) heard_s_ = arrival_s;
  const bool anew = began_anew(*header, arrival_s);
  hold(data, size, arrival_s);
  if (anew) {
    follow(header->source, arrival_s);
    release_ = true;
  }
  return false;
}

bool StreamFilter::is_own_source(std::uint32_t source) const {
  if (!source_ && !agreed_) return true;
  return source == source_ || source == agreed_ || (source == left_ && !two_send_);
}

// True if the followed source has been silent for long enough.
bool StreamFilter::began_anew(const RtpHeader& header, double arrival_s) {
  constexpr double kTimes = 2;  // the usual time between pictures
  if (holds_ && holds_->source != header.source) drop_held();
  if (!holds_ || holds_->timestamp != header.timestamp) ++held_pictures_;
  holds_ = header;
  const double silent_s = arrival_s - *heard_s_;
  if (!(silent_s > kTimes * usual_s_)) return false;
  return silent_s > kSilent_s || (!two_send_ && held_pictures_ >= kPictures);
}

void StreamFilter::follow(std::uint32_t source, double arrival_s) {
  left_ = std::exchange(source_, source);
  picture_began_s_ = arrival_s;
  usual_s_ = 0;
}

void StreamFilter::hold(const std::uint8_t* data, std::size_t size, double arrival_s) {
  held_.push_back({{data, data + size}, arrival_s});
  held_bytes_ += size;
  while (held_bytes_ > kMostHeld) {
    held_bytes_ -= held_.front().bytes.size();
    held_.pop_front();
    ++foreign_;
  }
}

void StreamFilter::drop_held() {
  if (holds_) (void)leave_out(*holds_);
  if (!held_.empty()) foreign_ += static_cast<std::int64_t>(held_.size()) - 1;
  held_.clear();
  held_bytes_ = 0;
  holds_.reset();
  held_pictures_ = 0;
  release_ = false;
}

std::optional<StreamFilter::Held> StreamFilter::release() {
  if (!release_) return std::nullopt;
  Held next = std::move(held_.front());
  held_.pop_front();
  held_bytes_ -= next.bytes.size();
  if (const auto header = parse_rtp_header(next.bytes.data(), next.bytes.size())) {
    take(*header, next.arrival_s);
  }
  if (held_.empty()) {
    holds_.reset();
    held_pictures_ = 0;
    release_ = false;
  }
  return next;
}

void StreamFilter::take(const RtpHeader& header, double arrival_s) {
  constexpr double kMost_s = 5;
  if (header.timestamp != std::exchange(picture_, header.timestamp)) {
    usual_s_ = std::clamp(arrival_s - std::exchange(picture_began_s_, arrival_s), 0.0, kMost_s);
  }
  heard_s_ = arrival_s;
  if (std::exchange(asides_are_old_, true)) asides_ = 0;
  before_ = last_sequence_;
  last_sequence_ = header.sequence;
}

bool StreamFilter::leave_out(const RtpHeader& header) {
  ++foreign_;
  if (std::exchange(asides_are_old_, false)) asides_ = 0;
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
