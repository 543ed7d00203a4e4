#pragma once
// What `alidade run` reports in addition to its records: the last lines of its log, and its state
// to a service manager. `replay` has the first of these lines, too.

#include <string>

#include "edge_app/pipeline/pipeline.h"
#include "platform/system/service_manager.h"

namespace alidade {

// One line: frames, records of each mode, latency and its parts, losses, page faults.
[[nodiscard]] std::string describe(const PipelineSummary& summary, bool latency_measured);

// Why records were not in OE mode (reason_counts.h). If the zoom was the reason, also the readings
// that the calibration covers. Empty: all records were in OE mode.
[[nodiscard]] std::string describe(const ReasonCounts& reasons, const Calibration& calibration,
                                   const ZoomCurve& curve);

// Reports to a service manager once a period: the state and, as long as records get through the
// threads, that the process is alive. The service manager kills a process of which a thread hangs,
// but not one whose camera is missing.
class LifeReport {
 public:
  // Both must outlive this object.
  LifeReport(const ServiceManager& manager, Pipeline* pipeline);

  // Infinite without a service manager.
  [[nodiscard]] double period_s() const;
  // Reports. To be called once a period.
  void tell();

 private:
  const ServiceManager& manager_;
  Pipeline& pipeline_;
  bool lived_ = true;
  PipelineSummary status_;  // of the last report of the state
  double status_s_;         // time of that report
};

}  // namespace alidade
