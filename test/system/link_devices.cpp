// link_devices: a camera that sends MJPEG over HTTP at 25 Hz, and a Pelco-D head that moves, on a serial
// line (a pseudo-terminal). Prints "ready URL DEVICE"; each line of stdin is what the line has from then
// on: unplugged, or a fault of HeadServer by its name (none, noise, lost_byte, changed_byte, merged,
// repeated, unsolicited, late, silence, babble). Ends with stdin.

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <thread>

#include "platform/system/clock.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/simulator/servers/head_server.h"

int main() {
  using alidade::LineFault;
  const std::map<std::string, LineFault> faults = {
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
  alidade::MjpegServer camera;
  camera.allowed = 0;
  const auto position = [] {
    const double t = alidade::monotonic_now_s();
    return alidade::HeadPosition{20 * std::cos(t / 2), 10 * std::cos(t / 3), 0};
  };
  alidade::HeadServer head(alidade::HeadServer::Link::kSerial,
                           std::make_unique<alidade::PelcoDHead>(position));

  std::atomic<bool> over{false};
  std::thread shutter([&] {
    auto next = std::chrono::steady_clock::now();
    while (!over) {
      ++camera.allowed;
      std::this_thread::sleep_until(next += std::chrono::milliseconds(40));
    }
  });
  std::cout << "ready " << camera.url() << " " << head.address() << std::endl;
  bool plugged = true;
  for (std::string line; std::getline(std::cin, line);) {
    if (line == "unplugged" && plugged) {
      head.unplug();
      plugged = false;
    } else if (const auto fault = faults.find(line); fault != faults.end()) {
      head.fault = fault->second;
      if (!plugged) head.plug();
      plugged = true;
    }
  }
  over = true;
  shutter.join();
}
