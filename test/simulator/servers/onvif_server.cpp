#include "test/simulator/servers/onvif_server.h"

#include <time.h>

#include <cmath>
#include <ctime>
#include <regex>
#include <utility>

namespace alidade {
namespace {

constexpr double kTokenLife_s = 5;

double host_utc_s() {
  timespec now{};
  ::clock_gettime(CLOCK_REALTIME, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// The text of the first element with this local name.
std::string element(const std::string& xml, const std::string& name) {
  std::smatch match;
  const std::regex pattern("<(?:\\w+:)?" + name + "(?:\\s[^>]*)?>([^<]*)<");
  return std::regex_search(xml, match, pattern) ? match[1].str() : std::string();
}

std::string unescaped(std::string text) {
  text = std::regex_replace(text, std::regex("&lt;"), "<");
  text = std::regex_replace(text, std::regex("&gt;"), ">");
  return std::regex_replace(text, std::regex("&amp;"), "&");
}

}  // namespace

OnvifServer::OnvifServer(OnvifDevice device, int port)
    : device_(std::move(device)),
      digest_(device_.user, device_.password,
              device_.login == OnvifDevice::Login::kDigestSha256 ? DigestCheck::Algorithm::kSha256
                                                                 : DigestCheck::Algorithm::kMd5) {
  server_.handlers().Post(".*", [this](const httplib::Request& request,
                                       httplib::Response& response) { serve(request, response); });
  server_.listen(port);
}

void OnvifServer::set_fault(const std::string& code, const std::string& reason) {
  const std::lock_guard<std::mutex> lock(mutex_);
  fault_code_ = code;
  fault_reason_ = reason;
}

int OnvifServer::count(const std::string& call) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = counts_.find(call);
  return found == counts_.end() ? 0 : found->second;
}

std::string OnvifServer::last_profile() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_profile_;
}

std::size_t OnvifServer::connections() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return client_ports_.size();
}

bool OnvifServer::token_is_good(const std::string& body) {
  const std::string nonce = element(body, "Nonce");
  const std::string created = element(body, "Created");
  const std::string password = password_changed ? "another" : device_.password;
  if (unescaped(element(body, "Username")) != device_.user || nonce.empty() ||
      element(body, "Password") != base64(sha1(from_base64(nonce) + created + password)) ||
      body.find("#PasswordDigest\"") == std::string::npos) {
    return false;
  }
  std::tm tm{};
  const char* rest = ::strptime(created.c_str(), "%Y-%m-%dT%H:%M:%S", &tm);
  if (rest == nullptr || created.back() != 'Z') {
    return false;
  }
  const double age_s = host_utc_s() + clock_offset_s - static_cast<double>(::timegm(&tm));
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::abs(age_s) < kTokenLife_s && nonces_.insert(nonce).second;
}

std::string OnvifServer::fault(const std::string& code, const std::string& reason) const {
  return "<env:Body><env:Fault><env:Code><env:Value>env:Sender</"
         "env:Value><env:Subcode><env:Value>" +
         code + "</env:Value></env:Subcode></env:Code><env:Reason><env:Text xml:lang=\"en\">" +
         reason + "</env:Text></env:Reason></env:Fault></env:Body>";
}

std::string OnvifServer::clock_text(const std::string& name, double offset_s) const {
  const auto now = static_cast<std::time_t>(std::floor(host_utc_s() + clock_offset_s + offset_s));
  std::tm tm{};
  ::gmtime_r(&now, &tm);
  const auto number = [](const char* part, int value) {
    return std::string("<tt:") + part + ">" + std::to_string(value) + "</tt:" + part + ">";
  };
  return "<tt:" + name + "><tt:Time>" + number("Hour", tm.tm_hour) + number("Minute", tm.tm_min) +
         number("Second", tm.tm_sec) + "</tt:Time><tt:Date>" + number("Year", tm.tm_year + 1900) +
         number("Month", tm.tm_mon + 1) + number("Day", tm.tm_mday) + "</tt:Date></tt:" + name +
         ">";
}

