#include "platform/video/picture_ends.h"

#include <algorithm>

namespace alidade {

void PictureEnds::packet_in(const RtpHeader& header) {
  const bool follows = last_ && header.sequence == static_cast<std::uint16_t>(last_->sequence + 1U);
  if (!last_ || last_->timestamp != header.timestamp) {
    latest_ = (latest_ + 1) % pictures_.size();
    pictures_[latest_] = Picture{};
    pictures_[latest_].timestamp = header.timestamp;
    pictures_[latest_].in_order = last_ && last_->marker;
  }
  Picture& picture = pictures_[latest_];
  markers_within_ = markers_within_ || (picture.ended && follows);
  picture.in_order = picture.in_order && follows;
  picture.ended = header.marker;
  ++picture.packets;
  if (header.capture_utc_s) picture.capture_utc_s = header.capture_utc_s;
  last_ = header;
}

PictureEnds::Piece PictureEnds::piece_out(std::int64_t pts) {
  const auto ticks = static_cast<std::uint32_t>(static_cast<std::uint64_t>(pts));
  if (!zero_) zero_ = pictures_[latest_].timestamp - ticks;  // nothing waits in libavformat yet
  const auto found = std::find_if(pictures_.begin(), pictures_.end(), [&](const Picture& picture) {
    return picture.packets > 0 && picture.timestamp == ticks + *zero_;
  });
  if (found == pictures_.end()) return {};
  ++found->pieces;
  const bool complete = found->in_order && found->ended && found->pieces == found->packets;
  return {complete && !markers_within_, found->capture_utc_s};
}

}  // namespace alidade
