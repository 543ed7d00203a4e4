#pragma once
// LumaDecoder: decodes pictures to 8-bit luma planes by libavcodec. Live JPEG is decoded by
// jpeg_decoder.h instead, which skips the chroma and needs half of the time. The luma plane is the
// decoder's own plane 0 (grey, any 8-bit YUV 4xx, NV12), without copy or conversion. The chroma is
// in its other planes. The picture's owner keeps them alive. Other pixel formats (RGB, palettes,
// more bits) are converted to grey by libswscale, which costs a copy. If H.264 or H.265 starts at a
// recovery point (after open() or flush()), no picture is returned until all of it is right. Runs
// only on the caller's thread: frame threads would add frames of delay. One thread at a time.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "platform/streams/picture_size.h"
#include "platform/video/av_handles.h"
#include "platform/video/coded_picture.h"
#include "platform/video/jpeg_decoder.h"
#include "platform/video/picture.h"
#include "platform/video/picture_budget.h"

namespace alidade {

// nullopt: a codec whose pictures are coded independently, or another one.
[[nodiscard]] std::optional<CodedBy> coded_by(AVCodecID codec);

class LumaDecoder {
 public:
  enum class Result {
    kPicture,
    kNone,        // nothing until the next packet
    kDamaged,     // an incomplete picture; others may follow
    kUnsupported  // cannot be converted to grey: see error()
  };

  // low_delay: never hold back a picture for reordering, whatever the stream's parameter sets
  // permit, and bound the pictures that the decoder keeps (PictureBudget); H.264 and H.265 data
  // must then be Annex B. A picture of more than max_pixels, counted in whole blocks, cannot be
  // decoded; for JPEG with low_delay the limit is kMostFilePixels instead. False: see error().
  [[nodiscard]] bool open(const AVCodecParameters& parameters, bool low_delay,
                          std::int64_t max_pixels = kMostFilePixels);

  // Only after open() returned true, like receive(). Takes one whole picture, or null for the end
  // of the stream. False: the data cannot be decoded. If keeps_too_many(), later data cannot be
  // decoded, either.
  [[nodiscard]] bool send(const AVPacket* packet);

  // The next decoded picture; to be called until the result is kNone.
  [[nodiscard]] Result receive(Picture* picture);

  // Forgets all pictures, for a new start.
  void flush();

  // H.264 and H.265: no picture was returned since open() or flush().
  [[nodiscard]] bool is_beginning() const { return beginning_; }

  // The stream keeps more reference pictures than the decoder may; see error().
  [[nodiscard]] bool keeps_too_many() const { return keeps_too_many_; }

  // One line; valid after open() failed, kUnsupported and keeps_too_many().
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  // Null, with error_, if there is no conversion.
  FramePtr as_grey(const AVFrame& frame);
  [[nodiscard]] PacketPtr in_decoding_order(const AVPacket& packet) const;
  void begin(const AVPacket& packet);

  std::unique_ptr<PictureBudget> budget_;  // of context_
  CodecContextPtr context_;                // null if jpeg_ is used
  std::optional<JpegDecoder> jpeg_;        // decodes in send()
  std::optional<Picture> decoded_;         // the picture from jpeg_, until receive()
  ScalerPtr scaler_;                       // created for the first picture that needs it
  std::optional<CodedBy> coded_by_;
  bool low_delay_ = false;
  bool keeps_too_many_ = false;
  bool beginning_ = false;
  bool begun_ = false;  // a picture was sent since open() or flush()
  int not_right_ = 0;   // pictures still to come before the first right one
  std::string error_;
};

}  // namespace alidade
