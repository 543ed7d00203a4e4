#include "platform/pan_tilt/query_source.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "platform/system/clock.h"

namespace alidade {
namespace {

constexpr double kQuietBytes = 10;  // byte times without a byte count as silence
constexpr double kLeastQuiet_s = 0.02;
constexpr int kTriesPerTimeout = 4;
constexpr double kWireTimes = 2;  // times of query and answer on the wire, for an answer
constexpr double kLeastAnswer_s = 0.05;
constexpr double kLeastLatest_s = 1;
constexpr int kGivenUpOfALostHead = 3;
constexpr int kMaxStaleChunks = 64;

}  // namespace

QuerySource::QuerySource(std::unique_ptr<QueryProtocol> protocol, const QuerySourceOptions& options)
    : protocol_(std::move(protocol)),
      options_(options),
      link_(options.link),
      backoff_(options.max_backoff_s) {
  if (!(options.rate_hz > 0) || !(options.timeout_s > 0)) {
    static_cast<void>(fail("rate_hz and timeout_s must be positive"));
    return;
  }
  const double byte_time_s = wire_time_of_byte_s(options.link);
  const double rate_hz = byte_time_s > 0
                             ? std::min(options.rate_hz, ceiling_hz(*protocol_, byte_time_s))
                             : options.rate_hz;
  poll_period_s_ = 1 / (rate_hz * protocol_->polls_per_reading());
  quiet_time_s_ = std::max(kLeastQuiet_s, kQuietBytes * byte_time_s);
  const double wire_s =
      byte_time_s * protocol_->bytes_per_reading() / protocol_->polls_per_reading();
  answer_time_s_ =
      std::max(options.timeout_s / kTriesPerTimeout, kWireTimes * wire_s + kLeastAnswer_s);
  latest_time_s_ = std::max(kLeastLatest_s, kTriesPerTimeout * answer_time_s_);
}

void QuerySource::stop() {
  stopped_ = true;
  link_.stop();
}

ReadStatus QuerySource::fail(const std::string& error) {
  error_ = name() + ": " + error;
  failed_ = true;
  link_.close();
  return ReadStatus::kFailed;
}

ReadStatus QuerySource::disconnect(const std::string& error) {
  error_ = name() + ": " + error;
  link_.close();
  state_ = State::kClosed;
  restarted_ = true;
  due_s_ = monotonic_now_s() + backoff_.next_s();
  return ReadStatus::kDisconnected;
}

double QuerySource::next_event_s() const {
  switch (state_) {
    case State::kClosed:
    case State::kIdle:
      return due_s_;
    case State::kSettling:
      return std::min(quiet_s_, until_s_);
    case State::kOpening:
    case State::kAsked:
      break;
  }
  return until_s_;
}

ReadStatus QuerySource::act(double now_s) {
  switch (state_) {
    case State::kClosed: {
      const LinkStatus status = link_.open();
      if (status == LinkStatus::kUnusable) {
        return fail(link_.error());
      }
      if (status != LinkStatus::kOk) {
        return disconnect(link_.error());
      }
      state_ = State::kOpening;
      until_s_ = now_s + options_.timeout_s;
      return ReadStatus::kOk;
    }
    case State::kOpening:
      return disconnect(link_.error());
    case State::kSettling:
      state_ = State::kIdle;
      open_ = open_ > 1 ? 0 : open_;
      return ReadStatus::kOk;
    case State::kIdle:
      return ask(now_s);
    case State::kAsked:
      return give_up(now_s);
  }
  return ReadStatus::kOk;
}

void QuerySource::settle(double now_s) {
  state_ = State::kSettling;
  asked_ = 0;
  quiet_s_ = now_s + quiet_time_s_;
  until_s_ = now_s + answer_time_s_;
  if (open_ > 1) {
    quiet_s_ = until_s_ = std::max(quiet_s_, open_since_s_ + latest_time_s_);
  }
}

// Unrequested bytes came. Bytes behind a fence that a doubt caused are younger than everything
// before it and cause no further fence: with duplicated answers, fence would follow fence.
void QuerySource::doubt(double now_s) {
  const bool behind_fence = fenced_ && asked_ == 1;
  if (!behind_fence) protocol_->doubt();
  fenced_ = !behind_fence;
  settle(now_s);
}

ReadStatus QuerySource::ask(double now_s) {
  // Bytes still in the buffers came before the query and do not answer it.
  std::string stale;
  LinkStatus status = link_.receive(&stale, 0);
  const bool surplus = status == LinkStatus::kOk;
  for (int i = 0; i < kMaxStaleChunks && status == LinkStatus::kOk; ++i) {
    status = link_.receive(&stale, 0);
  }
  if (status == LinkStatus::kStopped) {
    return ReadStatus::kStopped;
  }
  if (status == LinkStatus::kLost) {
    return disconnect(link_.error());
  }
  if (surplus && asked_ > 0) {
    doubt(now_s);
    return ReadStatus::kOk;
  }
  const Query query = protocol_->next();
  ++asked_;
  refused_ = false;
  late_awaited_ = false;
  received_.clear();
  arrivals_s_.clear();
  sent_s_ = monotonic_now_s();
  if (link_.send(query.bytes) != LinkStatus::kOk) {
    return disconnect(link_.error());
  }
  if (query.paced) {
    due_s_ = std::max(due_s_ + poll_period_s_, now_s);
  }
  state_ = State::kAsked;
  until_s_ = sent_s_ + answer_time_s_;
  return ReadStatus::kOk;
}

ReadStatus QuerySource::give_up(double now_s) {
  if (given_up_ == 0) {
    failing_since_s_ = sent_s_;
    some_answered_ = false;
  }
  ++given_up_;
  if (open_ == 0) {
    open_since_s_ = sent_s_;
  }
  ++open_;
  late_awaited_ = !refused_;
  if (given_up_ >= kGivenUpOfALostHead && now_s - failing_since_s_ >= options_.timeout_s) {
    return disconnect(what_came());
  }
  pairing_.reset();
  fenced_ = false;
  const std::string bytes = protocol_->give_up();
  if (!bytes.empty() && link_.send(bytes) != LinkStatus::kOk) {
    return disconnect(link_.error());
  }
  settle(now_s);
  return ReadStatus::kOk;
}

std::string QuerySource::what_came() const {
  if (late_s_ > 0) {
    return "an answer came " + std::to_string(std::lround(1e3 * late_s_)) +
           " ms after its query, later than " + std::to_string(std::lround(1e3 * answer_time_s_)) +
           " ms; raise pan_tilt.timeout_s";
  }
  if (!problem_.empty()) {
    return problem_;
  }
  return std::string("no answer of ") + protocol_->name() +
         (some_answered_ ? ": not every query is answered; does the head tell both pan and tilt?"
                         : "; check power, wiring, address and baud or port");
}

// Waits for the line to fall silent, or for the answer to a query that was given up.
void QuerySource::listen(const std::string& bytes, double now_s) {
  if (late_awaited_ && find(bytes, now_s).kind != Answer::Kind::kNone) {
    late_awaited_ = false;
    late_s_ = std::max(late_s_, now_s - sent_s_);
    open_ = 0;
    settle(now_s);
  } else if (open_ < 2) {
    quiet_s_ = now_s + quiet_time_s_;
  }
}

// Searches all bytes since the query.
Answer QuerySource::find(const std::string& bytes, double now_s) {
  if (link_.is_datagram() && protocol_->is_of_datagrams()) {
    received_.clear();
    arrivals_s_.clear();
  }
  received_ += bytes;
  arrivals_s_.resize(received_.size(), now_s);
  if (received_.size() > kMaxAnswer) {
    const std::size_t excess = received_.size() - kMaxAnswer;
    received_.erase(0, excess);
    arrivals_s_.erase(arrivals_s_.begin(),
                      arrivals_s_.begin() + static_cast<std::ptrdiff_t>(excess));
  }
  Answer answer = protocol_->find(received_);
  if (answer.kind != Answer::Kind::kNone && answer.begin >= received_.size()) {
    answer = {};
    answer.problem = std::string(protocol_->name()) +
                     " takes an answer from where no byte has come: a defect of this program";
  }
  return answer;
}

// Returns true if *sample is filled.
bool QuerySource::take_bytes(const std::string& bytes, double now_s, PanTiltSample* sample) {
  if (state_ == State::kSettling || (state_ == State::kIdle && late_awaited_)) {
    listen(bytes, now_s);
    return false;
  }
  if (state_ == State::kIdle && asked_ > 0) doubt(now_s);
  if (state_ != State::kAsked) {
    return false;
  }
  const Answer answer = find(bytes, now_s);
  if (!answer.problem.empty()) {
    problem_ = answer.problem;
  }
  if (answer.kind == Answer::Kind::kNone) {
    return false;
  }
  open_ = 0;
  if (std::exchange(first_is_old_, false)) {
    pairing_.reset();
    doubt(now_s);
    return false;
  }
  if (answer.kind == Answer::Kind::kRefused) {
    until_s_ = now_s;  // given up at once
    refused_ = true;
    return false;
  }
  state_ = State::kIdle;
  if (answer.kind == Answer::Kind::kDone) {
    return false;
  }
  problem_.clear();
  some_answered_ = true;
  return take_reading(answer, sent_s_, arrivals_s_[answer.begin], sample);
}

bool QuerySource::take_reading(const Answer& answer, double earliest_s, double latest_s,
                               PanTiltSample* sample) {
  const double pan_rad = mapped_rad(answer.pan_deg * kRadPerDeg, options_.pan);
  const double tilt_rad = mapped_rad(answer.tilt_deg * kRadPerDeg, options_.tilt);
  std::optional<PairedReading> paired;
  switch (answer.kind) {
    case Answer::Kind::kPan:
      paired = pairing_.add_pan({earliest_s, latest_s, pan_rad});
      break;
    case Answer::Kind::kTilt:
      pairing_.add_tilt({earliest_s, latest_s, tilt_rad});
      break;
    case Answer::Kind::kPanTilt:
      paired = PairedReading{earliest_s, latest_s, pan_rad, tilt_rad};
      break;
    case Answer::Kind::kZoom:
      zoom_ = answer.zoom;
      break;
    case Answer::Kind::kNone:
    case Answer::Kind::kDone:
    case Answer::Kind::kRefused:
      break;
  }
  if (!paired) {
    return false;
  }
  *sample = PanTiltSample{};
  sample->earliest_time_s = paired->earliest_s;
  sample->latest_time_s = paired->latest_s;
  sample->pan_rad = paired->pan_rad;
  sample->tilt_rad = paired->tilt_rad;
  sample->zoom = zoom_;
  sample->restarted = std::exchange(restarted_, false);
  notes_.add(name(), protocol_->peculiarity());
  backoff_.reset();
  given_up_ = 0;
  late_s_ = 0;
  return true;
}

ReadStatus QuerySource::read(PanTiltSample& sample, double timeout_s) {
  const double deadline_s = monotonic_now_s() + timeout_s;
  std::string bytes;
  for (;;) {
    if (stopped_) {
      return ReadStatus::kStopped;
    }
    if (failed_) {
      return ReadStatus::kFailed;
    }
    double now_s = monotonic_now_s();
    const double wait_s = std::min(next_event_s(), deadline_s) - now_s;
    const LinkStatus status =
        state_ == State::kOpening ? link_.finish_open(wait_s) : link_.receive(&bytes, wait_s);
    now_s = monotonic_now_s();
    switch (status) {
      case LinkStatus::kOk:
        if (state_ == State::kOpening) {
          protocol_->restart();
          pairing_.reset();
          zoom_.reset();
          problem_.clear();
          given_up_ = 0;
          late_s_ = 0;
          late_awaited_ = false;
          fenced_ = false;
          first_is_old_ = open_ > 0;
          open_ = open_ > 0 ? 2 : 0;  // answers to earlier queries may come on the new connection,
                                      // too
          due_s_ = now_s;
          settle(now_s);
        } else if (take_bytes(bytes, now_s, &sample)) {
          return ReadStatus::kOk;
        }
        break;
      case LinkStatus::kTimeout:
        break;
      case LinkStatus::kStopped:
        return ReadStatus::kStopped;
      case LinkStatus::kLost:
        return disconnect(link_.error());
      case LinkStatus::kUnusable:
        return fail(link_.error());
    }
    if (now_s >= next_event_s()) {
      const ReadStatus acted = act(now_s);
      if (acted != ReadStatus::kOk) {
        return acted;
      }
    } else if (now_s >= deadline_s) {
      return ReadStatus::kTimeout;
    }
  }
}

}  // namespace alidade
