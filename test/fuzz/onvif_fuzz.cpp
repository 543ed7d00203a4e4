// One body of bytes read as every answer of ONVIF. What is read is within its bounds; what is not read
// says why in one line; a time that is read is written and read again as the same; a login goes to the
// device alone.

#include "platform/pan_tilt/onvif_addresses.h"
#include "platform/pan_tilt/onvif_messages.h"
#include "platform/pan_tilt/onvif_scale.h"
#include "platform/pan_tilt/onvif_time.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

constexpr std::size_t kMostShown = 120;  // bytes of foreign text in an error

void require_refusal(const std::string& error) {
  FUZZ_REQUIRE(is_one_line(error));
  FUZZ_REQUIRE(error.size() < longest_error(180, kMostShown));
}

constexpr double kLastTime_s = 253402300799;  // of the year 9999; xml_time() begins at 0

void require_time_kept(double utc_s) {
  FUZZ_REQUIRE(std::isfinite(utc_s));
  if (utc_s < 0 || utc_s > kLastTime_s) return;
  const auto again = parse_xml_time(xml_time(utc_s));
  FUZZ_REQUIRE(again);
  FUZZ_REQUIRE(std::abs(*again - utc_s) <= 1e-3);
}

// On the scale that this body declares, too.
void require_sound_status(std::string_view body, const std::vector<OnvifSpaceRange>& ranges) {
  OnvifStatus status;
  std::string error;
  if (!parse_onvif_status(body, &status, &error)) return require_refusal(error);
  FUZZ_REQUIRE(std::isfinite(status.pan) && std::isfinite(status.tilt));
  for (const OnvifAxis& axis : {OnvifAxis(), OnvifAxis{OnvifRange{-3, 3}, {}}}) {
    OnvifScale scale(axis, axis);
    scale.set_ranges(ranges);
    double pan_rad = 0;
    double tilt_rad = 0;
    if (scale.angles(status, &pan_rad, &tilt_rad, &error) == OnvifScale::Outcome::kOk) {
      FUZZ_REQUIRE(std::abs(pan_rad) < 7 && std::abs(tilt_rad) < 7);
    } else {
      FUZZ_REQUIRE(is_one_line(error) && error.size() < longest_error(380, kMostShown));
    }
    const std::string note = scale.note(status);
    FUZZ_REQUIRE(note.empty() || is_one_line(note));
  }
  FUZZ_REQUIRE(!status.zoom || std::isfinite(*status.zoom));
  if (status.utc_s) require_time_kept(*status.utc_s);
}

// Whatever a device says of itself, a login goes to its own host.
void require_addresses(std::string_view told) {
  Url device;
  std::string error;
  FUZZ_REQUIRE(parse_url("http://camera:81/cam1/onvif/device_service", &device, &error));
  for (const OnvifService service : {OnvifService::kPtz, OnvifService::kMedia}) {
    for (const std::string& address : onvif_addresses(device, std::string(told), service)) {
      FUZZ_REQUIRE(address.rfind("http://camera", 0) == 0);
      const char behind = address[13];
      FUZZ_REQUIRE(behind == ':' || behind == '/');
      Url url;
      if (parse_url(address, &url, &error)) FUZZ_REQUIRE(url.host == "camera");
    }
  }
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string_view body = text_of(data, size);
  if (const auto utc_s = parse_xml_time(body)) require_time_kept(*utc_s);
  std::string error;
  std::vector<OnvifSpaceRange> ranges;
  if (!parse_onvif_ranges(body, "", &ranges, &error)) require_refusal(error);
  // What is no status tells pan and tilt as the ranges' ends.
  require_sound_status(body, ranges);
  require_sound_status(
      "<Envelope><Body><GetStatusResponse><PTZStatus><Position><PanTilt x='90' y='1'/></Position>"
      "</PTZStatus></GetStatusResponse></Body></Envelope>",
      ranges);
  require_addresses(text_of(data, size));
  if (const auto fault = parse_soap_fault(body)) {
    FUZZ_REQUIRE(fault->text.empty() || is_one_line(fault->text));
    FUZZ_REQUIRE(fault->text.size() < longest_error(180, kMostShown));
  }
  OnvifClock clock;
  if (parse_onvif_clock(body, &clock, &error)) {
    FUZZ_REQUIRE(clock.utc_s || clock.local_s);
    require_time_kept(clock.utc_s.value_or(0));
    require_time_kept(clock.local_s.value_or(0));
  } else {
    require_refusal(error);
  }
  OnvifServices services;
  if (parse_onvif_services(body, &services, &error)) {
    FUZZ_REQUIRE(!services.ptz.empty());
  } else {
    require_refusal(error);
  }
  OnvifProfile profile;
  if (parse_onvif_profile(body, &profile, &error)) {
    FUZZ_REQUIRE(!profile.token.empty());
  } else {
    require_refusal(error);
  }
  return 0;
}
