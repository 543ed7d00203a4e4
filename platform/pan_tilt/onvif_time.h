#pragma once
// ONVIF time formats and Unix time. No side effects.

#include <optional>
#include <string>
#include <string_view>

namespace alidade {

constexpr std::string_view kXmlBlanks = " \t\r\n";

struct CivilTime {
  int year = 0;
  int month = 0;
  int day = 0;
  int hour = 0;
  int minute = 0;
  int second = 0;
};

// s since 1970, UTC. nullopt: a member out of range (year 1900 to 9999, hour to 24, second to 60).
// The day is checked against 31 only: 31 April is taken for 1 May.
[[nodiscard]] std::optional<double> unix_time(const CivilTime& civil);

// xs:dateTime to and from Unix time, s. A time without a zone is UTC. nullopt: not an xs:dateTime
// with a year of four digits. xml_time() rounds to ms and clamps to 1970 to 9999.
[[nodiscard]] std::optional<double> parse_xml_time(std::string_view text);
[[nodiscard]] std::string xml_time(double utc_s);

}  // namespace alidade
