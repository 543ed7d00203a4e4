#include "platform/discovery/local_devices.h"

#include <fcntl.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <system_error>

#include "platform/system/file_descriptor.h"
#include "platform/system/text.h"
#include "platform/video/v4l2_device.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDeviceFiles = 256;

// The entries of a folder, sorted: video2 before video10. Empty if there is no such folder.
std::vector<std::string> names_in(const std::string& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator at(folder, error);
       !error && at != fs::directory_iterator() && names.size() < 4096; at.increment(error))
    names.push_back(at->path().filename().string());
  std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
    return std::make_pair(a.size(), a) < std::make_pair(b.size(), b);
  });
  return names;
}

std::string path_in(const std::string& folder, const std::string& name) {
  return std::string(folder).append("/").append(name);
}

// Device file -> its link in a folder by-id, whose name stays when it is plugged in elsewhere.
std::map<std::string, std::string> stable_names(const std::string& folder) {
  std::map<std::string, std::string> names;
  for (const std::string& name : names_in(folder)) {
    std::error_code error;
    const std::string link = path_in(folder, name);
    const fs::path node = fs::canonical(link, error);
    if (!error) names.emplace(node.string(), link);
  }
  return names;
}

std::string path_of(const std::map<std::string, std::string>& names, const std::string& node) {
  std::error_code error;
  const fs::path real = fs::canonical(node, error);
  const auto found = names.find(error ? node : real.string());
  return found == names.end() ? node : found->second;
}

bool begins_with_digits_behind(const std::string& name, const std::string& beginning) {
  return name.size() > beginning.size() && name.compare(0, beginning.size(), beginning) == 0 &&
         name.find_first_not_of("0123456789", beginning.size()) == std::string::npos;
}

std::string line_in(const fs::path& file) {
  std::ifstream stream(file);
  std::string line;
  std::getline(stream, line);
  return std::string(first_line(line));
}

// "FTDI FT232R USB UART" of the nearest USB device above; else the driver's name.
std::string hardware_name(const fs::path& device) {
  std::error_code error;
  fs::path above = fs::canonical(device, error);
  for (int level = 0; !error && level < 6 && above.has_relative_path(); ++level) {
    const std::string product = line_in(above / "product");
    const std::string maker = line_in(above / "manufacturer");
    if (!product.empty())
      return maker.empty() ? product : std::string(maker).append(" ").append(product);
    above = above.parent_path();
  }
  const fs::path driver = fs::read_symlink(device / "driver", error);
  const std::string name = error ? std::string() : driver.filename().string();
  return name == "port" ? "of the board" : name;  // the kernel's word for any UART
}

// True for a port of the board's UART driver without a chip behind it.
bool is_phantom(int descriptor) {
  serial_struct serial{};
  return ::ioctl(descriptor, TIOCGSERIAL, &serial) == 0 && serial.type == PORT_UNKNOWN;
}

}  // namespace

std::vector<VideoDevice> list_video_devices(const std::string& dev) {
  std::vector<VideoDevice> devices;
  const auto by_id = stable_names(dev + "/v4l/by-id");
  for (const std::string& name : names_in(dev)) {
    if (!begins_with_digits_behind(name, "video") || devices.size() == kMostDeviceFiles) continue;
    VideoDevice device;
    device.node = path_in(dev, name);
    device.path = path_of(by_id, device.node);
    V4l2Device opened;
    switch (opened.survey(device.node, &device.name, &device.offers)) {
      case V4l2Device::Result::kOk:
        break;
      case V4l2Device::Result::kUnusable:
        if (device.name.empty()) continue;  // not a camera
        [[fallthrough]];
      default:
        device.error = opened.error();
    }
    devices.push_back(std::move(device));
  }
  return devices;
}

std::vector<SerialPort> list_serial_ports(const std::string& dev, const std::string& sys) {
  std::vector<SerialPort> ports;
  const auto by_id = stable_names(dev + "/serial/by-id");
  for (const std::string& name : names_in(sys + "/class/tty")) {
    const fs::path device = fs::path(sys) / "class/tty" / name / "device";
    std::error_code ignored;
    if (!fs::exists(device, ignored) || ports.size() == kMostDeviceFiles) continue;
    SerialPort port;
    port.node = path_in(dev, name);
    if (!fs::exists(port.node, ignored)) continue;
    const FileDescriptor opened(
        ::open(port.node.c_str(), O_RDWR | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
    const int reason = errno;
    if (opened.is_open() && is_phantom(opened.get())) continue;
    if (!opened.is_open()) {
      if (reason == EIO || reason == ENXIO || reason == ENODEV) continue;  // no hardware
      port.error = reason == EACCES ? "permission denied; the user must be in the group dialout "
                                      "(usermod -aG dialout USER, then log in again)"
                                    : std::strerror(reason);
    }
    port.path = path_of(by_id, port.node);
    port.name = hardware_name(device);
    ports.push_back(std::move(port));
  }
  return ports;
}

}  // namespace alidade
