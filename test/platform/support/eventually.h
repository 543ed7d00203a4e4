#pragma once
// Waiting for events: everything that a test waits for comes within kDeadline_s, or the test fails.

#include <sys/types.h>

#include <chrono>
#include <fstream>
#include <sstream>
#include <string>
#include <thread>

#include "platform/system/clock.h"
#include "platform/video/frame_source.h"

namespace alidade {

constexpr double kDeadline_s = 30;
// Of a wait that something else ends.
constexpr double kNever_s = 1e6;

// Reads until the status is one of those wanted (or none is left to come); returns the last status.
template <class Source, class Item, class Wanted>
ReadStatus read_until(Source& source, Item& item, Wanted wanted) {
  const double end_s = monotonic_now_s() + kDeadline_s;
  ReadStatus status = ReadStatus::kTimeout;
  while (monotonic_now_s() < end_s) {
    status = source.read(item, 1);
    if (wanted(status) || status == ReadStatus::kFailed || status == ReadStatus::kStopped ||
        status == ReadStatus::kEnd) {
      break;
    }
  }
  return status;
}

template <class Source, class Item>
ReadStatus read_until(Source& source, Item& item, ReadStatus wanted) {
  return read_until(source, item, [wanted](ReadStatus status) { return status == wanted; });
}

template <class Condition>
bool eventually(Condition condition) {
  const double end_s = monotonic_now_s() + kDeadline_s;
  while (!condition()) {
    if (monotonic_now_s() > end_s) {
      return false;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return true;
}

// Waits until a thread of this process waits, and is woken by nothing for a hundred looks.
inline bool falls_asleep(pid_t thread) {
  std::string before;
  int alike = 0;
  return eventually([&] {
    std::ostringstream text;
    text << std::ifstream("/proc/self/task/" + std::to_string(thread) + "/status").rdbuf();
    const std::string status = text.str();
    const std::size_t at = status.find("voluntary_ctxt_switches");
    const std::string wakings = at == std::string::npos ? "" : status.substr(at);
    const bool asleep = status.find("State:\tS") != std::string::npos;
    alike = asleep && wakings == before ? alike + 1 : 0;
    before = wakings;
    return alike >= 100;
  });
}

}  // namespace alidade
