#pragma once
// QueryProtocol: the queries to a pan/tilt head, and how its answers are found in the received
// bytes. heads.h lists the protocols. No I/O, no clock, no exceptions; QuerySource does the I/O.
// One query is outstanding at a time; next() returns it. find() looks for the answer in all bytes
// since the query was sent (at most kMaxAnswer; of more, the oldest are dropped) and takes the
// latest of several answers. Anything else is skipped: noise, partial frames, echoes, late answers
// to another query, unsolicited lines. After give_up(), next() returns a query with a different
// answer, so that a late answer is not taken for that of a later query. Unless answers name their
// query, that is a fence: a query of another kind. Angles are degrees as the device counts;
// QuerySource applies signs and zeros. Fences: docs/derivations.md.

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
  bool paced = true;  // on the polling grid; false: at once, as for fences
};

struct Answer {
  enum class Kind {
    kNone,  // not yet received
    kPan,
    kTilt,
    kPanTilt,
    kZoom,
    kDone,    // an answer without a reading
    kRefused  // an answer without use: the device refuses, or the value is impossible
  };
  Kind kind = Kind::kNone;
  double pan_deg = 0;
  double tilt_deg = 0;
  double zoom = 0;  // device units, 0 to 65535
  // Index of the answer's first byte, less than the number of bytes searched. The interval in which
  // the angle was true ends when this byte arrived; 0 is wrong if noise comes before the answer.
  std::size_t begin = 0;
  // The device's message, or what is wrong with the received bytes: one line of less than 200
  // bytes. Not empty for kRefused.
  std::string problem;
};

class QueryProtocol {
 public:
  virtual ~QueryProtocol() = default;

  [[nodiscard]] virtual const char* name() const = 0;
  // On a new connection, before its first query: nothing is known of the device.
  virtual void restart() = 0;
  // The next query. Its bytes are never empty: an answer is awaited after each query. After
  // give_up() they differ from the bytes of the query before.
  [[nodiscard]] virtual Query next() = 0;
  // A reading is within a turn; `begin` is the index of one of the bytes. kNone if there are no
  // bytes.
  [[nodiscard]] virtual Answer find(std::string_view bytes) = 0;
  // Bytes that reset the device's command parser and that the device does not answer; usually none.
  [[nodiscard]] virtual std::string give_up() = 0;

  // To be called when unrequested bytes came. A protocol that needs fences then returns one by
  // next(), as after every kQueriesPerFence queries. Reason: after one surplus answer, each answer
  // is that of the previous query.
  virtual void doubt() = 0;
  // How the device deviates from the protocol and how this is handled, in one line. Empty: the
  // device does not deviate.
  [[nodiscard]] virtual std::string peculiarity() const { return {}; }
  // Over UDP, true: each datagram is a frame (VISCA's header) and is searched by itself. False for
  // lines of text.
  [[nodiscard]] virtual bool is_of_datagrams() const = 0;

  // For one reading of pan and tilt, without zoom and fences: number of polls, and bytes of queries
  // and answers together. The bytes are for the longest usual answers, at most a quarter more than
  // a common position takes.
  [[nodiscard]] virtual int polls_per_reading() const = 0;
  [[nodiscard]] virtual int bytes_per_reading() const = 0;
};

// Readings of pan and tilt per second that a line can carry. byte_time_s > 0.
[[nodiscard]] inline double ceiling_hz(const QueryProtocol& protocol, double byte_time_s) {
  return 1 / (protocol.bytes_per_reading() * byte_time_s);
}

// A reading beyond a turn is invalid: garbled, or the configured degrees per step are wrong.
[[nodiscard]] constexpr bool is_within_a_turn(double angle_deg) {
  return angle_deg >= -360 && angle_deg <= 360;
}

// Readings of pan and tilt per reading of zoom, if zoom is read.
constexpr int kReadingsPerZoom = 10;

constexpr int kQueriesPerFence = 64;

}  // namespace alidade
