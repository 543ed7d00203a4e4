// Bodies of what detectors send: line after line to one stage, a frame each. What is accepted is finite and tracked, what is told of the
// targets is one line without anything that is not finite; what is refused has one line, and changes no target.

#include <algorithm>
#include <sstream>

#include "edge_app/output/detection_query.h"
#include "edge_app/output/targets_json.h"
#include "edge_app/tracking/target_stage.h"
#include "test/fuzz/fuzz_target.h"
#include "test/fuzz/record_of_frame.h"

namespace alidade {
namespace {

std::shared_ptr<const PlaneEstimate> ground() {
  PlaneEstimate plane;
  plane.plane.R_base_from_world = R_base_from_world_of(0, -0.3, 0.1);
  plane.plane.position = {0, 0, 10};
  plane.plane.covariance.diagonal().setConstant(1e-6);
  return std::make_shared<const PlaneEstimate>(plane);
}

void track(const std::string& text, TargetSpace space) {
  TargetOptions options = default_target_options(space);
  options.tracker.max_targets = 16;
  options.tracker.max_detections = 16;
  options.tracker.birth_hits = 1;
  TargetStage stage(options, space == TargetSpace::kPlane ? ground() : nullptr);
  std::istringstream lines(text);
  std::int64_t number = 0;
  for (std::string line; std::getline(lines, line) && number < 40; ++number) {
    DetectionQuery query;
    std::string error;
    if (!parse_detections(line, &query, &error)) {
      FUZZ_REQUIRE(is_one_line(error));
      continue;
    }
    FUZZ_REQUIRE(query.which.frame.has_value() != query.which.time_s.has_value());
    for (const DetectionBox& box : query.boxes) FUZZ_REQUIRE(box.name.size() <= kLongestClass);
    const std::int64_t updates = stage.state().updates;
    const DetectionAnswer answer = stage.add({record_of_frame(number), query.boxes});
    FUZZ_REQUIRE(answer.left_out.size() <= query.boxes.size());
    FUZZ_REQUIRE(stage.state().updates == updates + (is_taken(answer.status) ? 1 : 0));
    if (!is_taken(answer.status)) continue;
    FUZZ_REQUIRE(query.boxes.size() <= 16);
    const TargetsState state = stage.state();
    for (const TrackedTarget& one : state.targets) {
      FUZZ_REQUIRE(all_finite(one.target.state.mean) && all_finite(one.target.state.cov));
    }
    const std::string told = targets_line(state);
    FUZZ_REQUIRE(!told.empty() && told.back() == '\n');
    FUZZ_REQUIRE(is_one_line(told.substr(0, told.size() - 1)));
  }
}

}  // namespace
}  // namespace alidade

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace alidade;
  const std::string text(text_of(data, std::min(size, kMaxDetectionBytes)));
  track(text, TargetSpace::kPlane);
  track(text, TargetSpace::kSphere);
  return 0;
}
