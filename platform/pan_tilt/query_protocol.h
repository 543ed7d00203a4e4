#pragma once
// QueryProtocol: what a pan/tilt head is asked and how its answers are found among the bytes that
// come; the protocols are those of heads.h. No I/O, no clock, no exceptions; QuerySource does the talking.
//
// One query is under way at a time. next() gives it; find() looks for its answer in all bytes that
// have come since it was sent (at most kMaxAnswer; a device that babbles loses the oldest), the latest if there are several. What is
// no answer to it (noise, half frames, echoes, late answers to another query, unsolicited lines) is
// passed over.
//
// The fence. give_up() tells that no usable answer came, none at all or one that is kRefused: the right one may still come. Unless answers bear the number of
// their query, it would then look like the answer to the same query asked again. So next() asks something
// else first, whose answer looks different, a fence: heads answer in order, and once the fence is answered,
// nothing older is under way. find() still knows the answer to what was given up, until next().
// - Queries in turn, answers that name theirs (Pelco-D: pan, tilt): the next in turn is the fence.
// - A single query for the position: anything else that the head answers and that moves nothing, be it
//   asked for nothing but that (VISCA: the zoom) or a command of which only the acknowledgement counts
//   (PTU: CI). A refusal answers a fence, too (Answer::Kind::kDone).
// - Numbered queries (VISCA with header): no fence is needed, the numbers differ; unless the device does not
//   answer with the number of the query.
// First of a connection, too, and after doubt(), unless an answer too many shows by itself: the line may still hold what another
// program asked. Where the fence is not answered either, QuerySource listens for long, and what was given up may be asked again.
// A head with one query, no sequence numbers, and silence about all else cannot be asked: its late answers would be
// taken for later ones.
//
// Angles are degrees as the device counts them; signs and zeros are QuerySource's.

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace alidade {

constexpr std::size_t kMaxAnswer = 512;  // bytes

// i < bytes.size().
[[nodiscard]] inline std::uint8_t byte_at(std::string_view bytes, std::size_t i) {
  return static_cast<std::uint8_t>(bytes[i]);
}

struct Query {
  std::string bytes;
  bool paced = true;  // on the grid of polls; false: at once, as fences are asked
};

struct Answer {
  enum class Kind {
    kNone,  // not yet
    kPan,
    kTilt,
    kPanTilt,
    kZoom,
    kDone,    // an answer without a reading
    kRefused  // an answer without use: the device says that it does not, or what it says cannot be
  };
  Kind kind = Kind::kNone;
  double pan_deg = 0;
  double tilt_deg = 0;
  double zoom = 0;  // device units, 0 to 65535
  // Index of the answer's first byte, below the number of bytes searched. The interval in which the angle was true ends when
  // that byte came: 0 is wrong behind noise.
  std::size_t begin = 0;
  // What the device said, or what is wrong with what came: one line of less than 200 bytes. Never empty of kRefused.
  std::string problem;
};

class QueryProtocol {
 public:
  virtual ~QueryProtocol() = default;

  [[nodiscard]] virtual const char* name() const = 0;
  virtual void
  restart() = 0;  // a new connection, before its first query: nothing is known of the device
  // Never without bytes: an answer is waited for after each. After give_up() other bytes than before it.
  [[nodiscard]] virtual Query next() = 0;
  // A reading lies within a turn, and begins with one of the bytes. None in no bytes.
  [[nodiscard]] virtual Answer find(std::string_view bytes) = 0;
  // Bytes that bring the device back to the start of a command and that it does not answer; mostly none.
  [[nodiscard]] virtual std::string give_up() = 0;

  // Bytes came that nobody asked for. Where it matters next() asks a fence, as also after every
  // kQueriesPerFence queries: one answer too many makes each answer that of the query before.
  virtual void doubt() = 0;
  // In which way the device differs from the protocol, and what is made of it, one line; empty: in
  // none.
  [[nodiscard]] virtual std::string peculiarity() const { return {}; }
  // Over UDP: whether each datagram is a frame of its own (VISCA's header) and is to be searched alone; false for lines of text.
  [[nodiscard]] virtual bool is_of_datagrams() const = 0;

  // Of one reading of pan and tilt, without zoom and fences: polls, and bytes of queries and answers together, the longest usual ones: at most a quarter
  // more than a common position takes.
  [[nodiscard]] virtual int polls_per_reading() const = 0;
  [[nodiscard]] virtual int bytes_per_reading() const = 0;
};

// Readings of pan and tilt a second that a line can carry. byte_time_s > 0.
[[nodiscard]] inline double ceiling_hz(const QueryProtocol& protocol, double byte_time_s) {
  return 1 / (protocol.bytes_per_reading() * byte_time_s);
}

// A reading beyond a turn is none: garbled, or another degree per step than configured.
[[nodiscard]] constexpr bool is_within_a_turn(double angle_deg) {
  return angle_deg >= -360 && angle_deg <= 360;
}

// With the zoom asked too, every so many readings bring it.
constexpr int kReadingsPerZoom = 10;

constexpr int kQueriesPerFence = 64;

}  // namespace alidade
