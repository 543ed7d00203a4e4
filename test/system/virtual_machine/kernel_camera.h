#pragma once
// The virtual machine's cameras as their makers see them: controls of vivid by name, and pictures
// written into v4l2loopback.

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <cstring>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "test/platform/support/picture_files.h"

namespace alidade {

inline void check_call(int result, const std::string& what) {
  if (result < 0) {
    throw std::runtime_error(what + ": " + std::strerror(errno));
  }
}

// Opens the device for itself, as v4l2-ctl does.
inline void set_control(const std::string& device, const std::string& name, int value) {
  const int fd = ::open(device.c_str(), O_RDWR);
  check_call(fd, device);
  v4l2_query_ext_ctrl found{};
  found.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (::ioctl(fd, VIDIOC_QUERY_EXT_CTRL, &found) == 0 && name != found.name) {
    found.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  v4l2_control control{};
  control.id = found.id;
  control.value = value;
  const int result = name == found.name ? ::ioctl(fd, VIDIOC_S_CTRL, &control) : -1;
  ::close(fd);
  check_call(result, device + ": " + name);
}

// Feeds a v4l2loopback device with JPEG pictures whose grey is 20 + 10 (n mod 8).
class LoopbackCamera {
 public:
  LoopbackCamera(const std::string& device, int width, int height, double rate_hz)
      : fd_(::open(device.c_str(), O_RDWR)) {
    check_call(fd_, device);
    // What the device can do is what it could when it was asked last.
    v4l2_capability capability{};
    check_call(::ioctl(fd_, VIDIOC_QUERYCAP, &capability), device + ": VIDIOC_QUERYCAP");
    v4l2_format format{};
    format.type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    format.fmt.pix.width = static_cast<std::uint32_t>(width);
    format.fmt.pix.height = static_cast<std::uint32_t>(height);
    format.fmt.pix.pixelformat = V4L2_PIX_FMT_MJPEG;
    format.fmt.pix.field = V4L2_FIELD_NONE;
    format.fmt.pix.sizeimage = static_cast<std::uint32_t>(width * height);
    check_call(::ioctl(fd_, VIDIOC_S_FMT, &format), device + ": VIDIOC_S_FMT");
    // From now on it is a camera. Who only writes is not noticed when he goes.
    int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
    check_call(::ioctl(fd_, VIDIOC_STREAMON, &type), device + ": VIDIOC_STREAMON");
    std::vector<std::string> pictures;
    for (int n = 0; n < 8; ++n) {
      pictures.push_back(picture_file("mjpeg", width, height, 20 + 10 * n));
    }
    thread_ = std::thread([this, pictures = std::move(pictures), rate_hz] {
      auto next = std::chrono::steady_clock::now();
      for (std::size_t n = 0; !over_; ++n) {
        const std::string& picture = pictures[n % pictures.size()];
        if (!silent) {
          (void)!::write(fd_, picture.data(), picture.size());
        }
        next += std::chrono::nanoseconds(static_cast<std::int64_t>(1e9 / rate_hz));
        std::this_thread::sleep_until(next);  // the camera's pace
      }
    });
  }
  ~LoopbackCamera() {
    over_ = true;
    thread_.join();
    ::close(fd_);
  }
  LoopbackCamera(const LoopbackCamera&) = delete;
  LoopbackCamera& operator=(const LoopbackCamera&) = delete;

  std::atomic<bool> silent{false};

 private:
  int fd_;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

}  // namespace alidade
