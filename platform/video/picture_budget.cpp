#include "platform/video/picture_budget.h"

extern "C" {
#include <libavutil/imgutils.h>
}

#include <algorithm>
#include <iterator>
#include <memory>

namespace alidade {
namespace {

// One for each picture, in its last buffer: freed with the decoder's last reference.
struct KeptPicture {
  std::int64_t* kept_bytes;
  std::int64_t bytes;
};

}  // namespace

void PictureBudget::bound(AVCodecContext* context) {
  bound_ = true;
  context->opaque = this;
  context->get_buffer2 = &PictureBudget::take_buffer;
}

void PictureBudget::release(void* token, std::uint8_t* /*data*/) {
  auto* picture = static_cast<KeptPicture*>(token);
  *picture->kept_bytes -= picture->bytes;
  delete picture;
}

int PictureBudget::take_buffer(AVCodecContext* context, AVFrame* frame, int flags) {
  auto* budget = static_cast<PictureBudget*>(context->opaque);
  const int bytes = av_image_get_buffer_size(static_cast<AVPixelFormat>(frame->format),
                                             frame->width, frame->height, 1);
  if (bytes < 0) return bytes;
  if (budget->kept_bytes_ > kMost + bytes) {
    budget->refused_ = true;
    return AVERROR(ENOMEM);
  }
  const int code = avcodec_default_get_buffer2(context, frame, flags);
  if (code < 0) return code;
  static std::uint8_t nothing = 0;
  auto picture = std::make_unique<KeptPicture>(KeptPicture{&budget->kept_bytes_, bytes});
  AVBufferRef** const last = std::find(std::begin(frame->buf), std::end(frame->buf), nullptr);
  if (last == std::end(frame->buf)) return AVERROR(ENOMEM);
  *last = av_buffer_create(&nothing, 1, &PictureBudget::release, picture.get(), 0);
  if (*last == nullptr) return AVERROR(ENOMEM);
  budget->kept_bytes_ += bytes;
  static_cast<void>(picture.release());
  return 0;
}

void PictureBudget::give_out(AVFrame* frame) const {
  if (!bound_) return;
  AVBufferRef** const end = std::find(std::begin(frame->buf), std::end(frame->buf), nullptr);
  if (end != std::begin(frame->buf)) av_buffer_unref(end - 1);
}

}  // namespace alidade
