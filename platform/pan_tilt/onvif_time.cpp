#include "platform/pan_tilt/onvif_time.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>

#include "platform/system/text.h"

namespace alidade {
namespace {

// Takes exactly `digits` decimal digits off the front of *text.
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

// Days since 1970-01-01 in the Gregorian calendar. Years are counted from 1 March.
std::int64_t days_from_civil(int year, int month, int day) {
  const int y = month <= 2 ? year - 1 : year;
  const int month_from_march = (month + 9) % 12;
  const int day_of_year = (153 * month_from_march + 2) / 5 + day - 1;
  return std::int64_t{365} * y + y / 4 - y / 100 + y / 400 + day_of_year - 719468;
}

}  // namespace

std::optional<double> unix_time(const CivilTime& civil) {
  const auto within = [](int value, int low, int high) { return value >= low && value <= high; };
  if (!within(civil.year, 1900, 9999) || !within(civil.month, 1, 12) || !within(civil.day, 1, 31) ||
      !within(civil.hour, 0, 24) || !within(civil.minute, 0, 59) || !within(civil.second, 0, 60)) {
    return std::nullopt;
  }
  const std::int64_t days = days_from_civil(civil.year, civil.month, civil.day);
  // Day 31 of a month of 30 would be the first of the next.
  if (civil.month < 12 && days >= days_from_civil(civil.year, civil.month + 1, 1)) {
    return std::nullopt;
  }
  return static_cast<double>(((days * 24 + civil.hour) * 60 + civil.minute) * 60 + civil.second);
}

std::optional<double> parse_xml_time(std::string_view text) {
  text = trimmed(text, kXmlBlanks);
  CivilTime civil;
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
  // From 0 to the year 9999.
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

}  // namespace alidade
