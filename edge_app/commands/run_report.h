#pragma once
// What `alidade run` tells of itself beside its records: the last lines of its log, of which
// `replay` has one too, and a service manager.

#include <string>

#include "edge_app/pipeline/pipeline.h"
#include "platform/system/service_manager.h"

namespace alidade {

// Frames, records of each mode, latency and its parts, losses, page faults: one line.
[[nodiscard]] std::string describe(const PipelineSummary& summary, bool latency_measured);

// Why records were not in OE mode (reason_counts.h), and what zoom readings the calibration is for
// where that is the reason. Empty: all were.
[[nodiscard]] std::string describe(const ReasonCounts& reasons, const Calibration& calibration,
                                   const ZoomCurve& curve);

// Tells a service manager, once a period, what goes on, and that the process lives as long as records get through. A
// camera that is gone is no reason to be killed; a thread that hangs is.
class LifeReport {
 public:
  // Borrows both.
  LifeReport(const ServiceManager& manager, Pipeline* pipeline);

  // s; infinite without a service manager.
  [[nodiscard]] double period_s() const;
  void tell();

 private:
  const ServiceManager& manager_;
  Pipeline& pipeline_;
  bool lived_ = true;
  PipelineSummary status_;  // told last
  double status_s_;
};

}  // namespace alidade
