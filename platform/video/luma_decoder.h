#pragma once
// LumaDecoder: compressed pictures in, 8-bit luma planes out, by libavcodec; JPEG that comes live by jpeg_decoder.h, which leaves
// the chroma alone: half of the time.
//
// The luma plane is the decoder's own plane 0 (grey, any 8-bit YUV 4xx, NV12), neither copied nor
// converted; the picture's owner keeps it alive. Other pixel formats (RGB, palettes, more bits) become grey by
// libswscale, which costs a copy.
// Of H.264 and H.265 that begin at a recovery point (open(), flush()), nothing comes until all of the picture is right.
// Runs on the caller's thread only: frame threads would add frames of delay. One thread at a time.

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

namespace alidade {

// Empty: pictures coded each by itself, or by another codec.
[[nodiscard]] std::optional<CodedBy> coded_by(AVCodecID codec);

class LumaDecoder {
 public:
  enum class Result {
    kPicture,
    kNone,        // nothing more until the next packet
    kDamaged,     // a picture that is incomplete; others may follow
    kUnsupported  // cannot be converted to grey: see error()
  };

  // low_delay: never hold a picture back to put it in order, whatever the stream's parameter sets allow for. Data of H.264
  // and H.265 has to be Annex B then. A picture of more than max_pixels, to whole blocks, cannot be decoded.
  [[nodiscard]] bool open(const AVCodecParameters& parameters, bool low_delay,
                          std::int64_t max_pixels = kMostFilePixels);

  // One whole picture, or null for "no more will come". False: the data cannot be decoded.
  [[nodiscard]] bool send(const AVPacket* packet);

  // The next picture that is ready; call until kNone.
  [[nodiscard]] Result receive(Picture* picture);

  // Forgets all pictures: what comes next begins anew.
  void flush();

  // H.264 and H.265: no picture has come since open() or flush().
  [[nodiscard]] bool is_beginning() const { return beginning_; }

  // One line; valid after open() failed and after kUnsupported.
  [[nodiscard]] const std::string& error() const { return error_; }

 private:
  // Null and error_ where there is no conversion.
  FramePtr as_grey(const AVFrame& frame);
  [[nodiscard]] PacketPtr in_decoding_order(const AVPacket& packet) const;
  void begin(const AVPacket& packet);

  CodecContextPtr context_;          // null with jpeg_
  std::optional<JpegDecoder> jpeg_;  // decodes in send()
  std::optional<Picture> decoded_;   // by it, until receive()
  ScalerPtr scaler_;                 // made for the first picture that needs it
  std::optional<CodedBy> coded_by_;
  bool low_delay_ = false;
  bool beginning_ = false;
  bool begun_ = false;  // a picture was sent since open() or flush()
  int not_right_ = 0;   // pictures to come before the first that is
  std::string error_;
};

}  // namespace alidade
