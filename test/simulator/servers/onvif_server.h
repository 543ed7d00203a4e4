#pragma once
// OnvifServer: an ONVIF camera's device, media and PTZ service on the loopback (cpp-httplib), written from
// the WSDLs and the WS-UsernameToken profile. Its clock may be another than the host's; a token is good
// once, and only if it was made within 5 s of that clock.

#include <httplib.h>

#include <atomic>
#include <functional>
#include <map>
#include <mutex>
#include <set>
#include <string>

#include "test/simulator/servers/digest_check.h"
#include "test/simulator/servers/loopback_http_server.h"

namespace alidade {

struct OnvifDevice {
  enum class Login { kNone, kToken, kDigestMd5, kDigestSha256 };
  Login login = Login::kNone;
  std::string user = "us<er";
  std::string password = "p&ss:\"w";
  bool clock_needs_login = false;  // against the standard
  std::string announced_host =
      "192.168.1.64";  // in the addresses of its services; empty: a path alone
  // Of the PTZ service, whole, as GetCapabilities and GetServices tell it; empty: announced_host's and its path.
  std::string announced_ptz;
  bool knows_capabilities = true;  // else it answers GetServices alone
  bool knows_services = true;
  std::string device_path = "/onvif/device_service";
  std::string ptz_path = "/onvif/ptz";
  std::string media_path = "/onvif/media";
  std::string prefix = "tt:";  // of every element's name; "x:" or "" occur, too
  std::function<std::string()> position = [] {
    return R"(<tt:PanTilt x="0.5" y="-0.25"/><tt:Zoom x="0.125"/>)";
  };
  std::string
      nodes;  // contents of the answers to GetNodes and GetConfigurationOptions; empty: a fault
  std::string options;
  // What the profile with pan and tilt says of its video. stream_url empty: it has none. With
  // media2_path the device has that service, too.
  std::string stream_url;
  std::string encoding = "H264";
  std::string encoder_profile = "Baseline";
  int width = 1280, height = 720, rate_hz = 25, gov_length = 25;
  std::string media2_path;
  bool silent_about_nodes = false;                                       // hangs up
  std::function<std::string()> utc_time = [] { return std::string(); };  // empty: none
};

class OnvifServer {
 public:
  explicit OnvifServer(OnvifDevice device = {}, int port = 0);
  OnvifServer(const OnvifServer&) = delete;
  OnvifServer& operator=(const OnvifServer&) = delete;

  int port() const { return server_.port(); }
  std::string url() const { return server_.url(); }

  std::atomic<double> clock_offset_s{0};  // the device's clock less the host's
  std::atomic<double> told_offset_s{
      0};  // what it tells as UTC less that clock, against the standard
  std::atomic<double> local_offset_s{0};  // what it tells as local time less that clock, if not 0
  std::atomic<bool> password_changed{false};
  // A status other than 200, or a fault's code, for GetStatus.
  std::atomic<int> status{200};
  void set_fault(const std::string& code, const std::string& reason);

  void renew_nonce() { digest_.renew_nonce(); }  // as if it had restarted
  int count(const std::string& call) const;      // answered requests
  std::atomic<int> refusals{0};                  // 401 and NotAuthorized
  std::atomic<int> wrong_logins{0};              // those with a token or credentials
  std::string last_profile() const;
  std::size_t connections() const;

 private:
  void serve(const httplib::Request& request, httplib::Response& response);
  bool token_is_good(const std::string& body);
  std::string answer(const std::string& call, bool second_media) const;
  std::string profiles(bool second_media) const;
  std::string clock_text(const std::string& name, double offset_s) const;
  std::string fault(const std::string& code, const std::string& reason) const;

  OnvifDevice device_;
  DigestCheck digest_;
  mutable std::mutex mutex_;  // guards what follows
  std::set<std::string> nonces_;
  std::map<std::string, int> counts_;
  std::string last_profile_;
  std::string fault_code_;
  std::string fault_reason_;
  std::set<int> client_ports_;
  LoopbackHttpServer server_;  // last: its thread uses the others
};

}  // namespace alidade
