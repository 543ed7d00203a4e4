#include "platform/video/v4l2_device.h"

#include <fcntl.h>
#include <grp.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <utility>

namespace alidade {
namespace {

constexpr std::uint32_t kBuffers = 8;     // requested; the driver may give another number
constexpr std::size_t kDriversShare = 2;  // buffers that stay with the driver: one being filled,
                                          // one next

int call(int fd, unsigned long request, void* argument) {
  int result = 0;
  do {
    result = ::ioctl(fd, request, argument);
  } while (result < 0 && errno == EINTR);
  return result;
}

std::string reason(int error) {
  char buffer[128];
  return ::strerror_r(error, buffer, sizeof buffer);
}

// The group that may open the device.
std::string group_of(const std::string& path) {
  struct stat status {};
  struct group entry {};
  struct group* found = nullptr;
  std::array<char, 4096> buffer{};
  if (::stat(path.c_str(), &status) == 0 && status.st_gid != 0 &&
      ::getgrgid_r(status.st_gid, &entry, buffer.data(), buffer.size(), &found) == 0 &&
      found != nullptr) {
    return found->gr_name;
  }
  return "video";
}

double frequency(const v4l2_fract& period) {
  return period.numerator == 0 ? 0 : static_cast<double>(period.denominator) / period.numerator;
}

v4l2_fract period_of(double rate_hz) {
  constexpr std::uint32_t kParts = 10'000;  // a rate of 29.97 is 10000/299700
  return {kParts, static_cast<std::uint32_t>(std::lround(rate_hz * kParts))};
}

}  // namespace

std::string v4l2_call_error(const char* what, int error_number, const std::string& path) {
  switch (error_number) {
    case EACCES:
    case EPERM: {
      const std::string group = group_of(path);
      return "permission denied; the user must be in the group " + group + " (usermod -aG " +
             group + " USER, then log in again)";
    }
    case EBUSY:
      return "busy: another program uses it; end that one (fuser -v " + path + " names it)";
    case ENOENT:
    case ENODEV:
    case ENXIO:
      return "no such device; is the camera plugged in? (ls /dev/video* lists what is)";
    case ENOSPC:
      return "the USB bus has no bandwidth left; use a smaller size or rate, MJPG, or a port on "
             "another bus (lsusb -t)";
    case ENOLINK:
    case ENOLCK:
      return "no usable signal at the input; is its source on and connected? (on CSI: are the "
             "links set? media-ctl -p)";
    default:
      return std::string(what) + ": " + reason(error_number);
  }
}

V4l2Device::Mapping::~Mapping() { ::munmap(data_, size_); }

// mremap() replaces the memory in one step, unnoticed by a thread that reads it.
void V4l2Device::Mapping::detach() {
  void* copy = ::mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (copy == MAP_FAILED) {
    return;
  }
  std::memcpy(copy, data_, size_);
  if (::mremap(copy, size_, size_, MREMAP_MAYMOVE | MREMAP_FIXED, data_) == MAP_FAILED) {
    ::munmap(copy, size_);
  }
}

V4l2Device::Result V4l2Device::fail(Result result, const std::string& error) {
  error_ = error;
  return result;
}

V4l2Device::Result V4l2Device::fail_call(const char* what, int error_number) {
  return fail(error_number == EACCES || error_number == EPERM ? Result::kDenied : Result::kLost,
              v4l2_call_error(what, error_number, path_));
}

V4l2Device::Result V4l2Device::open(const std::string& path, const V4l2Wish& wish) {
  path_ = path;
  device_.reset(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!device_.is_open()) {
    return fail_call("cannot be opened", errno);
  }
  Result result = check_kind();
  std::string error;
  if (result == Result::kOk) {
    const auto fourcc = choose_format(list_offers(wish), wish, &error);
    result = fourcc ? set_format(*fourcc, wish) : fail(Result::kUnusable, error);
  }
  if (result == Result::kOk && wish.rate_hz > 0) {
    result = set_rate(wish.rate_hz);
  }
  if (result == Result::kOk) {
    result = start();
  }
  if (result != Result::kOk) {
    close();
  }
  return result;
}

V4l2Device::Result V4l2Device::survey(const std::string& path, std::string* name,
                                      std::vector<V4l2Offer>* offers) {
  path_ = path;
  device_.reset(::open(path.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC));
  if (!device_.is_open()) {
    return fail_call("cannot be opened", errno);
  }
  const Result result = check_kind(name);
  if (result == Result::kOk) {
    *offers = list_offers({});
  }
  close();
  return result;
}

V4l2Device::Result V4l2Device::check_kind(std::string* name) {
  v4l2_capability capability{};
  if (call(device_.get(), VIDIOC_QUERYCAP, &capability) < 0) {
    return errno == ENOTTY || errno == EINVAL
               ? fail(Result::kUnusable, "is no V4L2 device; video devices are /dev/video*")
               : fail_call("VIDIOC_QUERYCAP", errno);
  }
  const std::uint32_t able = (capability.capabilities & V4L2_CAP_DEVICE_CAPS) != 0
                                 ? capability.device_caps
                                 : capability.capabilities;
  const std::string driver(reinterpret_cast<const char*>(capability.driver));
  constexpr std::uint32_t kCaptures = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_VIDEO_CAPTURE_MPLANE;
  if (name != nullptr && ((able & kCaptures) != 0 || driver == "v4l2 loopback")) {
    *name = reinterpret_cast<const char*>(capability.card);
  }
  if ((able & V4L2_CAP_VIDEO_CAPTURE) == 0) {
    if ((able & (V4L2_CAP_VIDEO_CAPTURE_MPLANE | V4L2_CAP_VIDEO_M2M_MPLANE)) != 0) {
      return fail(Result::kUnusable, "is a multi-planar device (driver " + driver +
                                         "), which is not supported; use a single-planar one");
    }
    if (driver == "v4l2 loopback") {
      return fail(Result::kLost, "no program writes pictures to this loopback device yet");
    }
    return fail(Result::kUnusable,
                "is no capture device (driver " + driver +
                    "); cameras often have several /dev/video*: try another one");
  }
  if ((able & V4L2_CAP_STREAMING) == 0) {
    return fail(Result::kUnusable, "cannot stream (driver " + driver + ")");
  }
  return Result::kOk;
}

void V4l2Device::add_rates(std::uint32_t fourcc, int width, int height, V4l2Size* size) const {
  v4l2_frmivalenum interval{};
  interval.pixel_format = fourcc;
  interval.width = static_cast<std::uint32_t>(width);
  interval.height = static_cast<std::uint32_t>(height);
  for (; call(device_.get(), VIDIOC_ENUM_FRAMEINTERVALS, &interval) == 0; ++interval.index) {
    if (interval.type == V4L2_FRMIVAL_TYPE_DISCRETE) {
      const double rate_hz = frequency(interval.discrete);
      size->rates.push_back({rate_hz, rate_hz});
    } else {
      size->rates.push_back({frequency(interval.stepwise.max), frequency(interval.stepwise.min)});
      return;
    }
  }
}

std::vector<V4l2Size> V4l2Device::sizes(std::uint32_t fourcc, const V4l2Wish& wish) const {
  std::vector<V4l2Size> sizes;
  v4l2_frmsizeenum entry{};
  entry.pixel_format = fourcc;
  for (; call(device_.get(), VIDIOC_ENUM_FRAMESIZES, &entry) == 0; ++entry.index) {
    V4l2Size size;
    if (entry.type == V4L2_FRMSIZE_TYPE_DISCRETE) {
      size.least_width = size.greatest_width = static_cast<int>(entry.discrete.width);
      size.least_height = size.greatest_height = static_cast<int>(entry.discrete.height);
      add_rates(fourcc, size.least_width, size.least_height, &size);
      sizes.push_back(size);
    } else {
      size.least_width = static_cast<int>(entry.stepwise.min_width);
      size.least_height = static_cast<int>(entry.stepwise.min_height);
      size.greatest_width = static_cast<int>(entry.stepwise.max_width);
      size.greatest_height = static_cast<int>(entry.stepwise.max_height);
      size.width_step = static_cast<int>(entry.stepwise.step_width);
      size.height_step = static_cast<int>(entry.stepwise.step_height);
      add_rates(fourcc, wish.width > 0 ? wish.width : size.greatest_width,
                wish.height > 0 ? wish.height : size.greatest_height, &size);
      sizes.push_back(size);
      break;
    }
  }
  return sizes;
}

std::vector<V4l2Offer> V4l2Device::list_offers(const V4l2Wish& wish) const {
  std::vector<V4l2Offer> offers;
  v4l2_fmtdesc entry{};
  entry.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  for (; call(device_.get(), VIDIOC_ENUM_FMT, &entry) == 0; ++entry.index) {
    offers.push_back({entry.pixelformat, sizes(entry.pixelformat, wish)});
  }
  return offers;
}

V4l2Device::Result V4l2Device::set_format(std::uint32_t fourcc, const V4l2Wish& wish) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(device_.get(), VIDIOC_G_FMT, &format) < 0) {
    return fail_call("VIDIOC_G_FMT", errno);
  }
  v4l2_pix_format& picture = format.fmt.pix;
  picture.pixelformat = fourcc;
  picture.field = V4L2_FIELD_NONE;
  picture.bytesperline = 0;
  picture.sizeimage = 0;
  if (wish.width > 0) {
    picture.width = static_cast<std::uint32_t>(wish.width);
    picture.height = static_cast<std::uint32_t>(wish.height);
  }
  if (call(device_.get(), VIDIOC_S_FMT, &format) < 0) {
    return fail_call("VIDIOC_S_FMT", errno);
  }
  width_ = static_cast<int>(picture.width);
  height_ = static_cast<int>(picture.height);
  const auto got = v4l2_format_of_code(picture.pixelformat);
  if (picture.pixelformat != fourcc || !got ||
      (wish.width > 0 && (width_ != wish.width || height_ != wish.height))) {
    V4l2Wish made;
    made.format = got;
    made.width = width_;
    made.height = height_;
    return fail(Result::kUnusable,
                "makes " + to_string(made) + " of the " + to_string(wish) + " asked for");
  }
  if (picture.field != V4L2_FIELD_NONE) {
    return fail(Result::kUnusable, "is interlaced; use a progressive mode");
  }
  format_ = *got;
  stride_ = picture.bytesperline;
  const std::size_t least = raw_picture_bytes(format_, width_, 1, 0);
  if (format_ != V4l2Format::kMjpg && stride_ < least) {
    stride_ = least;  // some drivers leave it 0
  }
  return Result::kOk;
}

