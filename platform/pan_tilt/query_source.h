#pragma once
// QuerySource: polls a head for its position, by any QueryProtocol over any ByteLink. Readings of
// pan and tilt lie on a grid of rate_hz, or of the rate that the serial line can carry if that is
// lower. One query is outstanding at a time; an answer later than the next grid point shifts the
// grid. A sample was true at some moment between the sending of the query and the first byte of its
// answer. Protocols that report one axis at a time give one sample for each reading of tilt, with
// pan interpolated to the moment of the tilt (AxisPairing).
// Angles are mapped by sign and zero to the model's axes, in [-pi, pi). Late answers:
// docs/derivations.md.
// kDisconnected: no link, or three queries or more given up since the latest sample, the first of
// them sent timeout_s ago or earlier; error() says what came instead. The link is then reopened
// after a growing pause. kFailed: an address or a device that can never work, or options that are
// not positive. read() does the I/O on the calling thread; it allocates.

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/pan_tilt/axis_pairing.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/pan_tilt/query_protocol.h"
#include "platform/pan_tilt/source_notes.h"
#include "platform/system/backoff.h"
#include "platform/system/byte_link.h"

namespace alidade {

struct QuerySourceOptions {
  ByteLinkOptions link;
  AxisMapping pan;
  AxisMapping tilt;
  double rate_hz = 30;
  double timeout_s = 1;      // until a head without samples counts as lost; a quarter of it for an
                             // answer (more on a slow line); also for opening the link
  double max_backoff_s = 5;  // longest pause between two attempts
};

class QuerySource : public PanTiltSource {
 public:
  QuerySource(std::unique_ptr<QueryProtocol> protocol, const QuerySourceOptions& options);

  [[nodiscard]] ReadStatus read(PanTiltSample& sample, double timeout_s) override;
  void stop() override;
  [[nodiscard]] std::string error() const override { return error_; }
  [[nodiscard]] std::string name() const override { return link_.name(); }
  [[nodiscard]] std::vector<std::string> take_notes() override { return notes_.take(); }

 private:
  enum class State {
    kClosed,    // until due_s_
    kOpening,   // until until_s_
    kSettling,  // listens: until the earlier of until_s_ and quiet_s_
    kIdle,      // until due_s_
    kAsked      // until until_s_
  };

  [[nodiscard]] double next_event_s() const;
  ReadStatus act(double now_s);  // handles the event that is due
  ReadStatus ask(double now_s);
  ReadStatus give_up(double now_s);
  void settle(double now_s);
  void doubt(double now_s);
  void listen(const std::string& bytes, double now_s);
  Answer find(const std::string& bytes, double now_s);
  [[nodiscard]] std::string what_came() const;
  bool take_bytes(const std::string& bytes, double now_s, PanTiltSample* sample);
  bool take_reading(const Answer& answer, double earliest_s, double latest_s,
                    PanTiltSample* sample);
  ReadStatus disconnect(const std::string& error);
  ReadStatus fail(const std::string& error);

  std::unique_ptr<QueryProtocol> protocol_;
  QuerySourceOptions options_;
  ByteLink link_;
  double poll_period_s_ = 0;
  double quiet_time_s_ = 0;
  double answer_time_s_ = 0;  // after this time a query is given up
  double latest_time_s_ = 0;  // after this time no answer to a query is expected
  Backoff backoff_;
  std::string error_;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};

  State state_ = State::kClosed;
  int asked_ = 0;     // queries since the line was last silent
  double due_s_ = 0;  // time of the next attempt or poll
  double until_s_ = 0;
  double quiet_s_ = 0;
  int given_up_ = 0;            // queries given up since the latest sample
  double failing_since_s_ = 0;  // when the first of these was sent
  bool some_answered_ = false;  // since then
  int open_ = 0;                // consecutive unanswered queries; their answers may still come
  double open_since_s_ = 0;     // when the first of these was sent
  bool refused_ = false;        // the latest query was refused by an answer
  bool fenced_ =
      false;  // protocol_->doubt() was called; its next query is a fence (query_protocol.h)
  bool first_is_old_ = false;  // the next answer may belong to a query of the previous connection
  bool late_awaited_ = false;  // the latest query was given up, and its answer may still come
  double late_s_ = 0;          // delay of an answer that came after its query was given up; 0:
                               // none
  bool restarted_ = true;
  std::string problem_;  // what came lately instead of a reading
  SourceNotes notes_;

  // The outstanding query.
  double sent_s_ = 0;
  std::string received_;
  std::vector<double> arrivals_s_;  // of each byte of received_

  AxisPairing pairing_;
  std::optional<double> zoom_;
};

}  // namespace alidade
