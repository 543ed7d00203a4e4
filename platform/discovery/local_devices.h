#pragma once
// What is plugged into this machine: cameras (V4L2) and serial ports. Only asked what they are;
// nothing is set, and nothing is sent over a serial line.

#include <string>
#include <vector>

#include "platform/video/v4l2_mode.h"

namespace alidade {

struct VideoDevice {
  std::string path;  // /dev/v4l/by-id/... if there is one: it survives replugging; else /dev/video0
  std::string node;  // /dev/video0
  std::string name;  // of the camera, as the driver has it
  std::vector<V4l2Offer> offers;
  std::string error;  // why it cannot be used; one line
};

// At most 256. Devices that only serve other purposes (metadata, encoders) are left out.
[[nodiscard]] std::vector<VideoDevice> list_video_devices(const std::string& dev = "/dev");

struct SerialPort {
  std::string path;   // /dev/serial/by-id/... if there is one, else /dev/ttyUSB0
  std::string node;   // /dev/ttyUSB0
  std::string name;   // of the converter, by USB; or the driver's
  std::string error;  // why it cannot be opened; one line
};

// At most 256. Ports without hardware behind them are left out.
[[nodiscard]] std::vector<SerialPort> list_serial_ports(const std::string& dev = "/dev",
                                                        const std::string& sys = "/sys");

}  // namespace alidade
