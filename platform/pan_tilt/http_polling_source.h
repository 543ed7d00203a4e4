#pragma once
// open_http_polling(): a PanTiltSource that polls a device over one persistent HTTP connection
// (libcurl). An HttpConversation, which does no I/O, makes the requests and interprets the answers.
// Polls lie on a fixed grid of 1/rate_hz; a late answer skips grid points and does not shift the
// grid. kDisconnected: unreachable, timed out, an answer that is too long, a redirection that
// LinkRules refuse, or the conversation reports kDisconnected; the next attempt follows after a
// growing pause. kFailed: unusable URL or rate_hz; before the first sample (or kNothing) also a
// permanent error of the conversation, such as a refused login. Later such an error is
// kDisconnected, as a rebooting device may refuse for a while (kMostRefusalPauses). read() runs the
// transfer on the calling thread and allocates.

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
  std::optional<std::string> body;   // sent by POST; nullopt: GET
  std::vector<std::string> headers;  // "Name: value"
  bool digest = true;                // log in by HTTP digest if a user is configured
  bool body_logs_in = false;         // the body holds a login: never send it elsewhere
};

struct HttpAnswer {
  long status = 0;
  std::string body;
  bool offers_digest = false;  // with 401: digest, or basic where permitted (link_rules.h)
  bool only_basic = false;     // with 401: only basic is offered, and it is not permitted
  std::string login_error;     // with 401: one line on what may be wrong
  // s, host CLOCK_MONOTONIC. The answer was true at some moment between the sending of the request
  // and the arrival of the answer's first bytes. A server that writes header and body separately
  // may delay the body by the 40 ms of a delayed acknowledgement. This delay lowers the rate, but
  // does not widen the interval.
  double earliest_time_s = 0;
  double latest_time_s = 0;
};

class HttpConversation {
 public:
  enum class Outcome {
    kSample,        // *sample has zoom, device time, and pan and tilt (rad) as the device counts;
                    // the next request is on the grid
    kAskOn,         // the next request follows at once
    kNothing,       // a good answer, but no sample yet; the next request is on the grid
    kDisconnected,  // *error says why; next_request() starts anew after a pause
    kRefused,       // *error says why the login is wrong; like kFailed, but with longer pauses
    kFailed         // *error says why; like kDisconnected after a first kSample or kNothing
  };

  virtual ~HttpConversation() = default;
  // now_s: host CLOCK_MONOTONIC.
  virtual HttpRequest next_request(double now_s) = 0;
  virtual Outcome take(const HttpAnswer& answer, PanTiltSample* sample, std::string* error) = 0;
  // A request got no answer. kAskOn: next_request() has an alternative to send at once. Otherwise
  // kDisconnected.
  virtual Outcome unanswered() {
    reset();
    return Outcome::kDisconnected;
  }
  // The connection has failed: next_request() starts anew.
  virtual void reset() = 0;
  // How the device is known to deviate from its protocol, for PanTiltSource::take_notes.
  [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
};

// Longest pause between two attempts of a login that was accepted before, in units of
// HttpDeviceOptions::max_backoff_s. The pause is long because devices lock a user out after a few
// wrong logins.
constexpr double kMostRefusalPauses = 12;

// The user's options for any polled device.
struct HttpDeviceOptions {
  std::string url;   // http://host[:port] or https://...
  std::string user;  // user and password take precedence over those in the URL
  std::string password;
  LinkRules rules;
  AxisMapping pan;  // applied to the angle parsed from an answer
  AxisMapping tilt;
  double rate_hz = 30;
  double timeout_s = 1;      // for one request, connection included
  double max_backoff_s = 5;  // longest pause between two attempts
};

struct HttpPollingOptions : HttpDeviceOptions {
  std::string name;             // name of the source: the URL without password
  Url configured;               // the same URL, parsed
  std::size_t max_body = 4096;  // bytes; longest answer
  std::string expected;         // what an answer holds, for errors: "a camera's position"
};

// Everything that a source needs.
struct HttpPollingPlan {
  HttpPollingOptions options;
  // Not null unless `error` is set.
  std::unique_ptr<HttpConversation> conversation;
  std::string error;  // why no request can ever be made; empty if it can
};

[[nodiscard]] std::unique_ptr<PanTiltSource> open_http_polling(HttpPollingPlan plan);

// Splits options->url into *url. Takes user and password from the URL if *options has none, and
// puts the URL without them into options->name. Returns what is wrong, in one line; empty: nothing.
[[nodiscard]] std::string take_http_url(Url* url, HttpPollingOptions* options);

}  // namespace alidade
