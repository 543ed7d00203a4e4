#include "platform/discovery/onvif_inquiry.h"

#include <strings.h>

#include <algorithm>

#include "platform/discovery/http_question.h"
#include "platform/discovery/onvif_media.h"
#include "platform/pan_tilt/onvif_addresses.h"
#include "platform/pan_tilt/onvif_login.h"
#include "platform/system/clock.h"
#include "platform/system/random.h"
#include "platform/system/shown.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

class OnvifInquiry {
 public:
  OnvifInquiry(Url device, DeviceLogin login, double timeout_s)
      : device_(std::move(device)), login_(std::move(login)), timeout_s_(timeout_s) {}

  DeviceReport run();

 private:
  struct Answer {
    std::string body;
    std::string error;  // one line; empty: the body is an answer
    bool refused = false;
    bool silent = false;  // nothing answers
  };

  HttpReply send(const std::string& url, const OnvifCall& call, const std::string& content,
                 bool with_login);
  Answer ask(const std::string& url, const OnvifCall& call, const std::string& content);
  // At the first of the addresses that answers.
  Answer ask_any(std::vector<std::string>* addresses, const OnvifCall& call,
                 const std::string& content);
  void ask_clock();
  Answer find_services();
  Answer find_streams();
  void find_urls();

  Url device_;
  DeviceLogin login_;
  double timeout_s_;
  OnvifLoginWays ways_;
  std::string refusal_;  // of all ways to log in: then none is tried any more
  OnvifServices services_;
  std::string media2_;
  bool is_media2_ = false;  // the streams were found there
  std::vector<std::string> media_addresses_;
  DeviceReport report_;
};

HttpReply OnvifInquiry::send(const std::string& url, const OnvifCall& call,
                             const std::string& content, bool with_login) {
  const bool digest = ways_.way() == OnvifLoginWays::Way::kDigest;
  std::optional<OnvifLogin> token;
  if (with_login && !digest) {
    token.emplace();
    token->user = login_.user;
    token->password = login_.password;
    token->created_utc_s = ways_.created_utc_s(monotonic_now_s(), utc_now_s());
    token->nonce = random_bytes(kOnvifNonceBytes);
  }
  HttpQuestion question;
  question.url = url;
  question.body = onvif_envelope(call, content, token);
  question.headers = {onvif_content_type(call), "Expect:"};
  question.timeout_s = timeout_s_;
  question.rules = login_.rules;
  if (with_login && digest) {
    question.user = login_.user;
    question.password = login_.password;
  }
  return ask_http(question);
}

// First without a login: many devices tell everybody what they are.
OnvifInquiry::Answer OnvifInquiry::ask(const std::string& url, const OnvifCall& call,
                                       const std::string& content) {
  Answer answer;
  bool with_login = ways_.was_good();
  for (;;) {
    const HttpReply reply = send(url, call, content, with_login);
    answer.body = reply.body;
    if (reply.status == 0) {
      answer.error = reply.error;
      answer.silent = true;
      return answer;
    }
    const std::optional<SoapFault> fault = parse_soap_fault(reply.body);
    answer.refused = reply.status == 401 || reply.status == 403 || (fault && fault->not_authorized);
    if (!answer.refused) {
      if (with_login) ways_.accepted();
      if (fault) {
        answer.error =
            std::string("the device answers ") + call.name + " with '" + fault->text + "'";
      } else if (reply.status != 200) {
        answer.error = "HTTP status " + std::to_string(reply.status) + " for " + call.name;
      }
      return answer;
    }
    const std::string why = fault ? fault->text : std::to_string(reply.status);
    if (login_.user.empty()) {
      answer.error = "the device wants a user and a password (" + why + ")";
      return answer;
    }
    if (!refusal_.empty()) {
      answer.error = refusal_;
      return answer;
    }
    if (!with_login) {
      with_login = true;
      continue;
    }
    if (ways_.refused(reply.offers_digest)) continue;
    refusal_ = "wrong user or password (" + why +
               "); ONVIF may have users of its own in the device" + ways_.tried_text();
    answer.error = refusal_;
    return answer;
  }
}

OnvifInquiry::Answer OnvifInquiry::ask_any(std::vector<std::string>* addresses,
                                           const OnvifCall& call, const std::string& content) {
  Answer first;
  for (std::size_t i = 0; i < addresses->size(); ++i) {
    Answer answer = ask((*addresses)[i], call, content);
    const bool answers = answer.error.empty() && is_onvif_answer(answer.body, call);
    if (answers || answer.refused) {
      addresses->assign(1, std::string((*addresses)[i]));
      return answer;
    }
    if (answer.error.empty())
      answer.error = std::string("no answer to ") + call.name + "; is it an ONVIF service?";
    if (i == 0) first = answer;
    if (answer.silent) break;
  }
  return first;
}

void OnvifInquiry::ask_clock() {
  const double before_s = monotonic_now_s();
  const HttpReply reply = send(device_.bare, kGetSystemDateAndTime, "", false);
  const double age_s = (monotonic_now_s() - before_s) / 2;
  OnvifClock clock;
  std::string ignored;
  const bool told = parse_onvif_clock(reply.body, &clock, &ignored);
  ways_.set_clock(told ? std::optional(clock) : std::nullopt, monotonic_now_s() - age_s,
                  utc_now_s() - age_s);
}