V4l2Device::Result V4l2Device::set_rate(double rate_hz) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = period_of(rate_hz);
  if (call(device_.get(), VIDIOC_S_PARM, &parameters) < 0 && errno != ENOTTY && errno != EINVAL) {
    return fail_call("VIDIOC_S_PARM", errno);
  }
  parameters.parm.capture.timeperframe = {};
  const bool told = call(device_.get(), VIDIOC_G_PARM, &parameters) == 0 &&
                    parameters.parm.capture.timeperframe.denominator > 0;
  if (!told) {
    return fail(Result::kUnusable, "does not tell its rate; leave rate_hz out");
  }
  const double made_hz = frequency(parameters.parm.capture.timeperframe);
  if (!same_rate(made_hz, rate_hz)) {
    V4l2Wish asked;
    V4l2Wish made;
    asked.rate_hz = rate_hz;
    made.rate_hz = made_hz;
    return fail(Result::kUnusable,
                "runs at " + to_string(made) + " where " + to_string(asked) + " is asked for");
  }
  return Result::kOk;
}

V4l2Device::Result V4l2Device::start() {
  v4l2_requestbuffers request{};
  request.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  request.memory = V4L2_MEMORY_MMAP;
  request.count = kBuffers;
  if (call(device_.get(), VIDIOC_REQBUFS, &request) < 0) {
    return fail_call("VIDIOC_REQBUFS", errno);
  }
  for (std::uint32_t index = 0; index < request.count; ++index) {
    v4l2_buffer buffer{};
    buffer.type = request.type;
    buffer.memory = request.memory;
    buffer.index = index;
    if (call(device_.get(), VIDIOC_QUERYBUF, &buffer) < 0) {
      return fail_call("VIDIOC_QUERYBUF", errno);
    }
    void* data = ::mmap(nullptr, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, device_.get(),
                        buffer.m.offset);
    if (data == MAP_FAILED) {
      return fail_call("mmap", errno);
    }
    mappings_.push_back(std::make_shared<Mapping>(data, buffer.length));
    if (call(device_.get(), VIDIOC_QBUF, &buffer) < 0) {
      return fail_call("VIDIOC_QBUF", errno);
    }
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  if (call(device_.get(), VIDIOC_STREAMON, &type) < 0) {
    return fail_call("VIDIOC_STREAMON", errno);
  }
  return Result::kOk;
}

void V4l2Device::close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!device_.is_open()) {
    return;
  }
  int type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  (void)call(device_.get(), VIDIOC_STREAMOFF, &type);
  for (const std::shared_ptr<Mapping>& mapping : mappings_) {
    if (mapping.use_count() > 1) {
      mapping->detach();
    }
  }
  mappings_.clear();
  device_.reset();
}

