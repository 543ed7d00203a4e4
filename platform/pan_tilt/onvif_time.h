#pragma once
// Times as ONVIF writes them, and Unix time. Pure.

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

// None: it is no date and time from 1900 to 9999.
[[nodiscard]] std::optional<double> unix_time(const CivilTime& civil);

// xs:dateTime and Unix time; without a zone, UTC is meant.
[[nodiscard]] std::optional<double> parse_xml_time(std::string_view text);
[[nodiscard]] std::string xml_time(double utc_s);

}  // namespace alidade
