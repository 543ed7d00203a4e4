// link_devices HEAD LINK: a camera that sends MJPEG over HTTP at 25 Hz, and a head (one of kHeadModels) that
// moves, on a line (serial, which is a pseudo-terminal, tcp, udp). At t of CLOCK_MONOTONIC its pan is 20 cos(t/2)
// degrees to the right, its tilt 10 cos(t/3) up. Prints "ready URL ADDRESS"; each line of stdin is what the
// line has from then on: unplugged, or a fault of HeadServer by its name (none, noise, lost_byte, changed_byte, merged,
// repeated, unsolicited, late, silence, babble). Ends with stdin.

#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <string>
#include <thread>
#include <utility>

#include "platform/system/clock.h"
#include "test/platform/support/mjpeg_server.h"
#include "test/simulator/servers/head_server.h"

namespace {

using Position = std::function<alidade::HeadPosition()>;

// VISCA in datagrams has its header. Null: no head is called so.
std::unique_ptr<alidade::SimulatedHead> head_named(const std::string& name, bool datagrams,
                                                   const Position& position) {
  for (const alidade::NamedHeadModel& named : alidade::kHeadModels) {
    if (named.name != name) continue;
    auto head = make_simulated_head(named.model, position);
    if (auto* visca = dynamic_cast<alidade::ViscaHead*>(head.get())) visca->header = datagrams;
    return head;
  }
  return nullptr;
}

}  // namespace

int main(int argc, char** argv) {
  using alidade::LineFault;
  using Link = alidade::HeadServer::Link;
  const std::map<std::string, Link> links = {
      {"serial", Link::kSerial}, {"tcp", Link::kTcp}, {"udp", Link::kUdp}};
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
  const Position position = [] {
    const double t = alidade::monotonic_now_s();
    return alidade::HeadPosition{20 * std::cos(t / 2), 10 * std::cos(t / 3), 0};
  };
  const auto link = links.find(argc == 3 ? argv[2] : "");
  auto its_head =
      link == links.end() ? nullptr : head_named(argv[1], link->second == Link::kUdp, position);
  if (!its_head) {
    std::cerr << "usage: link_devices HEAD serial|tcp|udp; heads:";
    for (const auto& named : alidade::kHeadModels) std::cerr << ' ' << named.name;
    std::cerr << '\n';
    return 2;
  }
  alidade::HeadServer head(link->second, std::move(its_head));
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
