#pragma once
// RecordEvents: the records of a LiveState as Server-Sent Events, for one client (GET
// /api/v1/stream).
//
//   hello         first
//   clock         after hello, then every 5 s
//   orientation   for each record
//   lost          if the client was too slow
//   targets       after each frame of detections; the newest, if several came
//   (comment)     if nothing else came for 3 s

#include <string>

#include "edge_app/output/http/http_message.h"
#include "edge_app/output/live_state.h"
#include "edge_app/output/target_lines.h"

namespace alidade {

class RecordEvents final : public HttpStream {
 public:
  // *live and *targets must outlive this object. targets: null if nothing is tracked.
  RecordEvents(LiveState* live, const TargetLines* targets, std::string version);

  void next(std::string* piece) override;

 private:
  LiveState& live_;
  const TargetLines* targets_;
  std::int64_t targets_said_ = 0;  // id
  const std::string version_;
  LiveState::Reader reader_;
  bool greeted_ = false;
  double clock_due_s_ = 0;  // 0: the first clock event is due at once
  double said_s_ = 0;       // time of the last event
};

}  // namespace alidade
