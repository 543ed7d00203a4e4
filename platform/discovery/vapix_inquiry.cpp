#include "platform/discovery/vapix_inquiry.h"

#include "platform/discovery/http_question.h"
#include "platform/discovery/vapix_parameters.h"
#include "platform/system/url.h"

namespace alidade {

DeviceReport inquire_vapix(const std::string& url, const DeviceLogin& login, double timeout_s) {
  DeviceReport report;
  Url device;
  if (!parse_url(url, &device, &report.error)) return report;
  HttpQuestion question;
  question.url = device.scheme + "://" + device.host +
                 (device.port.empty() ? "" : ":" + device.port) +
                 "/axis-cgi/param.cgi?action=list&group=" + kVapixGroups;
  question.user = login.user;
  question.password = login.password;
  question.rules = login.rules;
  question.timeout_s = timeout_s;
  const HttpReply reply = ask_http(question);
  if (reply.status == 200) {
    static_cast<void>(parse_vapix_parameters(reply.body, device.host, &report, &report.error));
  } else {
    report.wants_login = reply.status == 401 || reply.status == 403;
    report.error = reply.status == 403    ? "the user may not read the device's parameters (403); "
                                            "give it the right of an operator"
                   : !reply.error.empty() ? reply.error
                                          : "HTTP status " + std::to_string(reply.status) +
                                                " for param.cgi; is it an Axis device?";
  }
  return report;
}

}  // namespace alidade