OnvifInquiry::Answer OnvifInquiry::find_services() {
  std::string ignored;
  Answer listed = ask(device_.bare, kGetServices, "<IncludeCapability>false</IncludeCapability>");
  if (listed.silent) return listed;
  media2_ = parse_onvif_media2(listed.body);
  bool has_ptz = parse_onvif_services(listed.body, &services_, &ignored);
  bool answered = is_onvif_answer(listed.body, kGetServices);
  if (!has_ptz) {
    const Answer able = ask(device_.bare, kGetCapabilities, "<Category>All</Category>");
    OnvifServices told;
    has_ptz = parse_onvif_services(able.body, &told, &ignored);
    if (is_onvif_answer(able.body, kGetCapabilities)) {
      answered = true;
      services_.ptz = told.ptz;
      if (services_.media.empty()) services_.media = told.media;
    }
    if (!answered && listed.error.empty()) listed.error = able.error;
  }
  if (answered) {
    report_.has_pan_tilt = has_ptz;
    listed.error.clear();
  } else if (listed.error.empty()) {
    listed.error = "no answer of an ONVIF device; is the path right?";
  }
  return listed;
}

OnvifInquiry::Answer OnvifInquiry::find_streams() {
  const bool other_port = login_.user.empty();
  Answer answer;
  if (!media2_.empty()) {
    media_addresses_ = onvif_addresses(device_, media2_, OnvifService::kMedia, other_port);
    answer = ask_any(&media_addresses_, kGetProfiles2, onvif_media_content(kGetProfiles2, ""));
    is_media2_ =
        answer.error.empty() && parse_onvif_streams(answer.body, &report_.streams, &answer.error);
    if (is_media2_ || answer.refused) return answer;
  }
  media_addresses_ = onvif_addresses(device_, services_.media, OnvifService::kMedia, other_port);
  answer = ask_any(&media_addresses_, kGetProfiles, "");
  if (answer.error.empty())
    static_cast<void>(parse_onvif_streams(answer.body, &report_.streams, &answer.error));
  return answer;
}

void OnvifInquiry::find_urls() {
  const OnvifCall& call = is_media2_ ? kGetStreamUri2 : kGetStreamUri;
  bool any_moved = false;
  for (VideoStream& stream : report_.streams) {
    const Answer answer =
        ask(media_addresses_.front(), call, onvif_media_content(call, stream.token));
    std::string reported;
    std::string error = answer.error;
    bool moved = false;
    if (error.empty() && parse_onvif_stream_url(answer.body, &reported, &error)) {
      stream.url = usable_stream_url(reported, device_.host, &moved);
      any_moved = any_moved || moved;
      if (stream.url.empty()) error = "'" + shown_url(reported) + "' is no RTSP address";
    }
    if (!error.empty()) {
      report_.notes.push_back("profile " + shown(stream.name) + " has no stream: " + error);
      if (answer.silent || answer.refused) break;
    }
  }
  if (any_moved) {
    report_.notes.push_back("it reports the streams at another address than its own, " +
                            shown(device_.host) + "; they are asked for at its own");
  }
  const auto lost = std::remove_if(report_.streams.begin(), report_.streams.end(),
                                   [](const VideoStream& stream) { return stream.url.empty(); });
  report_.streams.erase(lost, report_.streams.end());
}

DeviceReport OnvifInquiry::run() {
  ask_clock();
  Answer answer = find_services();
  if (!answer.silent && (answer.error.empty() || answer.refused)) {
    const Answer device = ask(device_.bare, kGetDeviceInformation, "");
    std::string ignored;
    if (device.error.empty()) {
      static_cast<void>(parse_onvif_device(device.body, &report_, &ignored));
    }
    if (device.refused) {
      answer = device;
    } else {
      const Answer streams = find_streams();
      if (streams.error.empty()) find_urls();
      answer = streams;
    }
  }
  report_.error = answer.error;
  report_.wants_login = answer.refused;
  if (!login_.user.empty() && !ways_.note().empty()) report_.notes.push_back(ways_.note());
  return report_;
}

}  // namespace

DeviceReport inquire_onvif(const std::string& url, const DeviceLogin& login, double timeout_s) {
  DeviceReport report;
  Url device;
  if (!parse_url(url, &device, &report.error)) return report;
  if (device.path == "/" || device.path.empty()) {
    device.path = "/onvif/device_service";
    device.bare = onvif_address(device, device.path);
  }
  return OnvifInquiry(std::move(device), login, timeout_s).run();
}

std::string usable_stream_url(const std::string& reported, const std::string& host, bool* moved) {
  *moved = false;
  Url url;
  std::string ignored;
  if (!parse_url(reported, &url, &ignored) || (url.scheme != "rtsp" && url.scheme != "rtsps"))
    return "";
  *moved = ::strcasecmp(url.host.c_str(), host.c_str()) != 0;
  // Not onvif_address(): the port is that of the stream.
  return url.scheme + "://" + host + (url.port.empty() ? "" : ":" + url.port) + url.path;
}

}  // namespace alidade
