// loopback_camera DEVICE WIDTH HEIGHT RATE_HZ: feeds a v4l2loopback device until it is killed.

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>

#include "test/system/virtual_machine/kernel_camera.h"

int main(int count, char** arguments) {
  try {
    if (count != 5) {
      throw std::runtime_error("usage: loopback_camera DEVICE WIDTH HEIGHT RATE_HZ");
    }
    const alidade::LoopbackCamera camera(arguments[1], std::atoi(arguments[2]),
                                         std::atoi(arguments[3]), std::atof(arguments[4]));
    std::puts("ready");
    std::fflush(stdout);
    ::pause();
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "loopback_camera: %s\n", error.what());
    return 1;
  }
}
