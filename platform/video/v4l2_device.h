#pragma once
// V4l2Device: one opening of a V4L2 capture device, from negotiation to closing: dequeues filled
// buffers, lends them and gives them back. Part of V4l2Source. Single-planar capture by mmap
// streaming. A buffer goes back to the driver when the last owner of hold()'s result is gone, on
// any thread. At close() ordinary memory with the same content replaces each buffer still held, at
// the same address. The driver's memory would keep the device open and, once it is unplugged, its
// number in /dev/video* taken.
// One thread opens, dequeues and closes; owners may end on any. To be made by std::make_shared().

#include <sys/types.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "platform/system/file_descriptor.h"
#include "platform/video/v4l2_mode.h"

namespace alidade {

// The message to the user for a failed call with this errno: one line without the device's name.
[[nodiscard]] std::string v4l2_call_error(const char* what, int error_number,
                                          const std::string& path);

class V4l2Device : public std::enable_shared_from_this<V4l2Device> {
 public:
  enum class Result {
    kOk,
    kNothing,  // no buffer is filled yet
    kLost,     // gone, busy or out of order; may recover; see error()
    kDenied,   // no permission; also temporary for a device just plugged in; see error()
    kUnusable  // will not work as it is; see error()
  };

  struct Buffer {
    std::uint32_t index = 0;
    const std::uint8_t* data = nullptr;
    std::size_t bytes = 0;       // used by the picture
    std::uint32_t sequence = 0;  // the driver's count
    std::uint32_t flags = 0;     // V4L2_BUF_FLAG_...
    double stamp_s = 0;          // s, on the clock that flags name
  };

  V4l2Device() = default;
  ~V4l2Device() { close(); }
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  // Opens, negotiates and starts streaming. Unless kOk, the device is closed again.
  [[nodiscard]] Result open(const std::string& path, const V4l2Wish& wish);
  void close();
  // Asks a device what it is and offers, and closes it; nothing is set. *name is set if it is a
  // capture device.
  [[nodiscard]] Result survey(const std::string& path, std::string* name,
                              std::vector<V4l2Offer>* offers);

  // Readable in poll() when a buffer is filled.
  [[nodiscard]] int fd() const { return device_.get(); }
  // After kOk call hold() next.
  [[nodiscard]] Result dequeue(Buffer* buffer);
  [[nodiscard]] std::shared_ptr<const void> hold(std::uint32_t index);
  // True if the buffers held now may be kept for any time, as the driver has enough others.
  [[nodiscard]] bool can_lend();

  // The negotiated format.
  [[nodiscard]] V4l2Format format() const { return format_; }
  [[nodiscard]] int width() const { return width_; }            // px
  [[nodiscard]] int height() const { return height_; }          // px
  [[nodiscard]] std::size_t stride() const { return stride_; }  // bytes; of raw formats

  // One line without the device's name; valid after kLost, kDenied and kUnusable.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  // Memory shared with the driver.
  class Mapping {
   public:
    Mapping(void* data, std::size_t size) : data_(data), size_(size) {}
    ~Mapping();
    Mapping(const Mapping&) = delete;
    Mapping& operator=(const Mapping&) = delete;
    [[nodiscard]] const std::uint8_t* data() const {
      return static_cast<const std::uint8_t*>(data_);
    }
    [[nodiscard]] std::size_t size() const { return size_; }
    void detach();  // from the driver; the bytes stay

   private:
    void* data_;
    std::size_t size_;
  };

  Result check_kind(std::string* name = nullptr);
  std::vector<V4l2Offer> list_offers(const V4l2Wish& wish) const;
  std::vector<V4l2Size> sizes(std::uint32_t fourcc, const V4l2Wish& wish) const;
  void add_rates(std::uint32_t fourcc, int width, int height, V4l2Size* size) const;
  Result set_format(std::uint32_t fourcc, const V4l2Wish& wish);
  Result set_rate(double rate_hz);
  Result start();
  void give_back(std::uint32_t index);
  Result fail(Result result, const std::string& error);
  Result fail_call(const char* what, int error_number);

  std::string path_;
  std::string error_;
  V4l2Format format_ = V4l2Format::kGrey;
  int width_ = 0;
  int height_ = 0;
  std::size_t stride_ = 0;  // bytes; for raw formats

  // Guards device_ against an owner that ends while the device is being closed.
  std::mutex mutex_;
  FileDescriptor device_;
  std::size_t held_ = 0;                            // guarded by mutex_
  std::vector<std::shared_ptr<Mapping>> mappings_;  // by index
};

}  // namespace alidade
