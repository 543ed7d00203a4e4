// Device files as the kernel and udev leave them.

#include "platform/discovery/local_devices.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <stdlib.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "platform/system/file_descriptor.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

using ::testing::IsEmpty;
using ::testing::SizeIs;

// A pseudo-terminal stands for the line; sysfs is a copy of how a USB converter looks there.
TEST(SerialPorts, AreNamedByWhatStaysWhenReplugged) {
  const TemporaryDirectory top;
  const FileDescriptor head(::posix_openpt(O_RDWR | O_NOCTTY));
  ASSERT_TRUE(head.is_open());
  ASSERT_EQ(::grantpt(head.get()), 0);
  ASSERT_EQ(::unlockpt(head.get()), 0);
  const fs::path dev = fs::path(top.path()) / "dev";
  const fs::path sys = fs::path(top.path()) / "sys";
  fs::create_directories(dev / "serial/by-id");
  const std::string line = ::ptsname(head.get());
  fs::create_symlink(line, dev / "ttyUSB0");
  fs::create_symlink(line, dev / "serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0");
  fs::create_directories(sys / "devices/usb1/1-1/1-1:1.0/ttyUSB0");
  std::ofstream(sys / "devices/usb1/1-1/product") << "FT232R USB UART\n";
  std::ofstream(sys / "devices/usb1/1-1/manufacturer") << "FTDI\n";
  fs::create_directories(sys / "class/tty/ttyUSB0");
  fs::create_symlink(sys / "devices/usb1/1-1/1-1:1.0/ttyUSB0", sys / "class/tty/ttyUSB0/device");
  fs::create_directories(sys / "class/tty/tty0");            // a console: no device
  fs::create_directories(sys / "class/tty/ttyUSB7/device");  // unplugged meanwhile

  const auto ports = list_serial_ports(dev.string(), sys.string());
  ASSERT_THAT(ports, SizeIs(1));
  EXPECT_EQ(ports[0].node, (dev / "ttyUSB0").string());
  EXPECT_EQ(ports[0].path, (dev / "serial/by-id/usb-FTDI_FT232R_A50285BI-if00-port0").string());
  EXPECT_EQ(ports[0].name, "FTDI FT232R USB UART");
  EXPECT_THAT(ports[0].error, IsEmpty());
}

TEST(VideoDevices, WhatIsNoCameraIsLeftOut) {
  const TemporaryDirectory top;
  std::ofstream(fs::path(top.path()) / "video0") << "no device";
  std::ofstream(fs::path(top.path()) / "videotape") << "no device";
  EXPECT_THAT(list_video_devices(top.path()), IsEmpty());
  EXPECT_THAT(list_video_devices(top.path() + "/none"), IsEmpty());
  EXPECT_THAT(list_serial_ports(top.path(), top.path()), IsEmpty());
}

}  // namespace
}  // namespace alidade
