#pragma once
// ReplayTargets: makes targets.jsonl from a replay's records and from detections in a file or on
// stdin. Detections are JSON Lines, each like the body of POST /api/v1/detections.
// After each record, lines are read up to the one for the record's frame. A line for a later frame
// ends the reading, too, and waits for its record. So a detector that reads the records may answer
// them, lines may be late, and the same lines give the same bytes. A line that cannot be read is an
// error with its number. Frames and boxes that a live run would refuse are counted and reported at
// the end.

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
  // detections: a file, or "-" for stdin. tracking: a configuration with section `tracking`; empty:
  // on the sphere, with defaults. path: of the result, which gets its name in complete(). signals:
  // must outlive this object. A line may have kMaxDetectionBytes at most. The constructor throws
  // CommandError if the configuration cannot be used, `detections` cannot be read or the result
  // cannot be written; the other functions throw it if a line cannot be read, the result cannot be
  // written, or a signal comes while they wait for a line.
  ReplayTargets(const std::string& detections, const std::string& tracking, std::string path,
                StopSignals* signals);

  void add(const OrientationRecord& record);
  // Reads the remaining lines and gives the file its name. Returns one line of statistics.
  [[nodiscard]] std::string complete();

 private:
  [[nodiscard]] bool read_line(std::string* line);
  [[nodiscard]] bool next();
  [[nodiscard]] bool is_due() const;
  void take();

  const std::string name_;  // of the detections' file, for messages
  StopSignals* signals_;
  TargetStage stage_;
  LiveState records_;
  FileDescriptor opened_;  // unless it is stdin
  int in_;
  PartialFile out_;
  LineWriter writer_;
  std::string buffer_;
  std::size_t begin_ = 0;  // of the unread part of buffer_
  bool ended_ = false;
  std::int64_t line_ = 0;
  std::optional<DetectionQuery> waiting_;
  std::optional<std::int64_t> newest_frame_;
  std::optional<double> newest_s_;
};

}  // namespace alidade
