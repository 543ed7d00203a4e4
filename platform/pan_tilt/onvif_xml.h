#pragma once
// Helpers for XML of SOAP, by pugixml, which expands no entities that a document defines.
// Namespace prefixes are ignored: devices choose them freely, and some declare the wrong ones.

#include <initializer_list>
#include <pugixml.hpp>
#include <string>
#include <string_view>

#include "platform/pan_tilt/onvif_time.h"  // kXmlBlanks
#include "platform/system/text.h"

namespace alidade {

[[nodiscard]] inline std::string xml_escaped(std::string_view text) {
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

[[nodiscard]] inline std::string_view xml_local_name(const char* name) {
  const std::string_view text(name);
  const std::size_t colon = text.find(':');
  return colon == std::string_view::npos ? text : text.substr(colon + 1);
}

[[nodiscard]] inline pugi::xml_node xml_child(const pugi::xml_node& node, std::string_view name) {
  return node.find_child(
      [name](const pugi::xml_node& candidate) { return xml_local_name(candidate.name()) == name; });
}

[[nodiscard]] inline pugi::xml_node xml_descendant(pugi::xml_node node,
                                                   std::initializer_list<std::string_view> names) {
  for (const std::string_view name : names) {
    node = xml_child(node, name);
  }
  return node;
}

[[nodiscard]] inline std::string xml_text(const pugi::xml_node& node) {
  return std::string(trimmed(node.child_value(), kXmlBlanks));
}

}  // namespace alidade
