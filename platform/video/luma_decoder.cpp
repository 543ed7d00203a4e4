#include "platform/video/luma_decoder.h"

extern "C" {
#include <libavutil/pixdesc.h>
}

namespace alidade {
namespace {

bool has_luma_plane(const AVPixFmtDescriptor* format) {
  constexpr std::uint64_t kNotPlain = AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL |
                                      AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL;
  return format != nullptr && (format->flags & kNotPlain) == 0 && format->comp[0].plane == 0 &&
         format->comp[0].step == 1 && format->comp[0].offset == 0 && format->comp[0].depth == 8;
}

}  // namespace

bool LumaDecoder::open(const AVCodecParameters& parameters, bool low_delay) {
  context_.reset();
  const AVCodec* codec = avcodec_find_decoder(parameters.codec_id);
  if (codec == nullptr) {
    error_ = std::string("no decoder for ") + avcodec_get_name(parameters.codec_id);
    return false;
  }
  context_.reset(avcodec_alloc_context3(codec));
  int code = AVERROR(ENOMEM);
  if (context_) {
    code = avcodec_parameters_to_context(context_.get(), &parameters);
  }
  if (code >= 0) {
    context_->thread_count = 1;
    if (low_delay) {
      context_->flags |= AV_CODEC_FLAG_LOW_DELAY;
    }
    if (codec->id == AV_CODEC_ID_MJPEG) {
      // Otherwise a cut off picture passes for a whole one.
      context_->err_recognition |= AV_EF_EXPLODE;
    }
    code = avcodec_open2(context_.get(), codec, nullptr);
  }
  if (code < 0) {
    error_ = std::string("cannot start the decoder of ") + codec->name + ": " + av_error_text(code);
    context_.reset();
    return false;
  }
  return true;
}

bool LumaDecoder::send(const AVPacket* packet) {
  return avcodec_send_packet(context_.get(), packet) >= 0;
}

FramePtr LumaDecoder::as_grey(const AVFrame& frame) {
  const auto format = static_cast<AVPixelFormat>(frame.format);
  scaler_.reset(sws_getCachedContext(scaler_.release(), frame.width, frame.height, format,
                                     frame.width, frame.height, AV_PIX_FMT_GRAY8,
                                     SWS_POINT | SWS_ACCURATE_RND, nullptr, nullptr, nullptr));
  FramePtr grey(av_frame_alloc());
  if (scaler_ && grey) {
    grey->format = AV_PIX_FMT_GRAY8;
    grey->width = frame.width;
    grey->height = frame.height;
    grey->pts = frame.pts;
    if (av_frame_get_buffer(grey.get(), 0) >= 0 &&
        sws_scale(scaler_.get(), frame.data, frame.linesize, 0, frame.height, grey->data,
                  grey->linesize) == frame.height) {
      return grey;
    }
  }
  const char* name = av_get_pix_fmt_name(format);
  error_ = std::string("pixel format ") + (name != nullptr ? name : "unknown") +
           " cannot be converted to grey; use grey, 8-bit YUV or RGB pictures";
  return nullptr;
}

LumaDecoder::Result LumaDecoder::receive(Picture* picture) {
  std::shared_ptr<AVFrame> frame(av_frame_alloc(), AvDeleter());
  const int code = avcodec_receive_frame(context_.get(), frame.get());
  if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) {
    return Result::kNone;
  }
  if (code < 0 || frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
    return Result::kDamaged;
  }
  if (!has_luma_plane(av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame->format)))) {
    frame = as_grey(*frame);
    if (!frame) {
      return Result::kUnsupported;
    }
  }
  picture->width = frame->width;
  picture->height = frame->height;
  picture->luma = frame->data[0];
  picture->stride = frame->linesize[0];
  picture->pts = frame->pts;
  picture->owner = frame;
  return Result::kPicture;
}

}  // namespace alidade
