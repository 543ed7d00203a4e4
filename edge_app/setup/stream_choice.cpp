#include "edge_app/setup/stream_choice.h"

#include <fmt/format.h>

#include <algorithm>
#include <tuple>

#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr double kMostPixels = 1920 * 1088;  // 1088: rows that H.264 codes for 1080
constexpr double kLeastRate_hz = 15;
constexpr double kUsefulRate_hz = 30;
constexpr double kUsualRate_hz = 25;    // of a device that tells none
constexpr int kMostJpegOverRtp = 2040;  // px, RFC 2435
constexpr double kLongKeyFrames_s = 2;

// Pixels, counted less if they are too many to follow in time, or come too rarely.
double worth(int width, int height, double rate_hz) {
  const double pixels = static_cast<double>(width) * height;
  const double followed = pixels <= kMostPixels ? pixels : kMostPixels * kMostPixels / pixels;
  const double rate = rate_hz > 0 ? rate_hz : kUsualRate_hz;
  return followed * std::min(1.0, rate / kLeastRate_hz);
}

int codec_rank(const std::string& codec) {
  return codec == "H264" ? 0 : codec == "H265" ? 1 : codec == "JPEG" ? 2 : 3;
}

// Why the stream cannot be used; empty: it can.
std::string obstacle(const VideoStream& stream) {
  if (codec_rank(stream.codec) == 3) {
    return fmt::format("its codec '{}' is not supported; set H264 or H265 in the device",
                       shown(stream.codec));
  }
  if (stream.codec == "JPEG" && std::max(stream.width, stream.height) > kMostJpegOverRtp)
    return "RTP carries JPEG pictures of at most 2040 px a side";
  return "";
}

auto stream_key(const VideoStream& stream) {
  const double rate_hz = stream.rate_hz > 0 ? stream.rate_hz : kUsualRate_hz;
  return std::make_tuple(!obstacle(stream).empty(),
                         -worth(stream.width, stream.height, stream.rate_hz),
                         codec_rank(stream.codec), stream.b_frames != VideoStream::BFrames::kNone,
                         -std::min(rate_hz, kUsefulRate_hz));
}

std::string to_set(const VideoStream& stream) {
  std::string text;
  const double rate_hz = stream.rate_hz > 0 ? stream.rate_hz : kUsualRate_hz;
  if (stream.key_frame_distance > kLongKeyFrames_s * rate_hz) {
    text += fmt::format(
        "; set its key frames nearer: {} pictures apart is {:.1f} s, and a lost picture costs all "
        "up "
        "to the next",
        stream.key_frame_distance, stream.key_frame_distance / rate_hz);
  }
  if (stream.rate_hz > 0 && stream.rate_hz < kLeastRate_hz)
    text += fmt::format("; set {:.0f} pictures a second or more", kUsualRate_hz);
  if (stream.b_frames == VideoStream::BFrames::kPossible) {
    text += fmt::format(
        "; its profile {} permits B-frames, which are refused: if it sends some, set "
        "none, or the profile Baseline",
        shown(stream.codec_profile));
  }
  return text;
}

std::string why_not(const VideoStream& stream, const VideoStream& best) {
  std::string reason = obstacle(stream);
  if (!reason.empty()) return reason;
  const double pixels = static_cast<double>(stream.width) * stream.height;
  if (pixels > kMostPixels) return "more pixels than a small computer follows in time";
  if (stream.rate_hz > 0 && stream.rate_hz < kLeastRate_hz)
    return "too few pictures a second to follow movements";
  if (pixels < static_cast<double>(best.width) * best.height)
    return "fewer pixels, so coarser directions";
  if (codec_rank(stream.codec) > codec_rank(best.codec))
    return stream.codec == "H265" ? "H265 costs more to decode than H264"
                                  : "JPEG needs many times the network's capacity";
  return "no better than the one to take";
}

}  // namespace

StreamChoice choose_stream(const std::vector<VideoStream>& streams) {
  StreamChoice choice;
  if (streams.empty()) {
    choice.reason = "it offers no stream";
    return choice;
  }
  const auto best = std::min_element(
      streams.begin(), streams.end(),
      [](const VideoStream& a, const VideoStream& b) { return stream_key(a) < stream_key(b); });
  for (const VideoStream& stream : streams)
    choice.remarks.push_back(&stream == &*best ? "" : why_not(stream, *best));
  if (!obstacle(*best).empty()) {
    choice.reason = "none can be used: " + obstacle(*best);
    return choice;
  }
  choice.best = static_cast<std::size_t>(best - streams.begin());
  const double pixels = static_cast<double>(best->width) * best->height;
  choice.reason =
      (best->width == 0       ? std::string("its size is not told")
       : pixels > kMostPixels ? std::string("the smallest; 1920x1080 would be enough")
                              : std::string("most pixels that a small computer follows in time")) +
      to_set(*best);
  return choice;
}

std::vector<V4l2Mode> ordered_modes(const std::vector<V4l2Offer>& offers) {
  std::vector<V4l2Mode> modes;
  for (const V4l2Offer& offer : offers) {
    const auto format = v4l2_format_of_code(offer.fourcc);
    if (!format) continue;
    for (const V4l2Size& size : offer.sizes) {
      double rate_hz = 0;
      for (const V4l2Size::Rates& rates : size.rates) {
        // As many as are useful, if there are so many.
        const double its = rates.least_hz <= kUsefulRate_hz && kUsefulRate_hz <= rates.greatest_hz
                               ? kUsefulRate_hz
                               : rates.greatest_hz;
        rate_hz = std::max(rate_hz, its);
      }
      modes.push_back({*format, size.greatest_width, size.greatest_height, rate_hz});
    }
  }
  const auto key = [](const V4l2Mode& mode) {
    return std::make_tuple(-worth(mode.width, mode.height, mode.rate_hz),
                           -std::min(mode.rate_hz, kUsefulRate_hz), static_cast<int>(mode.format));
  };
  std::stable_sort(modes.begin(), modes.end(),
                   [&key](const V4l2Mode& a, const V4l2Mode& b) { return key(a) < key(b); });
  return modes;
}

}  // namespace alidade
