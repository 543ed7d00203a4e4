#pragma once
// The virtual camera's encoders: one 8-bit grey picture in, one encoded picture out.
//
// encode_jpeg makes what RFC 2435 can carry: baseline, standard Huffman tables, YUV 4:2:0 (type 1)
// with grey chroma. VideoEncoder makes Annex B access units of H.264 or H.265 without delay (no B
// frames, no look-ahead): the picture that went in comes out of the same call. Unless stated, an
// IDR with parameter sets begins every second of frames, so that a viewer can join. Luma is full
// range (0..255) in both. Row v starts at gray + v * stride (bytes). Both allocate. encode_jpeg is
// for any thread, a VideoEncoder for one at a time.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace alidade {

// quality: 1..100, the scale of libjpeg. Empty if the arguments make no picture.
[[nodiscard]] std::vector<std::uint8_t> encode_jpeg(const std::uint8_t* gray, int width, int height,
                                                    std::ptrdiff_t stride, int quality);

class VideoEncoder {
 public:
  enum class Standard { kH264, kH265 };

  VideoEncoder();
  ~VideoEncoder();
  VideoEncoder(const VideoEncoder&) = delete;
  VideoEncoder& operator=(const VideoEncoder&) = delete;

  struct Rate {
    int kbit_s = 0;  // on average over about a second; 0: what a constant quality takes
    int gop = 0;     // pictures from one IDR to the next; 0: a second of them
  };

  // width and height must be even (4:2:0). On failure says why in *error.
  [[nodiscard]] bool open(Standard standard, int width, int height, double rate_hz,
                          std::string* error) {
    return open(standard, width, height, rate_hz, Rate(), error);
  }
  [[nodiscard]] bool open(Standard standard, int width, int height, double rate_hz,
                          const Rate& rate, std::string* error);

  // One access unit; empty only if the encoder failed. force_idr starts a new sequence here.
  [[nodiscard]] std::vector<std::uint8_t> encode(const std::uint8_t* gray, std::ptrdiff_t stride,
                                                 bool force_idr);

 private:
  struct Codec;
  std::unique_ptr<Codec> codec_;
};

}  // namespace alidade
