#include "platform/pan_tilt/onvif_messages.h"

#include <openssl/evp.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <pugixml.hpp>

#include "platform/pan_tilt/onvif_time.h"
#include "platform/pan_tilt/onvif_xml.h"
#include "platform/system/shown.h"
#include "platform/system/text.h"

namespace alidade {
namespace {

constexpr std::size_t kShown = 120;  // bytes of foreign text quoted in an error
constexpr const char* kWss = "http://docs.oasis-open.org/wss/2004/01/oasis-200401-wss-";

std::optional<double> attribute(const pugi::xml_node& node, const char* name) {
  return parse_number(trimmed(node.attribute(name).value(), kXmlBlanks));
}

pugi::xml_node load_body(std::string_view bytes, pugi::xml_document* document) {
  if (!document->load_buffer(bytes.data(), bytes.size())) {
    return {};
  }
  return xml_descendant(document->root(), {"Envelope", "Body"});
}

// The element that answers `call`. If it is missing: a null node and *error.
pugi::xml_node load_answer(std::string_view bytes, const OnvifCall& call,
                           pugi::xml_document* document, std::string* error) {
  const pugi::xml_node answer =
      xml_child(load_body(bytes, document), std::string(call.name) + "Response");
  if (!answer) {
    *error = std::string("no answer to ") + call.name + " in '" +
             shown(trimmed(bytes.substr(0, bytes.find('\n')), kXmlBlanks), kShown) +
             "'; is it an ONVIF service?";
  }
  return answer;
}

// A date and time of three numbers each; nullopt: incomplete.
std::optional<double> civil_time(const pugi::xml_node& node) {
  bool whole = true;
  const auto number = [&](const char* part, const char* name) {
    const std::optional<double> value =
        parse_number(trimmed(xml_descendant(node, {part, name}).child_value(), kXmlBlanks));
    whole = whole && value && std::abs(*value) < 1e4;
    return whole ? static_cast<int>(*value) : 0;
  };
  CivilTime civil;
  civil.year = number("Date", "Year");
  civil.month = number("Date", "Month");
  civil.day = number("Date", "Day");
  civil.hour = number("Time", "Hour");
  civil.minute = number("Time", "Minute");
  civil.second = number("Time", "Second");
  return whole ? unix_time(civil) : std::nullopt;
}

// <Min/><Max/>; nullopt unless both are there.
std::optional<OnvifInterval> interval(const pugi::xml_node& node) {
  const auto end = [&node](const char* name) {
    return parse_number(xml_text(xml_child(node, name)));
  };
  const std::optional<double> low = end("Min");
  const std::optional<double> high = end("Max");
  return low && high ? std::optional(OnvifInterval{*low, *high}) : std::nullopt;
}

void add_ranges(const pugi::xml_node& spaces, std::vector<OnvifSpaceRange>* ranges) {
  for (const pugi::xml_node& space : spaces.children()) {
    if (xml_local_name(space.name()) == "AbsolutePanTiltPositionSpace") {
      ranges->push_back({xml_text(xml_child(space, "URI")), interval(xml_child(space, "XRange")),
                         interval(xml_child(space, "YRange"))});
    }
  }
}

// True for the codes of WS-Security and ONVIF that refuse a login.
bool is_of_login(std::string_view code) {
  constexpr std::string_view kCodes[] = {"NotAuthorized",   "FailedAuthentication",
                                         "InvalidSecurity", "InvalidSecurityToken",
                                         "FailedCheck",     "MessageExpired"};
  return std::find(std::begin(kCodes), std::end(kCodes), code) != std::end(kCodes);
}

// Some devices say only in the reason that they refuse a login.
bool names_login(std::string reason) {
  std::transform(reason.begin(), reason.end(), reason.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return reason.find("not authorized") != std::string::npos ||
         reason.find("unauthorized") != std::string::npos ||
         reason.find("authorized time check") != std::string::npos ||
         reason.find("authentication fail") != std::string::npos;
}

// NoProfile, NoPTZProfile, NoStatus, NoEntity, ...: the service understood the request.
bool is_of_a_service(std::string_view code) {
  return code == "InvalidArgVal" ||
         (code.size() > 2 && code.substr(0, 2) == "No" && code[2] >= 'A' && code[2] <= 'Z');
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
         "wssecurity-utility-1.0.xsd\"><w:UsernameToken><w:Username>" + xml_escaped(login.user) +
         "</w:Username><w:Password Type=\"" + wss + "username-token-profile-1.0#PasswordDigest\">" +
         base64({reinterpret_cast<const char*>(digest.data()), size}) +
         "</w:Password><w:Nonce EncodingType=\"" + wss +
         "soap-message-security-1.0#Base64Binary\">" + base64(login.nonce) +
         "</w:Nonce><u:Created>" + created +
         "</u:Created></w:UsernameToken></w:Security></s:Header>";
}

}  // namespace

std::string onvif_request(const OnvifCall& call, const std::string& token,
                          const std::optional<OnvifLogin>& login) {
  const std::string name(call.name);
  std::string content;
  if (name == kGetStatus.name) {
    content = "<ProfileToken>" + xml_escaped(token) + "</ProfileToken>";
  } else if (name == kGetConfigurationOptions.name) {
    content = "<ConfigurationToken>" + xml_escaped(token) + "</ConfigurationToken>";
  } else if (name == kGetCapabilities.name) {
    content = "<Category>All</Category>";
  } else if (name == kGetServices.name) {
    content = "<IncludeCapability>false</IncludeCapability>";
  }
  return onvif_envelope(call, content, login);
}

std::string onvif_envelope(const OnvifCall& call, const std::string& content,
                           const std::optional<OnvifLogin>& login) {
  const std::string name(call.name);
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
  const pugi::xml_node fault = xml_child(load_body(body, &document), "Fault");
  if (!fault) {
    return std::nullopt;
  }
  // The innermost code is the most specific. SOAP 1.1 has faultcode and faultstring instead.
  constexpr int kDepth = 5;
  pugi::xml_node code = xml_child(fault, "Code");
  for (int depth = 0; depth < kDepth && xml_child(code, "Subcode"); ++depth) {
    code = xml_child(code, "Subcode");
  }
  std::string what = xml_text(xml_child(code, "Value"));
  std::string reason = xml_text(xml_descendant(fault, {"Reason", "Text"}));
  what = what.empty() ? xml_text(xml_child(fault, "faultcode")) : what;
  reason = reason.empty() ? xml_text(xml_child(fault, "faultstring")) : reason;
  SoapFault result;
  const std::string_view local = xml_local_name(what.c_str());
  result.not_authorized = is_of_login(local) || names_login(reason);
  result.of_a_service = !result.not_authorized && is_of_a_service(local);
  result.text = shown(what + (reason.empty() ? "" : ": " + reason), kShown);
  return result;
}

bool is_onvif_answer(std::string_view body, const OnvifCall& call) {
  pugi::xml_document document;
  std::string ignored;
  return static_cast<bool>(load_answer(body, call, &document, &ignored));
}

bool parse_onvif_clock(std::string_view body, OnvifClock* clock, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetSystemDateAndTime, &document, error);
  if (!answer) {
    return false;
  }
  const pugi::xml_node told = xml_child(answer, "SystemDateAndTime");
  clock->utc_s = civil_time(xml_child(told, "UTCDateTime"));
  clock->local_s = civil_time(xml_child(told, "LocalDateTime"));
  if (!clock->utc_s && !clock->local_s) {
    *error = "neither UTCDateTime nor LocalDateTime in the answer to GetSystemDateAndTime";
    return false;
  }
  return true;
}

bool parse_onvif_services(std::string_view body, OnvifServices* services, std::string* error) {
  pugi::xml_document document;
  *services = {};
  if (const pugi::xml_node listed = load_answer(body, kGetServices, &document, error)) {
    for (const pugi::xml_node& service : listed.children()) {
      const std::string name = xml_text(xml_child(service, "Namespace"));
      std::string* const address = name == kOnvifPtz     ? &services->ptz
                                   : name == kOnvifMedia ? &services->media
                                                         : nullptr;
      if (address != nullptr) {
        *address = xml_text(xml_child(service, "XAddr"));
      }
    }
  } else if (const pugi::xml_node answer = load_answer(body, kGetCapabilities, &document, error)) {
    const pugi::xml_node capabilities = xml_child(answer, "Capabilities");
    services->ptz = xml_text(xml_descendant(capabilities, {"PTZ", "XAddr"}));
    services->media = xml_text(xml_descendant(capabilities, {"Media", "XAddr"}));
  } else {
    return false;
  }
  if (services->ptz.empty()) {
    *error = "the device names no PTZ service; pan and tilt cannot be asked for by ONVIF";
    return false;
  }
  return true;
}

bool parse_onvif_profile(std::string_view body, OnvifProfile* profile, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetProfiles, &document, error);
  if (!answer) {
    return false;
  }
  for (const pugi::xml_node& candidate : answer.children()) {
    const pugi::xml_node configuration = xml_child(candidate, "PTZConfiguration");
    profile->token = candidate.attribute("token").value();
    if (xml_local_name(candidate.name()) == "Profiles" && !profile->token.empty() &&
        configuration) {
      profile->configuration = configuration.attribute("token").value();
      profile->node = xml_text(xml_child(configuration, "NodeToken"));
      return true;
    }
  }
  *error =
      "none of the device's profiles has a PTZ configuration; add one in the device's settings";
  return false;
}

