#include "platform/pan_tilt/onvif_source.h"

#include <utility>

#include "platform/pan_tilt/device_clock_trial.h"
#include "platform/pan_tilt/onvif_addresses.h"
#include "platform/pan_tilt/onvif_login.h"
#include "platform/pan_tilt/onvif_messages.h"
#include "platform/system/clock.h"
#include "platform/system/random.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxOnvifBody = 256 * 1024;  // bytes; many long profiles

// The candidate addresses of a service, tried one after the other until it answers.
class ServiceSearch {
 public:
  // Once the service was found, its address stays: a failure there is a failure.
  void begin(std::vector<std::string> addresses) {
    if (!found_) {
      addresses_ = std::move(addresses);
      at_ = 0;
    }
    error_.clear();
  }
  [[nodiscard]] const std::string& address() const { return addresses_.at(at_); }
  [[nodiscard]] bool is_first() const { return at_ == 0; }
  void answered() { found_ = true; }
  [[nodiscard]] bool is_found() const { return found_; }

  // The service is not at this address. False: at no other either; *error is then the first error.
  [[nodiscard]] bool next(std::string* error) {
    if (found_) return false;
    if (error_.empty()) error_ = *error;
    if (at_ + 1 < addresses_.size()) {
      ++at_;
      return true;
    }
    *error = error_;
    return false;
  }

 private:
  std::vector<std::string> addresses_;
  std::size_t at_ = 0;
  bool found_ = false;
  std::string error_;
};

class OnvifConversation : public HttpConversation {
 public:
  OnvifConversation(const OnvifSourceOptions& options, std::string user, std::string password,
                    Url device)
      : options_(options),
        user_(std::move(user)),
        password_(std::move(password)),
        device_(std::move(device)),
        scale_({options.pan_range, options.pan_scale}, {options.tilt_range, options.tilt_scale}) {
    reset();
  }

  HttpRequest next_request(double now_s) override;
  Outcome take(const HttpAnswer& answer, PanTiltSample* sample, std::string* error) override;
  Outcome unanswered() override;
  void reset() override;
  [[nodiscard]] std::vector<std::string> notes() const override;

 private:
  enum class Step { kClock, kCapabilities, kServices, kProfile, kStatus, kNodes, kOptions };

  [[nodiscard]] bool asks_ranges() const {
    return step_ == Step::kNodes || step_ == Step::kOptions;
  }
  const OnvifCall& call() const;
  Outcome disconnected() {
    reset();
    return Outcome::kDisconnected;
  }
  Outcome go_on(Step step) {
    step_ = step;
    return Outcome::kAskOn;
  }
  Outcome not_authorized(const std::string& why, const HttpAnswer& answer, std::string* error);
  Outcome not_here(std::string* error);
  Outcome take_clock(const HttpAnswer& answer);
  Outcome take_services(const HttpAnswer& answer, std::string* error);
  Outcome find_services();
  Outcome take_ranges(const HttpAnswer& answer);
  Outcome take_status(const HttpAnswer& answer, PanTiltSample* sample, std::string* error);

  OnvifSourceOptions options_;
  std::string user_;
  std::string password_;
  Url device_;  // URL of the device service

  Step step_ = Step::kClock;
  OnvifLoginWays login_;
  OnvifServices services_;  // as the device reports them
  std::string services_error_;
  ServiceSearch ptz_;
  ServiceSearch media_;
  OnvifProfile profile_;
  bool ranges_asked_ = false;   // since the connection began
  bool ranges_silent_ = false;  // the device does not answer at all when asked for them
  OnvifScale scale_;
  OnvifStatus status_;  // the latest
  DeviceClockTrial trial_;
};

void OnvifConversation::reset() {
  step_ = user_.empty() ? Step::kCapabilities : Step::kClock;
  services_ = {};
  services_error_.clear();
  ranges_asked_ = false;
}

const OnvifCall& OnvifConversation::call() const {
  switch (step_) {
    case Step::kClock:
      return kGetSystemDateAndTime;
    case Step::kCapabilities:
      return kGetCapabilities;
    case Step::kServices:
      return kGetServices;
    case Step::kProfile:
      return kGetProfiles;
    case Step::kNodes:
      return kGetNodes;
    case Step::kOptions:
      return kGetConfigurationOptions;
    case Step::kStatus:
      break;
  }
  return kGetStatus;
}

HttpRequest OnvifConversation::next_request(double now_s) {
  const bool digest = !user_.empty() && login_.way() == OnvifLoginWays::Way::kDigest;
  std::optional<OnvifLogin> login;
  if (!user_.empty() && !digest && step_ != Step::kClock) {
    login.emplace();
    login->user = user_;
    login->password = password_;
    login->created_utc_s = login_.created_utc_s(now_s, utc_now_s());
    login->nonce = random_bytes(kOnvifNonceBytes);
  }
  HttpRequest request;
  request.url = step_ == Step::kProfile                   ? media_.address()
                : step_ == Step::kStatus || asks_ranges() ? ptz_.address()
                                                          : device_.bare;
  request.body = onvif_request(
      call(), step_ == Step::kOptions ? profile_.configuration : profile_.token, login);
  request.headers = {onvif_content_type(call()), "Expect:"};
  request.digest = digest;
  request.body_logs_in = login.has_value();
  return request;
}

