#pragma once
// QuerySource: a head that is asked for its position, by any QueryProtocol over any ByteLink.
//
// Polls lie on a grid of rate_hz, or of what a serial line can carry if that is less. One query is under
// way at a time: an answer later than that shifts the grid, for a head that cannot keep up is asked as
// often as it answers. What an answer tells was true between the sending of the query and the answer's
// first byte. A query without answer is given up after a quarter of timeout_s, or twice what query and
// answer take on the wire and 50 ms if that is longer. Its answer may still come, and must not be taken for
// that of a later query: the protocol asks next what is answered differently, and an answer to that shows
// that nothing older is under way, for heads answer in order. If it is not answered either, the source
// listens until four times that time, at least 1 s, has passed since the first of the two was sent: an
// answer later than that can be taken for another's. A converter that stood still for longer hands such a one to the
// next connection: where queries were open at the end of the one before, the first answer is thrown away, and those
// that come behind it as they find no query. Protocols that give one axis at a time yield a sample
// for each tilt, with the pan of the same moment (AxisPairing). Signs and zeros turn what the device counts
// into the axes of the model, in [-pi, pi).
//
// kDisconnected: no link, or no sample within timeout_s and three queries given up; error() says what
// came instead. The link is then closed and opened again after a growing pause. kFailed: an address or a
// device that can never work. read() talks on the calling thread; it allocates.

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
  double timeout_s = 1;      // without a sample: the head is lost
  double max_backoff_s = 5;  // longest pause between two tries
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
    kSettling,  // listens: until until_s_, or until quiet_s_ if that is earlier
    kIdle,      // until due_s_
    kAsked      // until until_s_
  };

  [[nodiscard]] double next_event_s() const;
  ReadStatus act(double now_s);  // the event's time has come
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
  double answer_time_s_ = 0;  // a query without an answer for so long is given up
  double latest_time_s_ = 0;  // no answer comes so long after its query
  Backoff backoff_;
  std::string error_;
  bool failed_ = false;
  std::atomic<bool> stopped_{false};

  State state_ = State::kClosed;
  int asked_ = 0;     // queries since the line was silent
  double due_s_ = 0;  // of the next try or the next poll
  double until_s_ = 0;
  double quiet_s_ = 0;
  int given_up_ = 0;            // queries since the latest sample
  double failing_since_s_ = 0;  // when the first of them was sent
  bool some_answered_ = false;  // since then
  int open_ = 0;                // queries in a row without answers, which may still come
  double open_since_s_ = 0;     // when the first of them was sent
  bool refused_ = false;        // the latest query, by an answer
  bool fenced_ = false;         // a doubt was told to the protocol, whose next query is a fence
  bool first_is_old_ = false;   // the next answer may be that of a query of the connection before
  bool late_awaited_ = false;   // the answer to the latest query, which was given up
  double late_s_ = 0;           // how long an answer took that was given up; 0: none did
  bool restarted_ = true;
  std::string problem_;  // what came instead of a reading, lately
  SourceNotes notes_;

  // The query under way.
  double sent_s_ = 0;
  std::string received_;
  std::vector<double> arrivals_s_;  // of each byte

  AxisPairing pairing_;
  std::optional<double> zoom_;
};

}  // namespace alidade
