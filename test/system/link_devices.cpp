// link_devices KIND: a camera that sends MJPEG over HTTP at 25 Hz, and a head that moves, on a line, one of
// first_kinds_in_turn() of head_kinds.h. At t of CLOCK_MONOTONIC its pan is 20 cos(t/2) degrees to the right, its tilt
// 10 cos(t/3) up. Prints "ready URL SETTINGS", the last being what section pan_tilt says of the head; each line of stdin
// is what the line has from then on: unplugged, or a fault by its name. Ends with stdin.
// link_devices: prints those kinds, a line each: its name, and the faults that cost answers only.

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <iostream>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "platform/system/clock.h"
#include "test/platform/support/head_kinds.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/simulator/servers/head_server.h"

namespace {

using alidade::HeadKind;
using alidade::LineFault;

const std::map<std::string, LineFault> kFaults = {
    {"none", LineFault::kNone},
    {"noise", LineFault::kNoise},
    {"lost_byte", LineFault::kLostByte},
    {"changed_byte", LineFault::kChangedByte},
    {"merged", LineFault::kMerged},
    {"repeated", LineFault::kRepeated},
    {"unsolicited", LineFault::kUnsolicited},
    {"late", LineFault::kLate},
    {"silence", LineFault::kSilence},
    {"babble", LineFault::kBabble},
};

void print_kinds() {
  for (const HeadKind& kind : alidade::first_kinds_in_turn()) {
    std::cout << kind.name() << " unplugged";
    for (const auto& [name, fault] : kFaults) {
      if (fault != LineFault::kNone && shows(kind.head->abilities, fault)) std::cout << ' ' << name;
    }
    std::cout << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc == 1) {
    print_kinds();
    return 0;
  }
  const std::vector<HeadKind> kinds = alidade::first_kinds_in_turn();
  const auto kind = std::find_if(kinds.begin(), kinds.end(),
                                 [&](const HeadKind& one) { return one.name() == argv[1]; });
  if (argc != 2 || kind == kinds.end()) {
    std::cerr << "usage: link_devices [KIND]; without one, the kinds are told\n";
    return 2;
  }
  alidade::HeadServer head(
      kind->link, simulated_head(*kind, [] {
        const double t = alidade::monotonic_now_s();
        return alidade::HeadPosition{20 * std::cos(t / 2), 10 * std::cos(t / 3), 0};
      }));
  alidade::MjpegServer camera;
  camera.allowed = 0;

  std::atomic<bool> over{false};
  std::thread shutter([&] {
    auto next = std::chrono::steady_clock::now();
    while (!over) {
      ++camera.allowed;
      std::this_thread::sleep_until(next += std::chrono::milliseconds(40));
    }
  });
  std::cout << "ready " << camera.url() << " " << settings_of(*kind, head.address())
            << signs_of(*kind) << std::endl;
  bool plugged = true;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "unplugged" && plugged) {
      head.unplug();
      plugged = false;
    } else if (const auto fault = kFaults.find(line); fault != kFaults.end()) {
      head.fault = fault->second;
      if (!plugged) head.plug();
      plugged = true;
    }
  }
  over = true;
  shutter.join();
}
