#pragma once
// PictureBudget: bounds the pictures that a decoder of live H.264 or H.265 keeps. A peer may claim
// 16 reference pictures of the largest size; cameras use one to four. A decoder gets memory for a
// picture only while its kept pictures take at most kMost plus that picture's size. A picture that
// was given out to the caller counts while the decoder keeps it, and no longer. One thread at a
// time; must outlive the decoder.

#include <cstdint>
#include <utility>

#include "platform/video/av_handles.h"

namespace alidade {

class PictureBudget {
 public:
  // Bytes, of pictures alone; libavcodec keeps up to 40 % more for each picture.
  static constexpr std::int64_t kMost = 44 << 20;

  // Bounds this decoder. To be called before the decoder is opened.
  void bound(AVCodecContext* context);
  // To be called for each picture that the decoder gives.
  void give_out(AVFrame* frame) const;
  [[nodiscard]] bool is_bound() const { return bound_; }
  // True if a picture was refused since the last call.
  [[nodiscard]] bool take_refusal() { return std::exchange(refused_, false); }

 private:
  static int take_buffer(AVCodecContext* context, AVFrame* frame, int flags);
  static void release(void* token, std::uint8_t* data);

  std::int64_t kept_bytes_ = 0;
  bool bound_ = false;
  bool refused_ = false;
};

}  // namespace alidade
