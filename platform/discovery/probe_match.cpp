#include "platform/discovery/probe_match.h"

#include <strings.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>

#include "platform/pan_tilt/onvif_xml.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

// Of one answer. Devices need a few of each.
constexpr std::size_t kMostMatches = 16;
constexpr std::size_t kMostWords = 64;  // types, scopes or addresses
constexpr std::size_t kMostWordBytes = 256;
constexpr std::size_t kUuidChars = 36;

constexpr std::string_view kScope = "onvif://www.onvif.org/";

// The words of a list that XML separates by blanks. Longer words are left out: what was cut off
// would be another address.
std::vector<std::string> words_of(std::string_view text) {
  std::vector<std::string> words;
  while (words.size() < kMostWords) {
    const std::size_t begin = text.find_first_not_of(kXmlBlanks);
    if (begin == std::string_view::npos) break;
    text.remove_prefix(begin);
    const std::string_view word = text.substr(0, text.find_first_of(kXmlBlanks));
    if (word.size() <= kMostWordBytes) words.emplace_back(word);
    text.remove_prefix(word.size());
  }
  return words;
}

// %20 is a blank, and so on.
std::string decoded(std::string_view text) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto is_digit = [&](std::size_t at) {
      return at < text.size() && std::isxdigit(static_cast<unsigned char>(text[at])) != 0;
    };
    if (text[i] == '%' && is_digit(i + 1) && is_digit(i + 2)) {
      plain +=
          static_cast<char>(std::strtol(std::string(text.substr(i + 1, 2)).c_str(), nullptr, 16));
      i += 2;
    } else {
      plain += text[i];
    }
  }
  return plain;
}

bool starts_with(std::string_view text, std::string_view beginning) {
  return text.size() >= beginning.size() &&
         ::strncasecmp(text.data(), beginning.data(), beginning.size()) == 0;
}

// Devices write an identifier as uuid:..., urn:uuid:... or bare, in any case.
bool is_same_message(std::string_view a, std::string_view b) {
  if (a.size() < kUuidChars || b.size() < kUuidChars) return false;
  return starts_with(a.substr(a.size() - kUuidChars), b.substr(b.size() - kUuidChars));
}

ProbeMatch match_of(const pugi::xml_node& node) {
  ProbeMatch match;
  const std::string endpoint = xml_text(xml_descendant(node, {"EndpointReference", "Address"}));
  if (endpoint.size() <= kMostWordBytes) match.endpoint = endpoint;
  for (const std::string& type : words_of(xml_child(node, "Types").child_value())) {
    match.types.emplace_back(xml_local_name(type.c_str()));
  }
  match.is_onvif = std::find(match.types.begin(), match.types.end(), "NetworkVideoTransmitter") !=
                   match.types.end();
  for (const std::string& scope : words_of(xml_child(node, "Scopes").child_value())) {
    if (!starts_with(scope, kScope)) continue;
    match.is_onvif = true;
    const std::string_view what = std::string_view(scope).substr(kScope.size());
    if (starts_with(what, "name/") && match.name.empty()) match.name = decoded(what.substr(5));
    if (starts_with(what, "hardware/") && match.hardware.empty())
      match.hardware = decoded(what.substr(9));
  }
  for (std::string& address : words_of(xml_child(node, "XAddrs").child_value())) {
    if (starts_with(address, "http://") || starts_with(address, "https://"))
      match.addresses.push_back(std::move(address));
  }
  return match;
}

}  // namespace

std::string probe_message(const std::string& message_id, bool for_cameras) {
  return "<?xml version=\"1.0\" encoding=\"UTF-8\"?>"
         "<s:Envelope xmlns:s=\"http://www.w3.org/2003/05/soap-envelope\""
         " xmlns:a=\"http://schemas.xmlsoap.org/ws/2004/08/addressing\""
         " xmlns:d=\"http://schemas.xmlsoap.org/ws/2005/04/discovery\""
         " xmlns:dn=\"http://www.onvif.org/ver10/network/wsdl\"><s:Header>"
         "<a:Action s:mustUnderstand=\"1\">"
         "http://schemas.xmlsoap.org/ws/2005/04/discovery/Probe</a:Action>"
         "<a:MessageID>" +
         message_id +
         "</a:MessageID><a:ReplyTo><a:Address>"
         "http://schemas.xmlsoap.org/ws/2004/08/addressing/role/anonymous</a:Address></a:ReplyTo>"
         "<a:To s:mustUnderstand=\"1\">urn:schemas-xmlsoap-org:ws:2005:04:discovery</a:To>"
         "</s:Header><s:Body><d:Probe>" +
         (for_cameras ? "<d:Types>dn:NetworkVideoTransmitter</d:Types>" : "") +
         "</d:Probe></s:Body></s:Envelope>";
}

bool parse_probe_matches(std::string_view datagram, const std::vector<std::string>& message_ids,
                         std::vector<ProbeMatch>* matches, std::string* error) {
  pugi::xml_document document;
  matches->clear();
  const pugi::xml_parse_result parsed = document.load_buffer(datagram.data(), datagram.size());
  if (!parsed) {
    *error = std::string("an answer that is not XML: ") + parsed.description();
    return false;
  }
  const pugi::xml_node envelope = xml_child(document.root(), "Envelope");
  const pugi::xml_node body = xml_child(envelope, "Body");
  pugi::xml_node answers = xml_child(body, "ProbeMatches");
  // Some put their only match straight into the body.
  if (!answers && xml_child(body, "ProbeMatch")) answers = body;
  if (!answers) {
    *error = "an answer without ProbeMatches" +
             (body.first_child() ? ", but with '" + shown(body.first_child().name()) + "'"
                                 : std::string());
    return false;
  }
  const std::string of = xml_text(xml_descendant(envelope, {"Header", "RelatesTo"}));
  if (!of.empty() &&
      std::none_of(message_ids.begin(), message_ids.end(),
                   [&of](const std::string& id) { return is_same_message(of, id); })) {
    *error = "an answer to a question of somebody else, '" + shown(of) + "'";
    return false;
  }
  for (const pugi::xml_node& node : answers.children()) {
    if (xml_local_name(node.name()) == "ProbeMatch" && matches->size() < kMostMatches)
      matches->push_back(match_of(node));
  }
  return true;
}

}  // namespace alidade