HttpConversation::Outcome OnvifConversation::take(const HttpAnswer& answer, PanTiltSample* sample,
                                                  std::string* error) {
  const std::optional<SoapFault> fault = parse_soap_fault(answer.body);
  const bool refused =
      answer.status == 401 || answer.status == 403 || (fault && fault->not_authorized);
  if (asks_ranges()) {
    return take_ranges(answer);
  }
  if (step_ == Step::kClock && !(refused && answer.offers_digest)) {
    return take_clock(answer);
  }
  if (refused) {
    return not_authorized(fault ? fault->text : std::to_string(answer.status), answer, error);
  }
  if (fault) {
    *error = std::string("the device answers ") + call().name + " with '" + fault->text + "'";
    return fault->of_a_service ? disconnected() : not_here(error);
  }
  if (answer.status != 200) {
    *error = "HTTP status " + std::to_string(answer.status) + " for " + call().name;
    return answer.status == 503 ? disconnected() : not_here(error);
  }
  switch (step_) {
    case Step::kCapabilities:
    case Step::kServices:
      return take_services(answer, error);
    case Step::kProfile:
      if (!parse_onvif_profile(answer.body, &profile_, error)) {
        if (!is_onvif_answer(answer.body, call())) return not_here(error);
        if (!services_error_.empty()) *error = services_error_;
        return disconnected();
      }
      media_.answered();
      return go_on(Step::kStatus);
    case Step::kClock:
    case Step::kNodes:
    case Step::kOptions:
    case Step::kStatus:
      break;
  }
  return take_status(answer, sample, error);
}

// HTTP digest is used only if the device offers it, so it is never a wrong login.
HttpConversation::Outcome OnvifConversation::not_authorized(const std::string& why,
                                                            const HttpAnswer& answer,
                                                            std::string* error) {
  const ServiceSearch* const search = step_ == Step::kProfile  ? &media_
                                      : step_ == Step::kStatus ? &ptz_
                                                               : nullptr;
  if (user_.empty()) {
    *error = "the device wants a user and a password (" + why + ")";
    return Outcome::kRefused;
  }
  // An accepted login may fail later because the device's clock was set.
  *error = login_.was_good() ? "the login is refused (" + why + ")"
                             : "wrong user or password (" + why +
                                   "); ONVIF may have users of its own in the device";
  if (search != nullptr && !search->is_first() && !search->is_found()) {
    return not_here(error);  // where there is no service, every login may be refused
  }
  if (login_.refused(answer.offers_digest)) {
    return Outcome::kAskOn;
  }
  *error += answer.only_basic ? std::string("; ") + kOnlyBasic : login_.tried_text();
  return Outcome::kRefused;
}

// No service at this address knows the call.
HttpConversation::Outcome OnvifConversation::not_here(std::string* error) {
  switch (step_) {
    case Step::kCapabilities:
      services_error_ = *error;
      return go_on(Step::kServices);
    case Step::kServices:
      return find_services();
    case Step::kProfile:
      if (media_.next(error)) {
        return Outcome::kAskOn;
      }
      if (!services_error_.empty()) *error = services_error_;
      if (!media_.is_found()) *error += "; a profile can be named as pan_tilt.profile";
      break;
    case Step::kStatus:
      if (ptz_.next(error)) {
        return Outcome::kAskOn;
      }
      if (!services_error_.empty()) *error = services_error_;
      if (!ptz_.is_found() && options_.ptz_path.empty()) {
        *error +=
            "; no PTZ service answers where the device says or at the usual paths; if you know its "
            "path, give it as pan_tilt.ptz_path, with another port as ':PORT/PATH'";
      }
      break;
    case Step::kClock:
    case Step::kNodes:
    case Step::kOptions:
      break;
  }
  return disconnected();
}

HttpConversation::Outcome OnvifConversation::unanswered() {
  std::string ignored;
  if (asks_ranges()) {
    ranges_silent_ = true;
    return go_on(Step::kStatus);
  }
  // It may be a reported port that is not forwarded.
  const std::string own = onvif_address(device_, "/");
  ServiceSearch* const search = step_ == Step::kProfile  ? &media_
                                : step_ == Step::kStatus ? &ptz_
                                                         : nullptr;
  if (search != nullptr && search->address().rfind(own, 0) != 0 && search->next(&ignored)) {
    return Outcome::kAskOn;
  }
  return disconnected();
}

