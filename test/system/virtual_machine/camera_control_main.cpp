// camera_control DEVICE NAME VALUE: sets a control of a camera by its name.

#include <cstdio>
#include <cstdlib>
#include <exception>

#include "test/system/virtual_machine/kernel_camera.h"

int main(int count, char** arguments) {
  try {
    if (count != 4) {
      throw std::runtime_error("usage: camera_control DEVICE NAME VALUE");
    }
    alidade::set_control(arguments[1], arguments[2], std::atoi(arguments[3]));
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "camera_control: %s\n", error.what());
    return 1;
  }
}
