#include "platform/pan_tilt/onvif_source.h"

#include <random>
#include <utility>

#include "platform/pan_tilt/device_clock_trial.h"
#include "platform/pan_tilt/onvif_messages.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxBody = 256 * 1024;  // bytes; many long profiles
constexpr std::size_t kNonceBytes = 16;

double mapped(double value, const OnvifRange& range) {
  return range.at_minus_one_rad +
         (value + 1) / 2 * (range.at_plus_one_rad - range.at_minus_one_rad);
}

// Where a service that calls itself `told` is reached, coming from `device`.
std::string service_url(const Url& device, const std::string& told) {
  Url url;
  std::string error;
  if (!parse_url(told, &url, &error)) {
    url.path = told.empty() || told[0] != '/' ? "/" + told : told;
  } else if (url.host == device.host && url.scheme == device.scheme) {
    return url.bare;
  }
  return device.scheme + "://" + device.host + (device.port.empty() ? "" : ":" + device.port) +
         url.path;
}

class OnvifConversation : public HttpConversation {
 public:
  OnvifConversation(const OnvifSourceOptions& options, std::string user, std::string password,
                    Url device)
      : options_(options),
        user_(std::move(user)),
        password_(std::move(password)),
        device_(std::move(device)) {
    reset();
  }

  HttpRequest next_request(double now_s) override;
  Outcome take(const HttpAnswer& answer, PanTiltSample* sample, std::string* error) override;
  void reset() override { step_ = user_.empty() ? Step::kServices : Step::kClock; }

 private:
  enum class Step { kClock, kServices, kProfile, kStatus };

  const OnvifCall& call() const;
  Outcome disconnected() {
    reset();
    return Outcome::kDisconnected;
  }
  Outcome not_authorized(const std::string& why, std::string* error) const;
  Outcome take_clock(const HttpAnswer& answer);
  Outcome take_status(const HttpAnswer& answer, PanTiltSample* sample, std::string* error);

  OnvifSourceOptions options_;
  std::string user_;
  std::string password_;
  Url device_;  // address of the device service
  std::random_device random_;

  Step step_ = Step::kClock;
  bool digest_ = false;                        // log in by HTTP digest, not by a token
  std::optional<double> device_minus_host_s_;  // the device's Unix time less the host's monotonic
  OnvifServices services_;
  std::string profile_;
  DeviceClockTrial trial_;
};

const OnvifCall& OnvifConversation::call() const {
  switch (step_) {
    case Step::kClock:
      return kGetSystemDateAndTime;
    case Step::kServices:
      return kGetCapabilities;
    case Step::kProfile:
      return kGetProfiles;
    case Step::kStatus:
      break;
  }
  return kGetStatus;
}

HttpRequest OnvifConversation::next_request(double now_s) {
  std::optional<OnvifLogin> login;
  if (!user_.empty() && !digest_ && step_ != Step::kClock) {
    login.emplace();
    login->user = user_;
    login->password = password_;
    login->created_utc_s = device_minus_host_s_ ? now_s + *device_minus_host_s_ : utc_now_s();
    std::uniform_int_distribution<int> byte(0, 255);
    for (std::size_t i = 0; i < kNonceBytes; ++i) {
      login->nonce += static_cast<char>(byte(random_));
    }
  }
  HttpRequest request;
  request.url = step_ == Step::kStatus    ? service_url(device_, services_.ptz)
                : step_ == Step::kProfile ? service_url(device_, services_.media)
                                          : device_.bare;
  request.body = onvif_request(call(), profile_, login);
  request.headers = {onvif_content_type(call()), "Expect:"};
  request.digest = digest_;
  return request;
}

HttpConversation::Outcome OnvifConversation::take(const HttpAnswer& answer, PanTiltSample* sample,
                                                  std::string* error) {
  const std::optional<SoapFault> fault = parse_soap_fault(answer.body);
  if (answer.status == 401 || (fault && fault->not_authorized)) {
    if (!user_.empty() && !digest_ && answer.offers_digest) {
      digest_ = true;
      return Outcome::kAskOn;
    }
    if (step_ != Step::kClock) {
      return not_authorized(fault ? fault->text : "401", error);
    }
  }
  if (step_ == Step::kClock) {
    return take_clock(answer);
  }
  if (fault) {
    *error = std::string("the device answers ") + call().name + " with '" + fault->text + "'";
    return disconnected();
  }
  if (answer.status != 200) {
    *error = "HTTP status " + std::to_string(answer.status) + " for " + call().name;
    return disconnected();
  }
  switch (step_) {
    case Step::kServices:
      if (!parse_onvif_services(answer.body, &services_, error)) {
        return disconnected();
      }
      profile_ = options_.profile;
      step_ = profile_.empty() ? Step::kProfile : Step::kStatus;
      return Outcome::kAskOn;
    case Step::kProfile:
      if (!parse_onvif_profile(answer.body, &profile_, error)) {
        return disconnected();
      }
      step_ = Step::kStatus;
      return Outcome::kAskOn;
    case Step::kClock:
    case Step::kStatus:
      break;
  }
  return take_status(answer, sample, error);
}

HttpConversation::Outcome OnvifConversation::not_authorized(const std::string& why,
                                                            std::string* error) const {
  *error = user_.empty() ? "the device wants a user and a password (" + why + ")"
                         : "wrong user or password (" + why +
                               "); ONVIF may have users of its own in the device";
  return Outcome::kFailed;
}

// A device that does not tell its clock, or not before the login, has the host's: the best guess.
HttpConversation::Outcome OnvifConversation::take_clock(const HttpAnswer& answer) {
  double utc_s = 0;
  std::string ignored;
  device_minus_host_s_.reset();
  if (parse_onvif_clock(answer.body, &utc_s, &ignored)) {
    device_minus_host_s_ = utc_s - (answer.earliest_time_s + answer.latest_time_s) / 2;
  }
  step_ = Step::kServices;
  return Outcome::kAskOn;
}

HttpConversation::Outcome OnvifConversation::take_status(const HttpAnswer& answer,
                                                         PanTiltSample* sample,
                                                         std::string* error) {
  OnvifStatus status;
  if (!parse_onvif_status(answer.body, &status, error)) {
    return disconnected();
  }
  if (status.space == OnvifStatus::Space::kDegrees) {
    sample->pan_rad = kRadPerDeg * status.pan;
    sample->tilt_rad = kRadPerDeg * status.tilt;
  } else if (options_.pan_range && options_.tilt_range) {
    sample->pan_rad = mapped(status.pan, *options_.pan_range);
    sample->tilt_rad = mapped(status.tilt, *options_.tilt_range);
  } else {
    *error =
        "the device tells pan and tilt as -1..1, not in degrees; give the angles at -1 and 1, from "
        "its data sheet, as pan_range_deg and tilt_range_deg";
    return Outcome::kFailed;
  }
  sample->zoom = status.zoom;
  switch (trial_.add(status.utc_s, answer.latest_time_s)) {
    case DeviceClockTrial::Verdict::kOpen:
      return Outcome::kNothing;
    case DeviceClockTrial::Verdict::kUseful:
      sample->device_time_s = status.utc_s;
      break;
    case DeviceClockTrial::Verdict::kUseless:
      break;
  }
  return Outcome::kSample;
}

HttpPollingPlan plan_of(const OnvifSourceOptions& given) {
  HttpPollingPlan plan;
  const HttpDeviceOptions& of_any_device = given;
  static_cast<HttpDeviceOptions&>(plan.options) = of_any_device;
  plan.options.max_body = kMaxBody;
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