HttpConversation::Outcome OnvifConversation::take_clock(const HttpAnswer& answer) {
  OnvifClock clock;
  std::string ignored;
  const bool told = parse_onvif_clock(answer.body, &clock, &ignored);
  const double age_s = monotonic_now_s() - (answer.earliest_time_s + answer.latest_time_s) / 2;
  login_.set_clock(told ? std::optional(clock) : std::nullopt, monotonic_now_s() - age_s,
                   utc_now_s() - age_s);
  return go_on(Step::kCapabilities);
}

HttpConversation::Outcome OnvifConversation::take_services(const HttpAnswer& answer,
                                                           std::string* error) {
  OnvifServices told;
  const bool names_ptz = parse_onvif_services(answer.body, &told, error);
  if (!names_ptz && !is_onvif_answer(answer.body, call()) && step_ == Step::kCapabilities) {
    return disconnected();  // not ONVIF at all
  }
  services_.media = told.media.empty() ? services_.media : told.media;
  services_.ptz = told.ptz;
  if (!names_ptz) {
    return not_here(error);
  }
  services_error_.clear();
  return find_services();
}

// Candidates: the reported addresses, if any, then the usual ones.
HttpConversation::Outcome OnvifConversation::find_services() {
  ptz_.begin(options_.ptz_path.empty()
                 ? onvif_addresses(device_, services_.ptz, OnvifService::kPtz, user_.empty())
                 : std::vector<std::string>{onvif_address(device_, options_.ptz_path)});
  media_.begin(onvif_addresses(device_, services_.media, OnvifService::kMedia, user_.empty()));
  profile_ = {};
  profile_.token = options_.profile;
  return go_on(profile_.token.empty() ? Step::kProfile : Step::kStatus);
}

// Whatever the answer, the position is asked for again.
HttpConversation::Outcome OnvifConversation::take_ranges(const HttpAnswer& answer) {
  std::vector<OnvifSpaceRange> ranges;
  std::string ignored;
  if (parse_onvif_ranges(answer.body, profile_.node, &ranges, &ignored)) {
    scale_.set_ranges(std::move(ranges));
  } else if (step_ == Step::kNodes && !profile_.configuration.empty()) {
    return go_on(Step::kOptions);
  }
  return go_on(Step::kStatus);
}

HttpConversation::Outcome OnvifConversation::take_status(const HttpAnswer& answer,
                                                         PanTiltSample* sample,
                                                         std::string* error) {
  if (!is_onvif_answer(answer.body, call())) {
    static_cast<void>(parse_onvif_status(answer.body, &status_, error));
    return not_here(error);
  }
  ptz_.answered();
  login_.accepted();
  if (!parse_onvif_status(answer.body, &status_, error)) {
    return disconnected();
  }
  if (scale_.needs_ranges(status_) && !std::exchange(ranges_asked_, true) && !ranges_silent_) {
    return go_on(Step::kNodes);
  }
  switch (scale_.angles(status_, &sample->pan_rad, &sample->tilt_rad, error)) {
    case OnvifScale::Outcome::kOutside:
      return disconnected();
    case OnvifScale::Outcome::kNeedsAngles:
      return Outcome::kFailed;
    case OnvifScale::Outcome::kOk:
      break;
  }
  sample->zoom = status_.zoom;
  switch (trial_.add(status_.utc_s, answer.latest_time_s)) {
    case DeviceClockTrial::Verdict::kOpen:
      return Outcome::kNothing;
    case DeviceClockTrial::Verdict::kUseful:
      sample->device_time_s = status_.utc_s;
      break;
    case DeviceClockTrial::Verdict::kUseless:
      break;
  }
  return Outcome::kSample;
}

std::vector<std::string> OnvifConversation::notes() const {
  std::vector<std::string> notes = {scale_.note(status_)};
  if (!user_.empty()) notes.push_back(login_.note());
  if (options_.ptz_path.empty() && services_.ptz.empty()) {
    notes.push_back("the device names no PTZ service; it is asked at " + shown_url(ptz_.address()));
  } else if (!ptz_.is_first()) {
    notes.push_back("no PTZ service answers where the device says, '" + shown_url(services_.ptz) +
                    "'; it is asked at " + shown_url(ptz_.address()));
  }
  return notes;
}

HttpPollingPlan plan_of(const OnvifSourceOptions& given) {
  HttpPollingPlan plan;
  const HttpDeviceOptions& of_any_device = given;
  static_cast<HttpDeviceOptions&>(plan.options) = of_any_device;
  plan.options.max_body = kMaxOnvifBody;
  plan.options.expected = "an ONVIF answer";
  Url url;
  plan.error = take_http_url(&url, &plan.options);
  if (url.path == "/") {
    url.path = "/onvif/device_service";
    url.bare.pop_back();
    url.bare += url.path;
  }
  plan.conversation = std::make_unique<OnvifConversation>(given, plan.options.user,
                                                          plan.options.password, std::move(url));
  return plan;
}

}  // namespace

std::unique_ptr<PanTiltSource> open_onvif(const OnvifSourceOptions& options) {
  return open_http_polling(plan_of(options));
}

}  // namespace alidade
