// One body of bytes read as every answer of ONVIF. What is read is within its bounds; what is not read
// says why in one line; a time that is read is written and read again as the same.

#include "platform/pan_tilt/onvif_messages.h"
#include "test/fuzz/fuzz_target.h"

namespace alidade {
namespace {

void require_refusal(const std::string& error) {
  FUZZ_REQUIRE(is_one_line(error));
  FUZZ_REQUIRE(error.size() < 300);
}

constexpr double kLastTime_s = 253402300799;  // of the year 9999; xml_time() begins at 0

void require_time_kept(double utc_s) {
  FUZZ_REQUIRE(std::isfinite(utc_s));
  if (utc_s < 0 || utc_s > kLastTime_s) return;
  const auto again = parse_xml_time(xml_time(utc_s));
  FUZZ_REQUIRE(again);
  FUZZ_REQUIRE(std::abs(*again - utc_s) <= 1e-3);
}

void require_sound_status(std::string_view body) {
  OnvifStatus status;
  std::string error;
  if (!parse_onvif_status(body, &status, &error)) return require_refusal(error);
  const double limit = status.space == OnvifStatus::Space::kGeneric ? 1.01 : 360;
  FUZZ_REQUIRE(std::abs(status.pan) <= limit && std::abs(status.tilt) <= limit);
  FUZZ_REQUIRE(!status.zoom || std::isfinite(*status.zoom));
  if (status.utc_s) require_time_kept(*status.utc_s);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string_view body = text_of(data, size);
  if (const auto utc_s = parse_xml_time(body)) require_time_kept(*utc_s);
  require_sound_status(body);
  if (const auto fault = parse_soap_fault(body)) {
    FUZZ_REQUIRE(fault->text.empty() || is_one_line(fault->text));
    FUZZ_REQUIRE(fault->text.size() < 300);
  }
  std::string error;
  double utc_s = 0;
  if (parse_onvif_clock(body, &utc_s, &error)) {
    require_time_kept(utc_s);
  } else {
    require_refusal(error);
  }
  OnvifServices services;
  if (parse_onvif_services(body, &services, &error)) {
    FUZZ_REQUIRE(!services.ptz.empty());
  } else {
    require_refusal(error);
  }
  std::string token;
  if (parse_onvif_profile(body, &token, &error)) {
    FUZZ_REQUIRE(!token.empty());
  } else {
    require_refusal(error);
  }
  return 0;
}
