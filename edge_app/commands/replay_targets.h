#pragma once
// ReplayTargets: detections of a file or of stdin, beside a replay's records, to targets.jsonl. JSON Lines: each as POST /api/v1/detections has it.
// A line is read when a record has come and those before it are done with, and waits until its frame has a record; a line for the frame at
// hand ends the reading until the next record. So a detector that is told each record may answer it, lines may be late, and the same
// lines give the same bytes. A line that cannot be read is an error with its number; frames that a
// live run would refuse, and boxes that it leaves out, are told at the end.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "edge_app/commands/partial_file.h"
#include "edge_app/commands/stop_signals.h"
#include "edge_app/config/tracking_config.h"
#include "edge_app/output/detection_query.h"
#include "edge_app/output/line_writer.h"
#include "edge_app/output/live_state.h"
#include "edge_app/tracking/target_stage.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

class ReplayTargets {
 public:
  // detections: a file, or "-" for stdin. tracking: a configuration whose section tracking counts; empty: the sphere, and defaults.
  // Results appear as path when all is done. Throws CommandError, as all here.
  ReplayTargets(const std::string& detections, const std::string& tracking, std::string path,
                StopSignals* signals);

  void add(const OrientationRecord& record);
  // What lines are left; the file gets its name. One line about it all.
  [[nodiscard]] std::string complete();

 private:
  [[nodiscard]] bool read_line(std::string* line);
  [[nodiscard]] bool next();
  [[nodiscard]] bool is_due() const;
  void take();

  const std::string name_;  // of the lines' file, for messages
  StopSignals* signals_;
  TargetStage stage_;
  LiveState records_;
  FileDescriptor opened_;  // unless it is stdin
  int in_;
  PartialFile out_;
  LineWriter writer_;
  std::string buffer_;
  std::size_t begin_ = 0;  // of what is left of it
  bool ended_ = false;
  std::int64_t line_ = 0;
  std::optional<DetectionQuery> waiting_;
  std::optional<std::int64_t> newest_frame_;
  std::optional<double> newest_s_;
};

}  // namespace alidade
