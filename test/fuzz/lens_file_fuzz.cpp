// lens.yaml: what is read is written as a text that is read as the same bits.

#include "edge_app/storage/lens_file.h"
#include "test/fuzz/fuzz_target.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  LensEstimate read;
  std::string error;
  if (!parse_lens(std::string(text_of(data, size)), "lens.yaml", &read, &error)) {
    FUZZ_REQUIRE(is_one_line(error));
    FUZZ_REQUIRE(error.rfind("lens.yaml:", 0) == 0);
    return 0;
  }
  FUZZ_REQUIRE(read.lens.allFinite() && read.covariance.allFinite());
  PatternCalibration calibration;
  calibration.lens = read.lens;
  calibration.covariance = read.covariance;
  LensEstimate again;
  FUZZ_REQUIRE(
      parse_lens(format_lens(calibration, {"", read.width, read.height}), "again", &again, &error));
  FUZZ_REQUIRE(again.width == read.width && again.height == read.height);
  FUZZ_REQUIRE(again.lens == read.lens && again.covariance == read.covariance);
  return 0;
}
