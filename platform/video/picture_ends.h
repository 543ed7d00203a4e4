#pragma once
// PictureEnds: which piece of a picture is its last, whether any was lost, and when the picture was taken.
//
// libavformat puts RTP packets in order and gives out each one's piece of an H.264 or H.265 picture, but not
// the marker that ends the picture; without it, only the next picture's first packet shows the end,
// one period late. So the headers of the packets that go in are noted here, and the pieces that come
// out are counted: a picture whose packets arrived in order up to its marker is complete when as many
// pieces came out. After a loss or a reordering, and always with a sender that sets markers within
// pictures, this says nothing, and the next picture's beginning is the end.
// What is lost, libavformat does not tell either: the sequence numbers of a picture's packets do.
// Fixed memory. One thread at a time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "platform/video/rtp_packet.h"

namespace alidade {

class PictureEnds {
 public:
  // A packet that libavformat takes in.
  void packet_in(const RtpHeader& header);

  struct Piece {
    bool last = false;                    // of its picture, for sure
    std::optional<double> capture_utc_s;  // the picture's, by the extension of a packet so far
  };

  // A piece that libavformat gave out, with its time stamp: ticks, unwrapped, from another zero.
  [[nodiscard]] Piece piece_out(std::int64_t pts);

  struct Loss {
    bool within = false;  // of the picture, or it is not known
    bool before = false;  // between it and the picture before
  };

  // Of the picture with this time stamp, all of whose pieces that will come were given out. Of each picture once, in order.
  [[nodiscard]] Loss loss_of(std::int64_t pts);

 private:
  struct Picture {
    std::uint32_t timestamp = 0;
    int packets = 0;
    int pieces = 0;
    bool in_order = false;  // all its packets so far, from the one after another's marker on
    bool ended = false;     // its marker came
    bool late = false;      // one of its packets came behind one that follows it
    // What loss_of() has not been asked about.
    std::uint16_t first = 0;  // sequence numbers
    std::uint16_t last = 0;
    bool last_is_marked = false;
    int new_packets = 0;
    int new_pieces = 0;
    std::optional<double> capture_utc_s;
  };

  [[nodiscard]] Picture* find(std::uint32_t timestamp);
  [[nodiscard]] bool lost_its_end(const Picture& picture) const;
  [[nodiscard]] bool lost_before(const Picture& picture) const;
  [[nodiscard]] Picture* find_piece(std::int64_t pts);

  std::array<Picture, 16> pictures_;  // the latest; more than wait in libavformat for a late packet
  std::size_t latest_ = 0;
  std::optional<RtpHeader> last_;
  bool markers_within_ = false;        // this sender's markers mean nothing
  std::optional<std::uint32_t> zero_;  // timestamp of pts 0
  std::optional<std::uint16_t>
      next_sequence_;  // of the first packet behind the picture asked about last
};

}  // namespace alidade
