#pragma once
// The words of ONVIF (SOAP 1.2): requests as text, answers as values. Pure: bytes in, value or a
// one-line error out (XML by pugixml, which expands no entities of a document's own); namespace
// prefixes are as the device likes.
//   GetSystemDateAndTime, GetCapabilities   device service
//   GetProfiles                             media service
//   GetStatus                               PTZ service

#include <optional>
#include <string>
#include <string_view>

namespace alidade {

// WS-UsernameToken: Base64(SHA1(nonce + created + password)), created on the device's clock.
struct OnvifLogin {
  std::string user;
  std::string password;
  std::string nonce;         // raw bytes, new for each request
  double created_utc_s = 0;  // Unix time
};

struct OnvifCall {
  const char* service;  // namespace of the request
  const char* name;     // GetStatus
};

constexpr const char* kOnvifDevice = "http://www.onvif.org/ver10/device/wsdl";
constexpr const char* kOnvifMedia = "http://www.onvif.org/ver10/media/wsdl";
constexpr const char* kOnvifPtz = "http://www.onvif.org/ver20/ptz/wsdl";
constexpr OnvifCall kGetSystemDateAndTime{kOnvifDevice, "GetSystemDateAndTime"};
constexpr OnvifCall kGetCapabilities{kOnvifDevice, "GetCapabilities"};
constexpr OnvifCall kGetProfiles{kOnvifMedia, "GetProfiles"};
constexpr OnvifCall kGetStatus{kOnvifPtz, "GetStatus"};

// The envelope with the call. profile: the ProfileToken of GetStatus.
[[nodiscard]] std::string onvif_request(const OnvifCall& call, const std::string& profile,
                                        const std::optional<OnvifLogin>& login);

// "Content-Type: ..." of that envelope.
[[nodiscard]] std::string onvif_content_type(const OnvifCall& call);

struct SoapFault {
  bool not_authorized = false;
  std::string text;  // "ter:NotAuthorized: Sender not authorized"
};

// Empty if the body is no fault.
[[nodiscard]] std::optional<SoapFault> parse_soap_fault(std::string_view body);

// The device's clock as Unix time, in whole seconds.
[[nodiscard]] bool parse_onvif_clock(std::string_view body, double* utc_s, std::string* error);

struct OnvifServices {
  std::string ptz;  // URLs
  std::string media;
};
[[nodiscard]] bool parse_onvif_services(std::string_view body, OnvifServices* services,
                                        std::string* error);

// The token of the first profile that has a PTZ configuration.
[[nodiscard]] bool parse_onvif_profile(std::string_view body, std::string* token,
                                       std::string* error);

struct OnvifStatus {
  enum class Space {
    kGeneric,  // -1..1 over the ranges of the device
    kDegrees
  };
  Space space = Space::kGeneric;
  double pan = 0;   // positive to the right
  double tilt = 0;  // positive upwards
  std::optional<double> zoom;
  std::optional<double> utc_s;  // Unix time
};
[[nodiscard]] bool parse_onvif_status(std::string_view body, OnvifStatus* status,
                                      std::string* error);

// xs:dateTime and Unix time; without a zone, UTC is meant.
[[nodiscard]] std::optional<double> parse_xml_time(std::string_view text);
[[nodiscard]] std::string xml_time(double utc_s);

}  // namespace alidade
