// The body of a request for directions, else for pixels: what is accepted is bounded, finite and answered by one
// line; what is refused has one line.

#include "core/model/direction.h"
#include "edge_app/output/pixel_query.h"
#include "test/fuzz/fuzz_target.h"
#include "test/fuzz/record_of_frame.h"

namespace alidade {
namespace {

void require_answer(const std::string& answer) {
  FUZZ_REQUIRE(!answer.empty() && answer.back() == '\n');
  FUZZ_REQUIRE(is_one_line(answer.substr(0, answer.size() - 1)));
  // What is not finite would be null.
  FUZZ_REQUIRE(answer.find("null") == std::string::npos);
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string body(text_of(data, std::min(size, kMaxQueryBytes)));
  DirectionQuery directions;
  PixelQuery pixels;
  std::string error;
  if (parse_direction_query(body, &directions, &error)) {
    FUZZ_REQUIRE(!directions.pixels.empty() && directions.pixels.size() <= kMaxQueryItems);
    for (const Vector2<double>& u : directions.pixels) FUZZ_REQUIRE(all_finite(u));
    FUZZ_REQUIRE(directions.pixel_sigma_px >= 0 && directions.pixel_sigma_px <= 1000);
    FUZZ_REQUIRE(!directions.which.frame || !directions.which.time_s);
    FUZZ_REQUIRE(!directions.distance_m ||
                 (*directions.distance_m >= 1 && *directions.distance_m <= 1e9));
    require_answer(direction_answer(record_of_frame(0), directions));
  } else {
    FUZZ_REQUIRE(is_one_line(error));
  }
  if (parse_pixel_query(body, &pixels, &error)) {
    FUZZ_REQUIRE(!pixels.directions.empty() && pixels.directions.size() <= kMaxQueryItems);
    for (const Vector3<double>& d : pixels.directions) FUZZ_REQUIRE(std::abs(d.norm() - 1) < 1e-12);
    FUZZ_REQUIRE(!pixels.which.frame || !pixels.which.time_s);
    require_answer(pixel_answer(record_of_frame(0), pixels));
  } else {
    FUZZ_REQUIRE(is_one_line(error));
  }
  return 0;
}
