#pragma once
// Latency of the real-time stage of `alidade run` with and without something beside it, in one run: the whole Pipeline with its threads, 1280x720 at
// 30 frames/s in OE mode.
//
// A frame counts from when the capture thread has it to its record: waiting, waking up and computing. A turn is a pipeline from its beginning to its
// end; turns of both conditions alternate, so that other load of the machine meets both. The ratio of the 99 % quantiles is given with the interval
// that chance leaves in 95 % of cases, from pairs of turns drawn again.

#include <functional>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>

#include "edge_app/pipeline/pipeline.h"
#include "test/benchmark/latency_report.h"
#include "test/benchmark/turning_camera.h"

namespace alidade::benchmarks {

// What is beside a pipeline for one turn.
class Beside {
 public:
  virtual ~Beside() = default;

  // Before the pipeline begins; what `options` borrows lives as long as this.
  virtual void join(PipelineOptions* options) = 0;
  // After the pipeline's end. What it did meanwhile.
  [[nodiscard]] virtual nlohmann::json stop() = 0;
};

// Runs `normal` (argv[2]) with neither SCHED_FIFO nor locked memory. The report, `name`_realtime or `name`_normal, goes to argv[1], if given.
// make: of the camera, before each turn with something beside. Returns an exit code: 1 where even the lower end of the ratio's interval is above
// 1.2, or the file was not written.
[[nodiscard]] int compare_turns(
    int argc, char** argv, const std::string& name, const std::string& what,
    const std::function<std::unique_ptr<Beside>(const TurningCamera& camera)>& make);

}  // namespace alidade::benchmarks
