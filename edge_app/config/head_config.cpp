#include "edge_app/config/head_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr NumberRange kDegPerStep{1e-6, 10, "deg"};

template <typename Value>
Value required(const YamlSection& section, const std::string& key,
               const std::optional<Value>& value, const std::string& what) {
  if (!value) section.fail_missing(key, "expected " + what);
  return *value;
}

ByteLinkOptions read_link(YamlSection& section, const std::string& config_path) {
  ByteLinkOptions link;
  const std::optional<std::string> device = section.text("device");
  const std::optional<std::string> url = section.text("url");
  if (device && url) section.fail("url", "and device exclude each other; keep one");
  if (url) {
    if (!is_byte_link_url(*url)) {
      section.fail("url", "is not an address tcp://host:port or udp://host:port");
    }
    link.address = *url;
    return link;
  }
  link.address = (fs::path(config_path).parent_path() /
                  required(section, "device", device,
                           "for example device: /dev/ttyUSB0, or url: tcp://head:4000"))
                     .string();
  link.baud = section.integer("baud", {1200, 115200, "baud"}).value_or(link.baud);
  if (!is_baud(link.baud)) {
    section.fail("baud",
                 "is not a speed of a serial line; expected 1200, 2400, 4800, 9600, 19200, 38400, "
                 "57600 or 115200");
  }
  return link;
}

// positive, negative: the words for the two directions in which an axis can count.
AxisMapping read_axis(YamlSection& section, const std::string& axis, const std::string& positive,
                      const std::string& negative, const std::optional<double>& usual_sign) {
  AxisMapping mapping;
  const std::string key = axis + "_positive";
  const std::optional<std::string> way = section.choice(key, {positive, negative});
  const std::optional<double> sign =
      way ? std::optional(*way == positive ? 1.0 : -1.0) : usual_sign;
  mapping.sign = required(
      section, key, sign,
      fmt::format("{} or {}: where the head turns while its {} grows", positive, negative, axis));
  mapping.zero_deg =
      section.number(axis + "_zero_deg", {-360, 360, "deg"}).value_or(mapping.zero_deg);
  return mapping;
}

PelcoDOptions read_pelco_d(YamlSection& section) {
  PelcoDOptions options;
  options.address = section.integer("address", {1, 255, "address"}).value_or(options.address);
  options.pan_deg_per_step =
      section.number("pan_deg_per_step", kDegPerStep).value_or(options.pan_deg_per_step);
  options.tilt_deg_per_step =
      section.number("tilt_deg_per_step", kDegPerStep).value_or(options.tilt_deg_per_step);
  options.read_zoom = section.truth("read_zoom").value_or(options.read_zoom);
  return options;
}

ViscaOptions read_visca(YamlSection& section, const ByteLinkOptions& link) {
  const std::string of_the_model =
      "the model's, for example 0.01953125 (1/51.2) or 0.0694444 (1/14.4)";
  ViscaOptions options;
  options.address = section.integer("address", {1, 7, "address"}).value_or(options.address);
  options.pan_deg_per_step = required(
      section, "pan_deg_per_step", section.number("pan_deg_per_step", kDegPerStep), of_the_model);
  options.tilt_deg_per_step = required(
      section, "tilt_deg_per_step", section.number("tilt_deg_per_step", kDegPerStep), of_the_model);
  options.read_zoom = section.truth("read_zoom").value_or(options.read_zoom);
  if (link.address.rfind("udp://", 0) == 0) {
    options.header = required(section, "header", section.truth("header"),
                              "true (datagrams begin with VISCA's header of eight bytes) or false");
  }
  return options;
}

PtuOptions read_ptu(YamlSection& section) {
  PtuOptions options;
  options.verbose =
      section.choice("feedback", {"terse", "verbose"}).value_or("verbose") == "verbose";
  options.pan_deg_per_step = section.number("pan_deg_per_step", kDegPerStep);
  options.tilt_deg_per_step = section.number("tilt_deg_per_step", kDegPerStep);
  return options;
}

HeadOptions read_protocol(YamlSection& section, HeadType type, const ByteLinkOptions& link) {
  switch (type) {
    case HeadType::kPelcoD:
      return read_pelco_d(section);
    case HeadType::kVisca:
      return read_visca(section, link);
    case HeadType::kPtu:
      return read_ptu(section);
  }
  section.fail("type", "is not a head on a line");
}

}  // namespace

AxisMappings read_axes(YamlSection& section, const UsualSigns& usual) {
  return {read_axis(section, "pan", "right", "left", usual.pan),
          read_axis(section, "tilt", "up", "down", usual.tilt)};
}

HeadConfig read_head(YamlSection& section, HeadType type, const std::string& config_path,
                     double* rate_hz) {
  HeadConfig head;
  head.link = read_link(section, config_path);
  head.protocol = read_protocol(section, type, head.link);

  const std::optional<double> wanted_hz = section.number("rate_hz", {0.1, 1000, "Hz"});
  *rate_hz = wanted_hz.value_or(*rate_hz);
  const double byte_time_s = wire_time_of_byte_s(head.link);
  if (byte_time_s > 0) {
    const double most_hz = ceiling_hz(*make_protocol(head.protocol), byte_time_s);
    if (wanted_hz && *wanted_hz > most_hz) {
      section.fail("rate_hz",
                   fmt::format("{} Hz is more than the line carries at {} baud; expected "
                               "at most {:.1f}, or nothing: as much as it carries",
                               *wanted_hz, head.link.baud, most_hz));
    }
    *rate_hz = std::min(*rate_hz, most_hz);
  }
  return head;
}

}  // namespace alidade
