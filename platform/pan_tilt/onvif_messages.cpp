#include "platform/pan_tilt/onvif_messages.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <pugixml.hpp>

#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr std::string_view kXmlBlanks = " \t\r\n";

constexpr std::size_t kShown = 120;  // bytes of a foreign text that an error repeats
constexpr const char* kWss = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss-";

// --- text

std::string escaped(std::string_view text) {
  std::string xml;
  for (const char c : text) {
    switch (c) {
      case '&':
        xml += "&amp;";
        break;
      case '<':
        xml += "&lt;";
        break;
      case '>':
        xml += "&gt;";
        break;
      default:
        xml += c;
    }
  }
  return xml;
}

// Exactly `digits` decimal digits at the front of *text, which are taken off.
std::optional<int> take_digits(std::string_view* text, std::size_t digits) {
  if (text->size() < digits) {
    return std::nullopt;
  }
  int value = 0;
  for (const char c : text->substr(0, digits)) {
    if (c < '0' || c > '9') {
      return std::nullopt;
    }
    value = 10 * value + (c - '0');
  }
  text->remove_prefix(digits);
  return value;
}

bool take_character(std::string_view* text, char c) {
  if (text->empty() || text->front() != c) {
    return false;
  }
  text->remove_prefix(1);
  return true;
}

// --- time

// Days from 1970-01-01 of the Gregorian calendar, by counting years from 1 March.
std::int64_t days_from_civil(int year, int month, int day) {
  const int y = month <= 2 ? year - 1 : year;
  const int month_from_march = (month + 9) % 12;
  const int day_of_year = (153 * month_from_march + 2) / 5 + day - 1;
  return std::int64_t{365} * y + y / 4 - y / 100 + y / 400 + day_of_year - 719468;
}

struct Civil {
  int year = 0;
  int month = 0;
  int day = 0;
  int hour = 0;
  int minute = 0;
  int second = 0;
};

std::optional<double> unix_time(const Civil& civil) {
  const auto within = [](int value, int low, int high) { return value >= low && value <= high; };
  if (!within(civil.year, 1900, 9999) || !within(civil.month, 1, 12) || !within(civil.day, 1, 31) ||
      !within(civil.hour, 0, 24) || !within(civil.minute, 0, 59) || !within(civil.second, 0, 60)) {
    return std::nullopt;
  }
  const std::int64_t days = days_from_civil(civil.year, civil.month, civil.day);
  return static_cast<double>(((days * 24 + civil.hour) * 60 + civil.minute) * 60 + civil.second);
}

// --- XML

std::string_view local_name(const char* name) {
  const std::string_view text(name);
  const std::size_t colon = text.find(':');
  return colon == std::string_view::npos ? text : text.substr(colon + 1);
}

pugi::xml_node child(const pugi::xml_node& node, std::string_view name) {
  return node.find_child(
      [name](const pugi::xml_node& candidate) { return local_name(candidate.name()) == name; });
}

pugi::xml_node descendant(pugi::xml_node node, std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    node = child(node, name);
  }
  return node;
}

std::string text_of(const pugi::xml_node& node) {
  return std::string(trimmed(node.child_value(), kXmlBlanks));
}

std::optional<double> attribute(const pugi::xml_node& node, const char* name) {
  return parse_number(trimmed(node.attribute(name).value(), kXmlBlanks));
}

pugi::xml_node load_body(std::string_view bytes, pugi::xml_document* document) {
  if (!document->load_buffer(bytes.data(), bytes.size())) {
    return {};
  }
  return descendant(document->root(), {"Envelope", "Body"});
}

// The element that answers `call`; a null node with *error if it is not there.
pugi::xml_node load_answer(std::string_view bytes, const OnvifCall& call,
                           pugi::xml_document* document, std::string* error) {
  const pugi::xml_node answer =
      child(load_body(bytes, document), std::string(call.name) + "Response");
  if (!answer) {
    *error = std::string("no answer to ") + call.name + " in '" +
             shown(trimmed(bytes.substr(0, bytes.find('\n')), kXmlBlanks), kShown) +
             "'; is it an ONVIF service?";
  }
  return answer;
}

