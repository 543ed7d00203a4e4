#include "platform/video/picture_ends.h"

#include <algorithm>

namespace alidade {

void PictureEnds::packet_in(const RtpHeader& header) {
  const auto after = [](std::uint16_t a, std::uint16_t b) {
    return static_cast<std::int16_t>(static_cast<std::uint16_t>(a - b)) > 0;
  };
  const bool follows = last_ && header.sequence == static_cast<std::uint16_t>(last_->sequence + 1U);
  Picture* known = find(header.timestamp);
  if (known == nullptr) {
    latest_ = (latest_ + 1) % pictures_.size();
    known = &pictures_[latest_];
    *known = Picture{};
    known->timestamp = header.timestamp;
    known->in_order = last_ && last_->marker;
  }
  Picture& picture = *known;
  markers_within_ = markers_within_ || (picture.ended && follows);
  picture.in_order = picture.in_order && follows;
  picture.ended = header.marker;
  picture.late = picture.late || (last_ && !after(header.sequence, last_->sequence));
  ++picture.packets;
  if (picture.new_packets == 0 || after(picture.first, header.sequence)) {
    picture.first = header.sequence;
  }
  if (picture.new_packets == 0 || after(header.sequence, picture.last)) {
    picture.last = header.sequence;
    picture.last_is_marked = header.marker;
  }
  ++picture.new_packets;
  if (header.capture_utc_s) picture.capture_utc_s = header.capture_utc_s;
  last_ = header;
}

PictureEnds::Picture* PictureEnds::find(std::uint32_t timestamp) {
  const auto found =
      std::find_if(pictures_.begin(), pictures_.end(), [timestamp](const Picture& picture) {
        return picture.packets > 0 && picture.timestamp == timestamp;
      });
  return found == pictures_.end() ? nullptr : &*found;
}

PictureEnds::Picture* PictureEnds::find_piece(std::int64_t pts) {
  const auto ticks = static_cast<std::uint32_t>(static_cast<std::uint64_t>(pts));
  if (!zero_) zero_ = pictures_[latest_].timestamp - ticks;  // nothing waits in libavformat yet
  return find(ticks + *zero_);
}

PictureEnds::Piece PictureEnds::piece_out(std::int64_t pts) {
  Picture* const picture = find_piece(pts);
  if (picture == nullptr) return {};
  ++picture->pieces;
  ++picture->new_pieces;
  const bool complete = picture->in_order && picture->ended && picture->pieces == picture->packets;
  return {complete && !markers_within_, picture->capture_utc_s};
}

// True unless the last packet is certainly the picture's last: it is marked, or the next picture's
// first packet follows it.
bool PictureEnds::lost_its_end(const Picture& picture) const {
  if (picture.last_is_marked && !markers_within_) return false;
  const auto next = static_cast<std::uint16_t>(picture.last + 1U);
  return std::none_of(pictures_.begin(), pictures_.end(), [next](const Picture& other) {
    return other.new_packets > 0 && other.first == next;
  });
}

// Packets that came in order between the previous picture and this one are not lost: libavformat
// has no use for them, as for repair packets.
bool PictureEnds::lost_before(const Picture& picture) const {
  if (!next_sequence_) return false;
  const auto behind_the_last = [this](std::uint16_t sequence) {
    return static_cast<int>(static_cast<std::uint16_t>(sequence - *next_sequence_));
  };
  const int between = behind_the_last(picture.first);
  int came = 0;
  for (const Picture& other : pictures_) {
    const bool is_between = other.new_packets > 0 && behind_the_last(other.first) < between;
    if (is_between && !other.late) came += other.new_packets;
  }
  return came != between;
}

PictureEnds::Loss PictureEnds::loss_of(std::int64_t pts) {
  Picture* const picture = find_piece(pts);
  if (picture == nullptr || picture->new_packets == 0) return {true, true};
  const int span = static_cast<std::uint16_t>(picture->last - picture->first) + 1;
  // libavformat drops packets that come too late. Packets that came in order without a piece were
  // of no use to it.
  const bool given_out = picture->new_pieces == picture->new_packets || !picture->late;
  const Loss loss{span != picture->new_packets || !given_out || lost_its_end(*picture),
                  lost_before(*picture)};
  next_sequence_ = static_cast<std::uint16_t>(picture->last + 1U);
  picture->new_packets = 0;
  picture->new_pieces = 0;
  picture->late = false;
  return loss;
}

}  // namespace alidade
