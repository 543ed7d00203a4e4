#pragma once
// The modes that a V4L2 device offers, the wish of the user, and the choice; also the luma of raw
// pictures. No system calls: the kernel's lists (VIDIOC_ENUM_FMT, _FRAMESIZES, _FRAMEINTERVALS) are
// passed as V4l2Offer. A driver may list no sizes or no rates. Such an offer is assumed to include
// all, and the caller must check which size and rate the device then sets. Without a wished format,
// the first fitting one in the order of V4l2Format is chosen, of those with listed sizes if there
// are any: luma that is usable in place before packed pixels, compressed pictures last.

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

[[nodiscard]] const char* to_string(V4l2Format format);  // V4L2's names: GREY, NV12, ...
// nullopt: none of these formats.
[[nodiscard]] std::optional<V4l2Format> v4l2_format_of_name(const std::string& name);
[[nodiscard]] std::optional<V4l2Format> v4l2_format_of_code(std::uint32_t fourcc);

// Frame sizes from least to greatest in steps, and the rates at these sizes.
struct V4l2Size {
  struct Rates {
    double least_hz;
    double greatest_hz;
  };
  int least_width = 0;   // px
  int least_height = 0;  // px
  int greatest_width = 0;
  int greatest_height = 0;
  int width_step = 1;  // px; 1 or less: any
  int height_step = 1;
  std::vector<Rates> rates;  // empty: not listed
};

struct V4l2Offer {
  std::uint32_t fourcc = 0;
  std::vector<V4l2Size> sizes;  // empty: not listed
};

struct V4l2Wish {
  std::optional<V4l2Format> format;  // nullopt: any
  int width = 0;                     // px; 0: the device's current setting, of width and height
  int height = 0;
  double rate_hz = 0;  // 0: the device's current setting
};

// "GREY 1280x720 at 60 Hz"; parts without a wish are left out.
[[nodiscard]] std::string to_string(const V4l2Wish& wish);

// True if the rates (0 or more) agree within half a per cent of the larger: 29.97 is called 30.
[[nodiscard]] bool same_rate(double a_hz, double b_hz);

// The fourcc of the format to set. nullopt: none fits, and *error is one line with the wish and the
// offers.
[[nodiscard]] std::optional<std::uint32_t> choose_format(const std::vector<V4l2Offer>& offers,
                                                         const V4l2Wish& wish, std::string* error);

// For all formats except kMjpg. The least bytes that hold all luma of a raw picture: from its first
// byte to the end of the last pixel, with the chroma that lies between luma (YUYV, UYVY), without
// NV12's chroma plane. width, height: px, at least 1; stride: bytes from row to row.
[[nodiscard]] std::size_t raw_picture_bytes(V4l2Format format, int width, int height,
                                            std::size_t stride);

// Likewise: offset of the first luma byte within a picture, and bytes from one pixel's luma to the
// next one's.
[[nodiscard]] std::size_t luma_offset(V4l2Format format);
[[nodiscard]] std::size_t luma_step(V4l2Format format);

// Likewise: writes the luma of a raw picture, without gaps between rows: width * height bytes.
// picture: raw_picture_bytes() or more.
void copy_luma(V4l2Format format, const std::uint8_t* picture, int width, int height,
               std::size_t stride, std::uint8_t* luma);

}  // namespace alidade
