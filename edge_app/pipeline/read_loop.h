#pragma once
// read_to_the_end(): reads a source from the first item to the last, across losses of the
// connection, for a capture or telemetry thread. Logs each loss and return, what a connected source
// waits for, and what it notes of its device or finds wrong with its stream. Allocates and waits:
// never on the real-time thread.

#include <spdlog/spdlog.h>

#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "edge_app/pipeline/link_watch.h"
#include "platform/system/clock.h"
#include "platform/video/frame_source.h"  // ReadStatus

namespace alidade {

// What the source waits for; always empty for telemetry.
template <typename Source>
std::string waiting_of(const Source& source) {
  if constexpr (std::is_base_of_v<FrameSource, Source>) {
    return source.waiting();
  } else {
    return "";
  }
}

// What the source has found out about its device since the last call; for video, what is wrong with
// the stream.
template <typename Source>
std::vector<std::string> notes_of(Source& source) {
  if constexpr (std::is_base_of_v<FrameSource, Source>) {
    std::vector<std::string> notes;
    for (std::string remark = source.remark(); !remark.empty(); remark = source.remark()) {
      notes.push_back(remark);
    }
    return notes;
  } else {
    return source.take_notes();
  }
}

// Logs what is waited for: at once, then with growing pauses, as the wait may last.
class WaitingLog {
 public:
  void say(const std::string& waiting, double now_s) {
    if (waiting.empty()) {
      pause_s_ = kFirstPause_s;
      next_s_ = 0;
    } else if (now_s >= next_s_) {
      spdlog::warn("{}", waiting);
      next_s_ = now_s + pause_s_;
      pause_s_ *= 2;
    }
  }

 private:
  static constexpr double kFirstPause_s = 10;
  double pause_s_ = kFirstPause_s;
  double next_s_ = 0;
};

// Accepts every item.
struct TakesAll {
  template <typename Item>
  std::string operator()(const Item& /*item*/) const {
    return "";
  }
};

// Whether the source gave up the connection that delivered the faulty item.
template <typename Source>
bool refuse(Source& source, const std::string& fault) {
  if constexpr (std::is_base_of_v<FrameSource, Source>) {
    return source.refuse(fault);
  } else {
    return false;
  }
}

// Item: Frame or PanTiltSample. on_item(item): returns false to end. on_loss(now_s): called at a
// loss and then each second until the next item. fault_of(item): why an item cannot be used; empty
// if it can. A faulty first item ends the loop with its fault as error. After a good item a fault
// is the peer's doing, and the source gives up the connection. If it has none to give up
// (FrameSource::refuse()), the fault ends the loop, too. *watch is informed of all this. Returns
// the error if the source failed for good, else an empty text.
template <typename Item, typename Source, typename OnItem, typename OnLoss,
          typename FaultOf = TakesAll>
std::string read_to_the_end(Source& source, LinkWatch* watch, const OnItem& on_item,
                            const OnLoss& on_loss, const FaultOf& fault_of = {}) {
  constexpr double kReadTimeout_s = 0.2;  // limits how late a loss is noticed
  constexpr double kNoticePeriod_s = 1;
  bool lost = false;
  bool any_good = false;
  double next_notice_s = 0;
  std::string said;
  std::string waited;
  WaitingLog waiting_log;
  Item item;
  while (true) {
    switch (source.read(item, kReadTimeout_s)) {
      case ReadStatus::kOk:
        if (const std::string fault = fault_of(item); !fault.empty()) {
          if (any_good && refuse(source, fault)) break;
          return source.name() + ": " + fault;
        }
        any_good = true;
        if (lost) spdlog::info("{}: connected again", source.name());
        lost = false;
        said.clear();
        watch->item(monotonic_now_s());
        for (const std::string& note : notes_of(source)) spdlog::warn("{}", note);
        if (!on_item(item)) return "";
        break;
      case ReadStatus::kDisconnected:
        // Each attempt to reconnect fails with much the same words: say them once.
        if (source.error() != said) {
          said = source.error();
          spdlog::warn("{}; trying again", said);
        }
        watch->lost(said);
        if (!lost) next_notice_s = -std::numeric_limits<double>::infinity();
        lost = true;
        break;
      case ReadStatus::kTimeout:
        break;
      case ReadStatus::kFailed:
        return source.error();
      case ReadStatus::kEnd:
      case ReadStatus::kStopped:
        return "";
    }
    const double now = monotonic_now_s();
    const std::string waiting = waiting_of(source);
    if (waiting != waited) watch->waiting(waiting);
    waited = waiting;
    waiting_log.say(waiting, now);
    if (lost && now >= next_notice_s) {
      on_loss(now);
      next_notice_s = now + kNoticePeriod_s;
    }
  }
}

}  // namespace alidade
