#pragma once
// ONVIF messages (SOAP 1.2): requests as text, answers as values. No side effects: bytes in, value
// or a one-line error out. XML is parsed by pugixml, which expands no entities that a document
// defines. Namespace prefixes may be any.
//   GetSystemDateAndTime, GetCapabilities, GetServices   device service
//   GetProfiles                                          media service
//   GetStatus, GetNodes, GetConfigurationOptions         PTZ service

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace alidade {

inline constexpr std::size_t kOnvifNonceBytes = 16;

// WS-UsernameToken: Base64(SHA1(nonce + created + password)), created on the device's clock.
struct OnvifLogin {
  std::string user;
  std::string password;
  std::string nonce;         // kOnvifNonceBytes raw bytes, new for each request
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
constexpr OnvifCall kGetServices{kOnvifDevice, "GetServices"};
constexpr OnvifCall kGetProfiles{kOnvifMedia, "GetProfiles"};
constexpr OnvifCall kGetStatus{kOnvifPtz, "GetStatus"};
constexpr OnvifCall kGetNodes{kOnvifPtz, "GetNodes"};
constexpr OnvifCall kGetConfigurationOptions{kOnvifPtz, "GetConfigurationOptions"};

// The envelope with the call. token: the ProfileToken of GetStatus or the ConfigurationToken of
// GetConfigurationOptions; the other calls have none.
[[nodiscard]] std::string onvif_request(const OnvifCall& call, const std::string& token,
                                        const std::optional<OnvifLogin>& login);

// The same for any call; content: the XML inside its element.
[[nodiscard]] std::string onvif_envelope(const OnvifCall& call, const std::string& content,
                                         const std::optional<OnvifLogin>& login);

// "Content-Type: ..." of this envelope.
[[nodiscard]] std::string onvif_content_type(const OnvifCall& call);

struct SoapFault {
  bool not_authorized = false;
  // The right service answered; a profile is missing or an argument is wrong.
  bool of_a_service = false;
  std::string text;  // "ter:NotAuthorized: Sender not authorized"
};

// nullopt if the body is not a fault.
[[nodiscard]] std::optional<SoapFault> parse_soap_fault(std::string_view body);

// True if the body is an answer to the call, whatever its content.
[[nodiscard]] bool is_onvif_answer(std::string_view body, const OnvifCall& call);

// The device's clock, in whole seconds. At least one member is set.
struct OnvifClock {
  std::optional<double> utc_s;    // Unix time
  std::optional<double> local_s;  // local date and time, read as if it were UTC
};
[[nodiscard]] bool parse_onvif_clock(std::string_view body, OnvifClock* clock, std::string* error);

// URLs as the device reports them; empty: none.
struct OnvifServices {
  std::string ptz;
  std::string media;
};
// Parses the answer to GetCapabilities or GetServices. False: it names no PTZ service (`media` may
// be set), or is no such answer (*services is empty).
[[nodiscard]] bool parse_onvif_services(std::string_view body, OnvifServices* services,
                                        std::string* error);

// Tokens of the first profile that has a token and a PTZ configuration. configuration and node may
// be empty.
struct OnvifProfile {
  std::string token;
  std::string configuration;
  std::string node;
};
// On false *profile is undefined.
[[nodiscard]] bool parse_onvif_profile(std::string_view body, OnvifProfile* profile,
                                       std::string* error);

// Lowest and highest value of an axis, in device units. As declared: low may exceed high.
struct OnvifInterval {
  double low = 0;
  double high = 0;
};

// The range of absolute pan and tilt that a device declares for a space.
struct OnvifSpaceRange {
  std::string space;                 // URI
  std::optional<OnvifInterval> pan;  // nullopt: not declared, or incomplete
  std::optional<OnvifInterval> tilt;
};
// Parses the answer to GetNodes or GetConfigurationOptions. node: token of the node whose spaces
// are taken; if it is empty, or the answer lacks the node, all nodes' are. False: no space of
// absolute pan and tilt is declared, or this is no such answer; *ranges is then empty.
[[nodiscard]] bool parse_onvif_ranges(std::string_view body, const std::string& node,
                                      std::vector<OnvifSpaceRange>* ranges, std::string* error);

// The position in the device's own units.
struct OnvifStatus {
  double pan = 0;
  double tilt = 0;
  std::string space;            // URI of pan and tilt; empty: none is named
  std::optional<double> zoom;   // device units
  std::optional<double> utc_s;  // Unix time; nullopt: none, or not an xs:dateTime
};
// False: no answer to GetStatus, or one without a position; *status is unchanged.
[[nodiscard]] bool parse_onvif_status(std::string_view body, OnvifStatus* status,
                                      std::string* error);

}  // namespace alidade
