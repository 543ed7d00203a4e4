// simulated_head LINK: a Pelco-D head on a pseudo-terminal, reachable by the symbolic link LINK, that
// swings: pan 20 sin(t), tilt 5 + 5 cos(t) degrees, t seconds of CLOCK_MONOTONIC. Until it is killed.

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "platform/system/clock.h"
#include "test/simulator/servers/head_server.h"

int main(int count, char** arguments) {
  if (count != 2) {
    std::fputs("usage: simulated_head LINK\n", stderr);
    return 2;
  }
  const alidade::HeadServer server(
      alidade::HeadServer::Link::kSerial, std::make_unique<alidade::PelcoDHead>([] {
        const double t = alidade::monotonic_now_s();
        return alidade::HeadPosition{20 * std::sin(t), 5 + 5 * std::cos(t), 0};
      }));
  std::filesystem::create_symlink(server.address(), arguments[1]);
  ::pause();
}
