#include "platform/pan_tilt/vapix_source.h"

#include <utility>

#include "platform/pan_tilt/vapix_answer.h"

namespace alidade {
namespace {

constexpr std::size_t kMaxVapixBody = 4096;  // bytes; a position has about 100

class VapixConversation : public HttpConversation {
 public:
  explicit VapixConversation(std::string url) : url_(std::move(url)) {}

  HttpRequest next_request(double /*now_s*/) override {
    HttpRequest request;
    request.url = url_;
    return request;
  }

  Outcome take(const HttpAnswer& answer, PanTiltSample* sample, std::string* error) override {
    if (answer.status == 401) {
      *error = answer.login_error;
      return Outcome::kRefused;
    }
    if (answer.status != 200) {
      *error = "HTTP status " + std::to_string(answer.status) + " for /axis-cgi/com/ptz.cgi";
      return Outcome::kDisconnected;
    }
    VapixPosition position;
    if (!parse_vapix_position(answer.body, &position, error)) {
      return Outcome::kDisconnected;
    }
    sample->pan_rad = position.pan_rad;
    sample->tilt_rad = position.tilt_rad;
    sample->zoom = position.zoom;
    return Outcome::kSample;
  }

  void reset() override {}

 private:
  std::string url_;
};

std::string position_url(const Url& url, int camera) {
  const std::string base = !url.bare.empty() && url.bare.back() == '/'
                               ? url.bare.substr(0, url.bare.size() - 1)
                               : url.bare;
  return base + "/axis-cgi/com/ptz.cgi?query=position" +
         (camera > 0 ? "&camera=" + std::to_string(camera) : "");
}

HttpPollingPlan plan_of(const VapixSourceOptions& given) {
  HttpPollingPlan plan;
  const HttpDeviceOptions& of_any_device = given;
  static_cast<HttpDeviceOptions&>(plan.options) = of_any_device;
  plan.options.max_body = kMaxVapixBody;
  plan.options.expected = "a camera's position";
  Url url;
  plan.error = take_http_url(&url, &plan.options);
  if (plan.error.empty() && url.path != "/") {
    plan.error = "the URL must be http://host[:port] or https://host[:port], without a path";
  }
  plan.conversation = std::make_unique<VapixConversation>(position_url(url, given.camera));
  return plan;
}

}  // namespace

std::unique_ptr<PanTiltSource> open_vapix(const VapixSourceOptions& options) {
  return open_http_polling(plan_of(options));
}

}  // namespace alidade
