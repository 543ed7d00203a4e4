#include "platform/video/v4l2_mode.h"

#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstring>

namespace alidade {
namespace {

struct KnownFormat {
  V4l2Format format;
  const char* name;
  std::uint32_t fourcc;
};

constexpr std::array<KnownFormat, 6> kFormats = {{
    {V4l2Format::kGrey, "GREY", V4L2_PIX_FMT_GREY},
    {V4l2Format::kNv12, "NV12", V4L2_PIX_FMT_NV12},
    {V4l2Format::kYuyv, "YUYV", V4L2_PIX_FMT_YUYV},
    {V4l2Format::kUyvy, "UYVY", V4L2_PIX_FMT_UYVY},
    {V4l2Format::kMjpg, "MJPG", V4L2_PIX_FMT_MJPEG},
    {V4l2Format::kMjpg, "MJPG", V4L2_PIX_FMT_JPEG},
}};

std::string fourcc_name(std::uint32_t fourcc) {
  if (const auto format = v4l2_format_of_code(fourcc)) {
    return to_string(*format);
  }
  std::string name;
  for (int shift = 0; shift < 32; shift += 8) {
    const char letter = static_cast<char>((fourcc >> shift) & 0x7FU);
    if (letter > ' ' && letter < 0x7F) {
      name += letter;
    }
  }
  return name;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

std::string size_text(int width, int height) {
  return std::to_string(width) + "x" + std::to_string(height);
}

template <class Items, class Text>
std::string joined(const Items& items, const char* separator, Text text) {
  std::string line;
  for (const auto& item : items) {
    line += (line.empty() ? "" : separator) + text(item);
  }
  return line;
}

bool in_steps(int value, int least, int greatest, int step) {
  return value >= least && value <= greatest && (step <= 1 || (value - least) % step == 0);
}

bool holds_size(const V4l2Size& size, const V4l2Wish& wish) {
  return wish.width == 0 ||
         (in_steps(wish.width, size.least_width, size.greatest_width, size.width_step) &&
          in_steps(wish.height, size.least_height, size.greatest_height, size.height_step));
}

bool holds_rate(const V4l2Size& size, const V4l2Wish& wish) {
  const auto holds = [&](const V4l2Size::Rates& rates) {
    return (wish.rate_hz >= rates.least_hz && wish.rate_hz <= rates.greatest_hz) ||
           same_rate(wish.rate_hz, rates.least_hz) || same_rate(wish.rate_hz, rates.greatest_hz);
  };
  return wish.rate_hz == 0 || size.rates.empty() ||
         std::any_of(size.rates.begin(), size.rates.end(), holds);
}

std::string sizes_text(const V4l2Offer& offer) {
  return joined(offer.sizes, ", ", [](const V4l2Size& size) {
    const std::string least = size_text(size.least_width, size.least_height);
    const std::string greatest = size_text(size.greatest_width, size.greatest_height);
    return least == greatest ? least : least + " to " + greatest;
  });
}

// Rates of the sizes that fit the wish.
std::string rates_text(const V4l2Offer& offer, const V4l2Wish& wish) {
  std::vector<std::string> rates;
  for (const V4l2Size& size : offer.sizes) {
    if (!holds_size(size, wish)) {
      continue;
    }
    for (const V4l2Size::Rates& range : size.rates) {
      const std::string text = same_rate(range.least_hz, range.greatest_hz)
                                   ? number(range.greatest_hz)
                                   : number(range.least_hz) + " to " + number(range.greatest_hz);
      if (std::find(rates.begin(), rates.end(), text) == rates.end()) {
        rates.push_back(text);
      }
    }
  }
  return joined(rates, ", ", [](const std::string& rate) { return rate; }) + " Hz";
}

}  // namespace

const char* to_string(V4l2Format format) {
  const auto* known = std::find_if(kFormats.begin(), kFormats.end(),
                                   [&](const KnownFormat& k) { return k.format == format; });
  return known->name;
}

std::optional<V4l2Format> v4l2_format_of_name(const std::string& name) {
  for (const KnownFormat& known : kFormats) {
    if (name == known.name) {
      return known.format;
    }
  }
  return std::nullopt;
}

std::optional<V4l2Format> v4l2_format_of_code(std::uint32_t fourcc) {
  for (const KnownFormat& known : kFormats) {
    if (fourcc == known.fourcc) {
      return known.format;
    }
  }
  return std::nullopt;
}

std::string to_string(const V4l2Wish& wish) {
  std::string text = wish.format ? to_string(*wish.format) : "";
  if (wish.width > 0) {
    text += (text.empty() ? "" : " ") + size_text(wish.width, wish.height);
  }
  if (wish.rate_hz > 0) {
    text += (text.empty() ? "" : " at ") + number(wish.rate_hz) + " Hz";
  }
  return text;
}

bool same_rate(double a_hz, double b_hz) {
  constexpr double kTolerance = 0.005;
  return std::abs(a_hz - b_hz) <= kTolerance * std::max(a_hz, b_hz);
}

std::optional<std::uint32_t> choose_format(const std::vector<V4l2Offer>& offers,
                                           const V4l2Wish& wish, std::string* error) {
  std::vector<V4l2Offer> fitting;
  for (const KnownFormat& known : kFormats) {
    if (wish.format && known.format != *wish.format) {
      continue;
    }
    for (const V4l2Offer& offer : offers) {
      if (offer.fourcc == known.fourcc) {
        fitting.push_back(offer);
      }
    }
  }
  V4l2Wish said;  // the part of the wish considered so far, for the message
  said.format = wish.format;
  if (fitting.empty()) {
    *error = "offers " +
             (wish.format ? std::string("no ") + to_string(*wish.format)
                          : "none of GREY, NV12, YUYV, UYVY, MJPG") +
             "; it offers " +
             (offers.empty() ? "no format at all" : joined(offers, ", ", [](const V4l2Offer& o) {
               return fourcc_name(o.fourcc);
             }));
    return std::nullopt;
  }
  const auto leave_out = [&](auto holds) {
    const auto misses = [&](const V4l2Offer& offer) {
      return !offer.sizes.empty() && std::none_of(offer.sizes.begin(), offer.sizes.end(), holds);
    };
    fitting.erase(std::remove_if(fitting.begin(), fitting.end(), misses), fitting.end());
  };
  const auto refuse = [&](const std::vector<V4l2Offer>& before, auto detail) {
    *error = "offers no " + to_string(said) + "; it offers " +
             joined(before, "; ", [&](const V4l2Offer& offer) {
               return fourcc_name(offer.fourcc) + " " + detail(offer);
             });
    return std::nullopt;
  };

  std::vector<V4l2Offer> before = fitting;
  said.width = wish.width;
  said.height = wish.height;
  leave_out([&](const V4l2Size& size) { return holds_size(size, wish); });
  if (fitting.empty()) {
    return refuse(before, sizes_text);
  }

  before = fitting;
  said.rate_hz = wish.rate_hz;
  leave_out([&](const V4l2Size& size) { return holds_size(size, wish) && holds_rate(size, wish); });
  if (fitting.empty()) {
    return refuse(before, [&](const V4l2Offer& offer) { return rates_text(offer, wish); });
  }
  // Formats with listed sizes take precedence.
  const auto told = std::find_if(fitting.begin(), fitting.end(),
                                 [](const V4l2Offer& offer) { return !offer.sizes.empty(); });
  return (told == fitting.end() ? fitting.front() : *told).fourcc;
}

std::size_t luma_offset(V4l2Format format) { return format == V4l2Format::kUyvy ? 1 : 0; }

std::size_t luma_step(V4l2Format format) {
  return format == V4l2Format::kYuyv || format == V4l2Format::kUyvy ? 2 : 1;
}

std::size_t raw_picture_bytes(V4l2Format format, int width, int height, std::size_t stride) {
  return static_cast<std::size_t>(height - 1) * stride +
         static_cast<std::size_t>(width) * luma_step(format);
}

void copy_luma(V4l2Format format, const std::uint8_t* picture, int width, int height,
               std::size_t stride, std::uint8_t* luma) {
  const auto row_bytes = static_cast<std::size_t>(width);
  for (int v = 0; v < height; ++v) {
    const std::uint8_t* from = picture + static_cast<std::size_t>(v) * stride + luma_offset(format);
    std::uint8_t* to = luma + static_cast<std::size_t>(v) * row_bytes;
    if (luma_step(format) == 1) {
      std::memcpy(to, from, row_bytes);
    } else {
      // Restrict and a fixed step let the compiler use whole vectors (pack on x86, ld2 on ARM).
      const std::uint8_t* __restrict pixel = from;
      std::uint8_t* __restrict out = to;
      for (std::size_t u = 0; u < row_bytes; ++u) {
        out[u] = pixel[2 * u];
      }
    }
  }
}

}  // namespace alidade