V4l2Device::Result V4l2Device::dequeue(Buffer* buffer) {
  v4l2_buffer filled{};
  filled.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  filled.memory = V4L2_MEMORY_MMAP;
  if (call(device_.get(), VIDIOC_DQBUF, &filled) < 0) {
    return errno == EAGAIN ? Result::kNothing : fail_call("VIDIOC_DQBUF", errno);
  }
  if (filled.index >= mappings_.size()) {
    return fail(Result::kLost, "VIDIOC_DQBUF: the driver names a buffer that it has not given");
  }
  const Mapping& mapping = *mappings_[filled.index];
  buffer->index = filled.index;
  buffer->data = mapping.data();
  buffer->bytes = std::min<std::size_t>(filled.bytesused, mapping.size());
  buffer->sequence = filled.sequence;
  buffer->flags = filled.flags;
  buffer->stamp_s = static_cast<double>(filled.timestamp.tv_sec) +
                    1e-6 * static_cast<double>(filled.timestamp.tv_usec);
  return Result::kOk;
}

// If the driver does not take the buffer back, the next poll shows it.
void V4l2Device::give_back(std::uint32_t index) {
  const std::lock_guard<std::mutex> lock(mutex_);
  --held_;
  if (!device_.is_open()) {
    return;
  }
  v4l2_buffer buffer{};
  buffer.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  buffer.memory = V4L2_MEMORY_MMAP;
  buffer.index = index;
  (void)call(device_.get(), VIDIOC_QBUF, &buffer);
}

std::shared_ptr<const void> V4l2Device::hold(std::uint32_t index) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++held_;
  }
  const std::shared_ptr<Mapping>& mapping = mappings_[index];
  return {mapping->data(),
          [device = shared_from_this(), mapping, index](const void*) { device->give_back(index); }};
}

bool V4l2Device::can_lend() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return held_ + kDriversShare <= mappings_.size();
}

}  // namespace alidade
