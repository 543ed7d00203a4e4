#pragma once
// Frames of any video source. Times are s. Times of this host are of CLOCK_MONOTONIC, and taken
// before decoding. Which member of FrameStamp takes what a source knows: platform/video/README.md,
// "Which stamps".

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace alidade {

struct StreamPicture;  // platform/video/stream_copy.h

// The message to the user about interlaced video.
inline constexpr const char* kInterlaced =
    "the video is interlaced: every second row is captured half a frame later, which the camera "
    "model does not cover; set the camera to progressive";

// What a frame's receive time refers to.
enum class StampedAt : std::uint8_t {
  kArrival,        // arrival at this host; the frame may have waited on its way
  kExposureStart,  // the start of exposure, as the driver says; later waiting does not matter
  kFrameEnd        // the end of the whole frame's readout, as the driver says; likewise
};

// What a source tells of a frame: when and in which order it came. Fixed size; crosses queues by
// value.
struct FrameStamp {
  std::int64_t frame = 0;  // 0, 1, 2, ...: count of the frames that this source delivered
  // s, host CLOCK_MONOTONIC: the moment that stamped_at names. The arrival is that of the frame's
  // last packet, or of its first byte if the source's header says so.
  double receive_time_s = 0;
  std::optional<double> sender_time_s;   // capture, by the sender's clock; unwrapped, any epoch
  std::optional<double> sender_utc_s;    // the same as Unix time, once RTCP or the like gives it
  std::optional<std::int64_t> sequence;  // the sender's frame count, unwrapped; a gap is a loss
  bool restarted = false;  // first after a (re)connection: sender clock and sequence start anew
  // What receive_time_s refers to. Not recorded: a replay takes each for an arrival. Used only with
  // a sequence and without sender_time_s (frame_clock.h).
  StampedAt stamped_at = StampedAt::kArrival;
};

// A picture's colour beside its luma: the values Cb and Cr, each of 2^shift_x x 2^shift_y pixels.
struct ChromaPlanes {
  const std::uint8_t* cb = nullptr;  // row v starts at cb + v * stride; null: there is no colour
  const std::uint8_t* cr = nullptr;  // likewise
  std::ptrdiff_t stride = 0;         // bytes
  int step = 1;                      // bytes from one value to the next in its row
  int shift_x = 0;                   // 0 or more
  int shift_y = 0;                   // 0 or more
};

// One frame: its stamp and, if decoded, its luma plane.
struct Frame {
  FrameStamp stamp;
  int width = 0;   // px
  int height = 0;  // px
  // 8-bit luma; row v starts at luma + v * stride. Its range is as the camera sends it, 0 to 255 or
  // 16 to 235; nothing tells which. Null if the source was told not to decode (PT mode), while the
  // source cannot decode (reference data was lost and the next key frame has not come), and for a
  // picture of more than max_pixels.
  const std::uint8_t* luma = nullptr;
  std::ptrdiff_t stride = 0;  // bytes
  // Without colour where it would have to be decoded for its own sake.
  ChromaPlanes chroma;
  std::shared_ptr<const void> owner;  // keeps luma and chroma alive
  bool interlaced = false;  // coded as two fields: every other row may be of another moment
  // s; time that read() took to decode luma, without waiting and queueing. nullopt: not decoded, or
  // not measured.
  std::optional<double> decode_s;
  // The picture as the stream carries it. Null unless FrameSource::keep_stream() asked for it. Null
  // for a picture that cannot be decoded, or needs one that could not, and for one of more than
  // max_pixels.
  std::shared_ptr<const StreamPicture> coded;
};

}  // namespace alidade
