#pragma once
// What a V4L2 device offers, what is wanted of it, and the choice; and the luma of its raw pictures.
//
// Pure: neither device nor system call. The kernel's lists (VIDIOC_ENUM_FMT, _FRAMESIZES,
// _FRAMEINTERVALS) come in as V4l2Offer. Drivers may leave sizes and rates untold; such an offer is
// taken to hold everything, and what the device then makes of it has to be looked at.
// Where no format is wanted, the first in the order of V4l2Format that fits is chosen: luma that can
// be used as it lies in memory first, then packed pixels, compressed pictures last.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

enum class V4l2Format {
  kGrey,  // 8-bit luma
  kNv12,  // 8-bit luma, then chroma
  kYuyv,  // Y U Y V
  kUyvy,  // U Y V Y
  kMjpg   // JPEG pictures
};

[[nodiscard]] const char* to_string(V4l2Format format);  // as in V4L2: GREY, NV12, ...
[[nodiscard]] std::optional<V4l2Format> v4l2_format_of_name(const std::string& name);
[[nodiscard]] std::optional<V4l2Format> v4l2_format_of_code(std::uint32_t fourcc);

// Frame sizes from the least to the greatest in steps, and the rates at these sizes.
struct V4l2Size {
  struct Rates {
    double least_hz;
    double greatest_hz;
  };
  int least_width = 0;   // px
  int least_height = 0;  // px
  int greatest_width = 0;
  int greatest_height = 0;
  int width_step = 1;
  int height_step = 1;
  std::vector<Rates> rates;  // empty: not told
};

struct V4l2Offer {
  std::uint32_t fourcc = 0;
  std::vector<V4l2Size> sizes;  // empty: not told
};

struct V4l2Wish {
  std::optional<V4l2Format> format;
  int width = 0;  // px; 0: whatever the device is set to
  int height = 0;
  double rate_hz = 0;  // 0: whatever the device is set to
};

// "GREY 1280x720 at 60 Hz"; what is not wished is left out.
[[nodiscard]] std::string to_string(const V4l2Wish& wish);

// Whether two rates are the same within half a percent: 29.97 is sold as 30.
[[nodiscard]] bool same_rate(double a_hz, double b_hz);

// The format to set. Empty: *error says in one line what is wanted and what is offered.
[[nodiscard]] std::optional<std::uint32_t> choose_format(const std::vector<V4l2Offer>& offers,
                                                         const V4l2Wish& wish, std::string* error);

// Bytes of a raw picture from its first to the last of its luma; stride in bytes.
[[nodiscard]] std::size_t raw_picture_bytes(V4l2Format format, int width, int height,
                                            std::size_t stride);

// Where the luma begins, and how many bytes from one pixel to the next.
[[nodiscard]] std::size_t luma_offset(V4l2Format format);
[[nodiscard]] std::size_t luma_step(V4l2Format format);

// Writes the luma of a raw picture, row after row without gaps.
void copy_luma(V4l2Format format, const std::uint8_t* picture, int width, int height,
               std::size_t stride, std::uint8_t* luma);

}  // namespace alidade
