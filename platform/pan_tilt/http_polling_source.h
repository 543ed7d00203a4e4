#pragma once
// open_http_polling(): a PanTiltSource that asks a device again and again over one kept HTTP
// connection (libcurl). What is asked and what the answers mean is an HttpConversation's business,
// which has no I/O of its own.
//
// Samples are polled on a fixed grid of 1/rate_hz; a late answer skips grid points and does not
// shift the grid. The answer was true between earliest_time_s, just before the request was sent,
// and latest_time_s, when the answer's first bytes were here. A server that writes header and body
// in two pieces may hold the second back for the 40 ms of a delayed acknowledgement: that limits
// the rate, not the interval. kDisconnected: unreachable, timed out, or what the conversation
// takes for such; the next try comes after a growing pause. kFailed: unusable URL, or what the
// conversation takes for good, a refused login among it, said only until the first sample has come:
// a device that starts again may refuse for a while. It is then tried again ever more rarely, up to
// kMostRefusalPauses of the longest pause apart, as devices lock a user out after a few wrong
// logins. read() runs the transfer on the calling thread; it allocates.

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "platform/pan_tilt/axis_mapping.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/system/link_rules.h"
#include "platform/system/url.h"

namespace alidade {

struct HttpRequest {
  std::string url;
  std::optional<std::string> body;   // POSTed; none: GET
  std::vector<std::string> headers;  // "Name: value"
  bool digest = true;                // log in by HTTP digest, if there is a user
  bool body_logs_in = false;         // the body holds a login, and goes nowhere else
};

struct HttpAnswer {
  long status = 0;
  std::string body;
  bool offers_digest = false;  // with 401; or basic, where it is permitted (link_rules.h)
  bool only_basic = false;     // with 401: offered, and not permitted
  std::string login_error;     // with 401: one line on what may be wrong
  double earliest_time_s = 0;
  double latest_time_s = 0;
};

class HttpConversation {
 public:
  enum class Outcome {
    kSample,        // *sample holds pan, tilt, zoom, device time; the next request is paced
    kAskOn,         // the next request follows at once
    kNothing,       // no sample; the next request is paced
    kDisconnected,  // *error says why; next_request() begins anew after a pause
    kRefused,       // *error says why the login is wrong; as kFailed, and seldom tried again
    kFailed         // *error says why; as kDisconnected once there has been a sample
  };

  virtual ~HttpConversation() = default;
  // now_s: host CLOCK_MONOTONIC.
  virtual HttpRequest next_request(double now_s) = 0;
  virtual Outcome take(const HttpAnswer& answer, PanTiltSample* sample, std::string* error) = 0;
  // A request got no answer. kAskOn: next_request() has another to make at once; else
  // kDisconnected.
  virtual Outcome unanswered() {
    reset();
    return Outcome::kDisconnected;
  }
  // What had worked has failed: begin anew.
  virtual void reset() = 0;
  // What the device does otherwise than its protocol says, as far as is known, for
  // PanTiltSource::take_notes.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
};

// Of HttpDeviceOptions::max_backoff_s: the longest pause between two tries of a login that was
// right before.
constexpr double kMostRefusalPauses = 12;

// What the user says about any device that is polled.
struct HttpDeviceOptions {
  std::string url;   // http://host[:port] or https://...
  std::string user;  // these go before what the URL may hold
  std::string password;
  LinkRules rules;
  AxisMapping pan;  // of the angle that is taken from an answer
  AxisMapping tilt;
  double rate_hz = 30;
  double timeout_s = 1;      // for one request
  double max_backoff_s = 5;  // longest pause between two tries
};

struct HttpPollingOptions : HttpDeviceOptions {
  std::string name;             // of the source: the URL without password
  Url configured;               // the same
  std::size_t max_body = 4096;  // bytes of an answer
  std::string expected;         // what an answer is: "a camera's position"
};

// All that a source needs.
struct HttpPollingPlan {
  HttpPollingOptions options;
  std::unique_ptr<HttpConversation> conversation;
  std::string error;  // why no request can ever be made; empty: none
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_http_polling(HttpPollingPlan plan);

// The parts of options->url. Takes user and password out of it where options have none, and puts its bare
// form into options->name. Empty, or what is wrong.
[[nodiscard]] std::string take_http_url(Url* url, HttpPollingOptions* options);

}  // namespace alidade