std::string base64(std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                   reinterpret_cast<const unsigned char*>(bytes.data()),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::string security_header(const OnvifLogin& login) {
  const std::string created = xml_time(login.created_utc_s);
  const std::string secret = login.nonce + created + login.password;
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned size = 0;
  EVP_Digest(secret.data(), secret.size(), digest.data(), &size, EVP_sha1(), nullptr);
  const std::string wss(kWss);
  return "<s:Header><w:Security s:mustUnderstand=\"1\" xmlns:w=\"" + wss +
         "wssecurity-secext-1.0.xsd\" xmlns:u=\"" + wss +
         "wssecurity-utility-1.0.xsd\"><w:UsernameToken><w:Username>" + escaped(login.user) +
         "</w:Username><w:Password Type=\"" + wss + "username-token-profile-1.0#PasswordDigest\">" +
         base64({reinterpret_cast<const char*>(digest.data()), size}) +
         "</w:Password><w:Nonce EncodingType=\"" + wss +
         "soap-message-security-1.0#Base64Binary\">" + base64(login.nonce) +
         "</w:Nonce><u:Created>" + created +
         "</u:Created></w:UsernameToken></w:Security></s:Header>";
}

}  // namespace

std::optional<double> parse_xml_time(std::string_view text) {
  text = trimmed(text, kXmlBlanks);
  Civil civil;
  const auto field = [&text](int* value, std::size_t digits, char before) {
    if (before != '\0' && !take_character(&text, before)) {
      return false;
    }
    const std::optional<int> taken = take_digits(&text, digits);
    *value = taken.value_or(0);
    return taken.has_value();
  };
  if (!field(&civil.year, 4, '\0') || !field(&civil.month, 2, '-') || !field(&civil.day, 2, '-') ||
      !field(&civil.hour, 2, 'T') || !field(&civil.minute, 2, ':') ||
      !field(&civil.second, 2, ':')) {
    return std::nullopt;
  }
  std::optional<double> time_s = unix_time(civil);
  if (!time_s) {
    return std::nullopt;
  }
  if (take_character(&text, '.')) {
    double unit = 0.1;
    std::size_t digits = 0;
    for (std::optional<int> digit; (digit = take_digits(&text, 1)); ++digits, unit /= 10) {
      *time_s += unit * *digit;
    }
    if (digits == 0) {
      return std::nullopt;
    }
  }
  if (text.empty() || text == "Z") {
    return time_s;
  }
  const int sign = take_character(&text, '+') ? 1 : take_character(&text, '-') ? -1 : 0;
  int hours = 0;
  int minutes = 0;
  if (sign == 0 || !field(&hours, 2, '\0') || !field(&minutes, 2, ':') || !text.empty()) {
    return std::nullopt;
  }
  return *time_s - sign * (3600.0 * hours + 60.0 * minutes);
}

std::string xml_time(double utc_s) {
  // 0 to the year 9999.
  const auto milliseconds =
      static_cast<std::int64_t>(std::llround(1e3 * std::clamp(utc_s, 0.0, 253402300799.0)));
  const std::int64_t seconds = milliseconds / 1000;
  const std::int64_t days = seconds / 86400;
  int year = 1970 + static_cast<int>(days / 366);
  while (days_from_civil(year + 1, 1, 1) <= days) {
    ++year;
  }
  int month = 1;
  while (month < 12 && days_from_civil(year, month + 1, 1) <= days) {
    ++month;
  }
  const auto day = static_cast<int>(days - days_from_civil(year, month, 1)) + 1;
  const auto of_day = static_cast<int>(seconds % 86400);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02d-%02dT%02d:%02d:%02d.%03dZ", year, month, day,
                of_day / 3600, of_day / 60 % 60, of_day % 60,
                static_cast<int>(milliseconds % 1000));
  return text.data();
}

std::string onvif_request(const OnvifCall& call, const std::string& profile,
                          const std::optional<OnvifLogin>& login) {
  const std::string name(call.name);
  const std::string content = name == kGetStatus.name
                                  ? "<ProfileToken>" + escaped(profile) + "</ProfileToken>"
                              : name == kGetCapabilities.name ? "<Category>All</Category>"
                                                              : "";
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>"
         "<s:Envelope xmlns:s=\"http://www.w3.org/2003/05/soap-envelope\">" +
         (login ? security_header(*login) : std::string()) + "<s:Body><" + name + " xmlns=\"" +
         call.service + "\">" + content + "</" + name + "></s:Body></s:Envelope>";
}

std::string onvif_content_type(const OnvifCall& call) {
  return std::string("Content-Type: application/soap+xml; charset=utf-8; action=\"") +
         call.service + "/" + call.name + "\"";
}