std::string OnvifServer::profiles(bool second_media) const {
  const auto number = [](const char* name, int value) {
    return std::string("<tt:") + name + ">" + std::to_string(value) + "</tt:" + name + ">";
  };
  const std::string size = "<tt:Resolution>" + number("Width", device_.width) +
                           number("Height", device_.height) + "</tt:Resolution>";
  const std::string rate = "<tt:RateControl>" + number("FrameRateLimit", device_.rate_hz) +
                           number("BitrateLimit", 4096) + "</tt:RateControl>";
  const std::string encoding = "<tt:Encoding>" + device_.encoding + "</tt:Encoding>";
  const std::string ptz = "token=\"p\"><tt:Name>c</tt:Name>";
  std::string video;
  if (!device_.stream_url.empty() && second_media) {
    video = "<tt:VideoEncoder token=\"v\" GovLength=\"" + std::to_string(device_.gov_length) +
            "\" Profile=\"" + device_.encoder_profile + "\">" + encoding + size + rate +
            "</tt:VideoEncoder>";
  } else if (!device_.stream_url.empty()) {
    video = "<tt:VideoEncoderConfiguration token=\"v\">" + encoding + size + rate + "<tt:H264>" +
            number("GovLength", device_.gov_length) + "<tt:H264Profile>" + device_.encoder_profile +
            "</tt:H264Profile></tt:H264></tt:VideoEncoderConfiguration>";
  }
  const std::string turning =
      "<tt:Profiles fixed=\"true\" token=\"turning&amp;1\"><tt:Name>b</tt:Name>";
  return "<tt:Profiles token=\"fixed\"><tt:Name>a</tt:Name></tt:Profiles>" + turning +
         (second_media
              ? "<tt:Configurations>" + video + "<tt:PTZ " + ptz + "</tt:PTZ></tt:Configurations>"
              : video + "<tt:PTZConfiguration " + ptz + "</tt:PTZConfiguration>") +
         "</tt:Profiles>";
}

std::string OnvifServer::answer(const std::string& call, bool second_media) const {
  const std::string base = device_.announced_host.empty() ? "" : "http://" + device_.announced_host;
  const std::string ptz =
      device_.announced_ptz.empty() ? base + device_.ptz_path : device_.announced_ptz;
  std::string content;
  if (call == "GetSystemDateAndTime") {
    content = "<tt:SystemDateAndTime><tt:DateTimeType>NTP</tt:DateTimeType>" +
              clock_text("UTCDateTime", told_offset_s) +
              (local_offset_s != 0 ? clock_text("LocalDateTime", local_offset_s) : "") +
              "</tt:SystemDateAndTime>";
  } else if (call == "GetCapabilities") {
    content = "<tt:Capabilities><tt:Device><tt:XAddr>" + base + device_.device_path +
              "</tt:XAddr></tt:Device><tt:Media><tt:XAddr>" + base + device_.media_path +
              "</tt:XAddr></tt:Media><tt:PTZ><tt:XAddr>" + ptz +
              "</tt:XAddr></tt:PTZ></tt:Capabilities>";
  } else if (call == "GetServices") {
    content =
        "<tt:Service><tt:Namespace>http://www.onvif.org/ver10/media/wsdl</tt:Namespace><tt:XAddr>" +
        base + device_.media_path +
        "</tt:XAddr></tt:Service><tt:Service><tt:Namespace>http://www.onvif.org/ver20/ptz/wsdl"
        "</tt:Namespace><tt:XAddr>" +
        ptz + "</tt:XAddr></tt:Service>" +
        (device_.media2_path.empty()
             ? ""
             : "<tt:Service><tt:Namespace>http://www.onvif.org/ver20/media/wsdl</tt:Namespace>"
               "<tt:XAddr>" +
                   base + device_.media2_path + "</tt:XAddr></tt:Service>");
  } else if (call == "GetDeviceInformation") {
    content =
        "<tt:Manufacturer>Alidade</tt:Manufacturer><tt:Model>Virtual PTZ</tt:Model>"
        "<tt:FirmwareVersion>1</tt:FirmwareVersion>";
  } else if (call == "GetStreamUri") {
    const std::string uri = "<tt:Uri>" + device_.stream_url + "</tt:Uri>";
    content = second_media ? uri : "<tt:MediaUri>" + uri + "</tt:MediaUri>";
  } else if (call == "GetNodes") {
    content = device_.nodes;
  } else if (call == "GetConfigurationOptions") {
    content = device_.options;
  } else if (call == "GetProfiles") {
    content = profiles(second_media);
  } else {
    const std::string utc = device_.utc_time();
    content = "<tt:PTZStatus><tt:Position>" + device_.position() +
              "</tt:Position><tt:MoveStatus><tt:PanTilt>IDLE</tt:PanTilt></tt:MoveStatus>" +
              (utc.empty() ? "" : "<tt:UtcTime>" + utc + "</tt:UtcTime>") + "</tt:PTZStatus>";
  }
  content = "<tt:" + call + "Response>" + content + "</tt:" + call + "Response>";
  content = std::regex_replace(content, std::regex("tt:"), device_.prefix);
  return "<env:Body>" + content + "</env:Body>";
}

