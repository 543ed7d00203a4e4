#pragma once
// What flows from every video link. Times are seconds of the host's CLOCK_MONOTONIC, taken when the frame
// arrived, never after decoding.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace alidade {

// What a person is told of interlaced frames.
inline constexpr const char* kInterlaced =
    "the video is interlaced: every other row is of another moment, half a frame apart, which no "
    "camera model here knows; set "
    "the camera to progressive";

// What the receive time of a frame is.
enum class StampedAt : std::uint8_t {
  kArrival,        // here; the frame may have waited before
  kExposureStart,  // by the driver, when the sensor took it: wherever it waited since, it is of then
  kFrameEnd        // by the driver, when all of it was read out
};

// When and in which order a frame came. Fixed size: crosses queues by value.
struct FrameStamp {
  std::int64_t frame = 0;  // 0, 1, 2, ... of the frames this source delivered
  // host CLOCK_MONOTONIC at the arrival of the frame's last packet (of its first byte, or as the driver
  // stamped it, where the source says so)
  double receive_time_s = 0;
  std::optional<double> sender_time_s;   // capture time on the sender's clock, unwrapped, any epoch
  std::optional<double> sender_utc_s;    // the same as Unix time, once RTCP or the like has told it
  std::optional<std::int64_t> sequence;  // sender's count of frames, unwrapped; a gap is a loss
  bool restarted =
      false;  // first frame after a (re)connection: sender clock and sequence begin anew
  StampedAt stamped_at = StampedAt::kArrival;
};

// One frame: its stamp and, if decoded, its luma plane.
struct Frame {
  FrameStamp stamp;
  int width = 0;   // px
  int height = 0;  // px
  // 8-bit luma, row v starts at luma + v * stride; null if the source was told not to decode, and while it cannot: what the
  // picture is coded from was lost, up to the next key frame.
  const std::uint8_t* luma = nullptr;
  std::ptrdiff_t stride = 0;          // bytes
  std::shared_ptr<const void> owner;  // keeps luma alive
  bool interlaced = false;  // coded as two fields: every other row may be of another moment
  // What read() took to make luma of the data, waiting and queueing not included; none: not decoded,
  // or not told.
  std::optional<double> decode_s;
};

}  // namespace alidade
