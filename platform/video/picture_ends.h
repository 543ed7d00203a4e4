#pragma once
// PictureEnds: finds the last piece of each picture, losses, and capture times.
//
// libavformat sorts RTP packets and returns the piece of an H.264 or H.265 picture in each. The
// marker that ends the picture is not returned. Without the marker the end shows only with the next
// picture's first packet, one period late. So this class notes the headers of incoming packets and
// counts the pieces that come out. A picture whose packets came in order up to its marker is
// complete when as many pieces came out as packets went in. After a loss or reordering, and for a
// sender that sets markers within pictures, the end is the start of the next picture. Losses show
// in the sequence numbers. Fixed memory. One thread at a time.

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "platform/video/rtp_packet.h"

namespace alidade {

class PictureEnds {
 public:
  // To be called for each packet that goes into libavformat.
  void packet_in(const RtpHeader& header);

  struct Piece {
    bool last = false;                    // certainly the last piece of its picture
    std::optional<double> capture_utc_s;  // of the picture, if an extension in one of its packets
                                          // so far gives it
  };

  // To be called for each piece that comes out. pts: its time stamp, ticks of the RTP clock,
  // unwrapped, with another zero than RtpHeader::timestamp.
  [[nodiscard]] Piece piece_out(std::int64_t pts);

  struct Loss {
    bool within = false;  // a loss within the picture, or it is unknown whether there was one
    bool before = false;  // a loss between the picture and the previous one, or likewise unknown
  };

  // Losses of the picture with this time stamp, after its last piece came out. To be called once
  // per picture, in order.
  [[nodiscard]] Loss loss_of(std::int64_t pts);

 private:
  struct Picture {
    std::uint32_t timestamp = 0;
    int packets = 0;
    int pieces = 0;
    bool in_order = false;  // all packets so far, starting after another picture's marker
    bool ended = false;     // its marker has come
    bool late = false;      // a packet came after one that follows it
    // Since the last call of loss_of() for this picture.
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

  std::array<Picture, 16> pictures_;  // the latest; more than can wait in libavformat for a late
                                      // packet
  std::size_t latest_ = 0;
  std::optional<RtpHeader> last_;
  bool markers_within_ = false;                 // this sender's markers do not mark ends
  std::optional<std::uint32_t> zero_;           // timestamp that corresponds to pts 0
  std::optional<std::uint16_t> next_sequence_;  // first one after the picture of the last loss_of()
};

}  // namespace alidade