void OnvifServer::serve(const httplib::Request& request, httplib::Response& response) {
  using Login = OnvifDevice::Login;
  std::smatch match;
  const std::regex pattern("<(?:\\w+:)?Body[^>]*><(\\w+)");
  const std::string call =
      std::regex_search(request.body, match, pattern) ? match[1].str() : std::string();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    client_ports_.insert(request.remote_port);
  }
  const auto reply = [&](int code, const std::string& body) {
    response.status = code;
    response.set_content(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<env:Envelope "
        "xmlns:env=\"http://www.w3.org/2003/05/soap-envelope\">" +
            body + "</env:Envelope>",
        "application/soap+xml; charset=utf-8");
  };
  const bool open = device_.login == Login::kNone ||
                    (call == "GetSystemDateAndTime" && !device_.clock_needs_login);
  const std::string authorization = request.get_header_value("Authorization");
  if (!open && device_.login == Login::kToken && !token_is_good(request.body)) {
    ++refusals;
    wrong_logins += element(request.body, "Username").empty() ? 0 : 1;
    return reply(400, fault("ter:NotAuthorized", "Sender not authorized"));
  }
  if (!open && device_.login != Login::kToken &&
      (password_changed || !digest_.accepts("POST", request.target, authorization))) {
    ++refusals;
    wrong_logins += authorization.empty() ? 0 : 1;
    response.set_header("WWW-Authenticate", digest_.challenge());
    response.status = 401;
    return;
  }
  const bool of_ptz =
      call == "GetStatus" || call == "GetNodes" || call == "GetConfigurationOptions";
  const bool of_media = call == "GetProfiles" || call == "GetStreamUri";
  const bool second_media =
      of_media && !device_.media2_path.empty() &&
      request.body.find("http://www.onvif.org/ver20/media") != std::string::npos;
  const std::string where = second_media ? device_.media2_path
                            : of_media   ? device_.media_path
                            : of_ptz     ? device_.ptz_path
                                         : device_.device_path;
  if (call == "GetNodes" && device_.silent_about_nodes) {
    response.status = 200;
    response.set_content_provider(
        100'000, "text/xml", [](std::size_t, std::size_t, httplib::DataSink&) { return false; });
    return;
  }
  if (call.empty() || request.target != where ||
      (call == "GetCapabilities" && !device_.knows_capabilities) ||
      (call == "GetServices" && !device_.knows_services) ||
      (call == "GetNodes" && device_.nodes.empty()) ||
      (call == "GetConfigurationOptions" && device_.options.empty())) {
    return reply(400, fault("ter:ActionNotSupported", "not here"));
  }
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++counts_[call];
    if (call == "GetStatus") {
      last_profile_ = unescaped(element(request.body, "ProfileToken"));
      if (!fault_code_.empty()) {
        return reply(500, fault(fault_code_, fault_reason_));
      }
    }
  }
  if (call == "GetStatus" && status != 200) {
    response.status = status;
    response.set_content("<html>busy</html>", "text/html");
    return;
  }
  reply(200, answer(call, second_media));
}

}  // namespace alidade