bool parse_onvif_ranges(std::string_view body, const std::string& node,
                        std::vector<OnvifSpaceRange>* ranges, std::string* error) {
  pugi::xml_document document;
  ranges->clear();
  if (const pugi::xml_node nodes = load_answer(body, kGetNodes, &document, error)) {
    pugi::xml_node mine;
    for (const pugi::xml_node& candidate : nodes.children()) {
      if (!node.empty() && candidate.attribute("token").value() == node) {
        mine = candidate;
      }
    }
    for (const pugi::xml_node& candidate : nodes.children()) {
      if (!mine || candidate == mine) {
        add_ranges(xml_child(candidate, "SupportedPTZSpaces"), ranges);
      }
    }
  } else if (const pugi::xml_node options =
                 load_answer(body, kGetConfigurationOptions, &document, error)) {
    add_ranges(xml_descendant(options, {"PTZConfigurationOptions", "Spaces"}), ranges);
  } else {
    return false;
  }
  if (ranges->empty()) {
    *error = "the device declares no range of absolute pan and tilt";
  }
  return !ranges->empty();
}

bool parse_onvif_status(std::string_view body, OnvifStatus* status, std::string* error) {
  pugi::xml_document document;
  const pugi::xml_node answer = load_answer(body, kGetStatus, &document, error);
  if (!answer) {
    return false;
  }
  const pugi::xml_node whole = xml_child(answer, "PTZStatus");
  const pugi::xml_node pan_tilt = xml_descendant(whole, {"Position", "PanTilt"});
  const std::optional<double> pan = attribute(pan_tilt, "x");
  const std::optional<double> tilt = attribute(pan_tilt, "y");
  if (!pan || !tilt) {
    *error = pan_tilt ? "the position's x or y is not a number"
                      : "the device reports its status without a position";
    return false;
  }
  status->pan = *pan;
  status->tilt = *tilt;
  status->space = pan_tilt.attribute("space").value();
  status->zoom = attribute(xml_descendant(whole, {"Position", "Zoom"}), "x");
  status->utc_s = parse_xml_time(xml_child(whole, "UtcTime").child_value());
  return true;
}

}  // namespace alidade
