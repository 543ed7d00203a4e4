// What is known of the ground, and plane.yaml: errors are one line with the file's name; what is read is finite, leads to a plane
// or a refusal and never to what is not finite, and is written as a text that is read as the same plane.

#include "edge_app/config/plane_data.h"
#include "edge_app/storage/plane_file.h"
#include "test/fuzz/fuzz_target.h"

namespace {

// A fit takes milliseconds a start.
constexpr std::size_t kMostData = 12;

void require_error(const std::string& error) {
  FUZZ_REQUIRE(alidade::is_one_line(error));
  FUZZ_REQUIRE(error.rfind("ground.yaml", 0) == 0);
}

void require_finite(const alidade::WorldPlane& plane) {
  FUZZ_REQUIRE(plane.R_base_from_world.allFinite() && plane.position.allFinite());
  FUZZ_REQUIRE(plane.covariance.allFinite());
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string text(text_of(data, size));
  std::string error;
  PlaneData known;
  if (!parse_plane_data(text, "ground.yaml", &known, &error)) {
    require_error(error);
  } else if (known.evidence.data.size() <= kMostData) {
    const PlaneFit fit = fit_plane(known.evidence);
    FUZZ_REQUIRE(fit.status != PlaneFitStatus::kBadInput);
    if (fit.status == PlaneFitStatus::kOk) require_finite(fit.plane);
    if (fit.status != PlaneFitStatus::kOk) FUZZ_REQUIRE(is_one_line(fit.message));
  }
  PlaneEstimate read;
  if (!parse_plane(text, "ground.yaml", &read, &error)) {
    require_error(error);
    return 0;
  }
  require_finite(read.plane);
  // A base that points straight up has no heading to be written.
  if (!(Vector3<double>(read.plane.R_base_from_world.row(0)).head<2>().norm() > kLeastForward))
    return 0;
  PlaneEstimate again;
  FUZZ_REQUIRE(parse_plane(format_plane(read, PlaneFit()), "again", &again, &error));
  FUZZ_REQUIRE((again.plane.R_base_from_world - read.plane.R_base_from_world).norm() < 1e-9);
  FUZZ_REQUIRE(again.plane.position == read.plane.position);
  return 0;
}