std::optional<SoapFault> parse_soap_fault(std::string_view body) {
  pugi::xml_document document;
  const pugi::xml_node fault = child(load_body(body, &document), "Fault");
  if (!fault) {
    return std::nullopt;
  }
  // The innermost code says most. SOAP 1.1 has faultcode and faultstring in place of all that.
  constexpr int kDepth = 5;
  pugi::xml_node code = child(fault, "Code");
  for (int depth = 0; depth < kDepth && child(code, "Subcode"); ++depth) {
    code = child(code, "Subcode");
  }
  std::string what = text_of(child(code, "Value"));
  std::string reason = text_of(descendant(fault, {"Reason", "Text"}));
  what = what.empty() ? text_of(child(fault, "faultcode")) : what;
  reason = reason.empty() ? text_of(child(fault, "faultstring")) : reason;
  SoapFault result;
  const std::string_view local = local_name(what.c_str());
  result.not_authorized = local == "NotAuthorized" || local == "FailedAuthentication";
  result.text = shown(what + (reason.empty() ? "" : ": " + reason), kShown);
  return result;
}

bool parse_onvif_clock(std::string_view body, double* utc_s, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetSystemDateAndTime, &document, error);
  if (!answer) {
    return false;
  }
  const pugi::xml_node utc = descendant(answer, {"SystemDateAndTime", "UTCDateTime"});
  bool whole = true;
  const auto number = [&](const char* part, const char* name) {
    const std::optional<double> value =
        parse_number(trimmed(descendant(utc, {part, name}).child_value(), kXmlBlanks));
    whole = whole && value && std::abs(*value) < 1e4;
    return whole ? static_cast<int>(*value) : 0;
  };
  Civil civil;
  civil.year = number("Date", "Year");
  civil.month = number("Date", "Month");
  civil.day = number("Date", "Day");
  civil.hour = number("Time", "Hour");
  civil.minute = number("Time", "Minute");
  civil.second = number("Time", "Second");
  const std::optional<double> time_s = whole ? unix_time(civil) : std::nullopt;
  if (!time_s) {
    *error = "no UTCDateTime in the answer to GetSystemDateAndTime";
    return false;
  }
  *utc_s = *time_s;
  return true;
}

bool parse_onvif_services(std::string_view body, OnvifServices* services, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetCapabilities, &document, error);
  if (!answer) {
    return false;
  }
  const pugi::xml_node capabilities = child(answer, "Capabilities");
  services->ptz = text_of(descendant(capabilities, {"PTZ", "XAddr"}));
  services->media = text_of(descendant(capabilities, {"Media", "XAddr"}));
  if (services->ptz.empty()) {
    *error = "the device names no PTZ service; pan and tilt cannot be asked for by ONVIF";
    return false;
  }
  return true;
}

bool parse_onvif_profile(std::string_view body, std::string* token, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetProfiles, &document, error);
  if (!answer) {
    return false;
  }
  for (const pugi::xml_node& profile : answer.children()) {
    *token = profile.attribute("token").value();
    if (local_name(profile.name()) == "Profiles" && !token->empty() &&
        child(profile, "PTZConfiguration")) {
      return true;
    }
  }
  *error =
      "none of the device's profiles has a PTZ configuration; add one in the device's settings";
  return false;
}

bool parse_onvif_status(std::string_view body, OnvifStatus* status, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetStatus, &document, error);
  if (!answer) {
    return false;
  }
  const pugi::xml_node whole = child(answer, "PTZStatus");
  const pugi::xml_node pan_tilt = descendant(whole, {"Position", "PanTilt"});
  const std::optional<double> pan = attribute(pan_tilt, "x");
  const std::optional<double> tilt = attribute(pan_tilt, "y");
  if (!pan || !tilt) {
    *error = pan_tilt ? "the position's x or y is not a number"
                      : "the device tells its status without a position";
    return false;
  }
  const std::string space = pan_tilt.attribute("space").value();
  const std::string_view short_space = std::string_view(space).substr(space.rfind('/') + 1);
  double limit = 1.01;  // rounding beyond 1 is not rare
  if (space.empty() || short_space == "PositionGenericSpace") {
    status->space = OnvifStatus::Space::kGeneric;
  } else if (short_space == "SphericalPositionSpaceDegrees") {
    status->space = OnvifStatus::Space::kDegrees;
    limit = 360;
  } else {
    *error = "the position is in the space '" + shown(space, kShown) +
             "'; known are PositionGenericSpace and SphericalPositionSpaceDegrees";
    return false;
  }
  if (std::abs(*pan) > limit || std::abs(*tilt) > limit) {
    *error = "the position " + shown(*pan) + ", " + shown(*tilt) + " is outside its space";
    return false;
  }
  status->pan = *pan;
  status->tilt = *tilt;
  status->zoom = attribute(descendant(whole, {"Position", "Zoom"}), "x");
  status->utc_s = parse_xml_time(child(whole, "UtcTime").child_value());
  return true;
}

}  // namespace alidade
