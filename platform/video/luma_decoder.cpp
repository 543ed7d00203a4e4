#include "platform/video/luma_decoder.h"

extern "C" {
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <string_view>
#include <utility>

namespace alidade {

static_assert(Picture::kNoPts == AV_NOPTS_VALUE);
namespace {

bool has_luma_plane(const AVPixFmtDescriptor* format) {
  constexpr std::uint64_t kNotPlain = AV_PIX_FMT_FLAG_RGB | AV_PIX_FMT_FLAG_PAL |
                                      AV_PIX_FMT_FLAG_BITSTREAM | AV_PIX_FMT_FLAG_HWACCEL;
  return format != nullptr && (format->flags & kNotPlain) == 0 && format->comp[0].plane == 0 &&
         format->comp[0].step == 1 && format->comp[0].offset == 0 && format->comp[0].depth == 8;
}

// Of a frame with a luma plane.
ChromaPlanes chroma_of(const AVFrame& frame, const AVPixFmtDescriptor& format) {
  if (format.nb_components < 3) return {};
  const AVComponentDescriptor& cb = format.comp[1];
  const AVComponentDescriptor& cr = format.comp[2];
  if (cb.plane == 0 || cr.plane == 0 || cb.depth != 8 || cr.depth != 8 || cb.step != cr.step ||
      frame.linesize[cb.plane] != frame.linesize[cr.plane])
    return {};
  return {frame.data[cb.plane] + cb.offset,
          frame.data[cr.plane] + cr.offset,
          frame.linesize[cb.plane],
          cb.step,
          format.log2_chroma_w,
          format.log2_chroma_h};
}

}  // namespace

std::optional<CodedBy> coded_by(AVCodecID codec) {
  if (codec == AV_CODEC_ID_H264) return CodedBy::kH264;
  if (codec == AV_CODEC_ID_HEVC) return CodedBy::kH265;
  return std::nullopt;
}

bool LumaDecoder::open(const AVCodecParameters& parameters, bool low_delay,
                       std::int64_t max_pixels) {
  context_.reset();
  budget_ = std::make_unique<PictureBudget>();
  keeps_too_many_ = false;
  jpeg_.reset();
  decoded_.reset();
  coded_by_ = coded_by(parameters.codec_id);
  low_delay_ = low_delay;
  beginning_ = coded_by_.has_value();
  begun_ = false;
  if (low_delay && parameters.codec_id == AV_CODEC_ID_MJPEG) {
    jpeg_.emplace();
    return true;
  }
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
  if (code >= 0 && coded_by_ && low_delay) {
    const auto changed = without_reordering(*coded_by_, context_->extradata,
                                            static_cast<std::size_t>(context_->extradata_size));
    // The changed data is shorter: zeros take fewer bits.
    if (changed && changed->size() <= static_cast<std::size_t>(context_->extradata_size)) {
      std::copy(changed->begin(), changed->end(), context_->extradata);
      context_->extradata_size = static_cast<int>(changed->size());
    }
  }
  if (code >= 0) {
    context_->thread_count = 1;
    context_->max_pixels = max_pixels;
    if (low_delay) {
      context_->flags |= AV_CODEC_FLAG_LOW_DELAY;
      context_->has_b_frames = 0;
    }
    if (low_delay && coded_by_) budget_->bound(context_.get());
    if (codec->id == AV_CODEC_ID_MJPEG) {
      // Otherwise a cut-off picture passes as complete.
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

void LumaDecoder::flush() {
  decoded_.reset();
  if (context_) avcodec_flush_buffers(context_.get());
  beginning_ = coded_by_.has_value();
  begun_ = false;
}

// libav's H.264 decoder waits by itself; that of H.265 does not.
void LumaDecoder::begin(const AVPacket& packet) {
  const CodedPicture coded =
      look_at(*coded_by_, packet.data, static_cast<std::size_t>(packet.size));
  const bool waits = coded_by_ == CodedBy::kH265 && !coded.needs_no_other;
  not_right_ = waits ? coded.right_after.value_or(0) : 0;
  begun_ = true;
}

// The packet with parameter sets that permit no reordering; null if they need no change.
PacketPtr LumaDecoder::in_decoding_order(const AVPacket& packet) const {
  if (!coded_by_ || !low_delay_) return nullptr;
  const auto changed =
      without_reordering(*coded_by_, packet.data, static_cast<std::size_t>(packet.size));
  if (!changed) return nullptr;
  PacketPtr copy(av_packet_alloc());
  if (!copy || av_new_packet(copy.get(), static_cast<int>(changed->size())) < 0 ||
      av_packet_copy_props(copy.get(), &packet) < 0) {
    return nullptr;
  }
  std::copy(changed->begin(), changed->end(), copy->data);
  return copy;
}

bool LumaDecoder::send(const AVPacket* packet) {
  if (jpeg_) {
    if (packet == nullptr) return true;
    const std::string_view jpeg(reinterpret_cast<const char*>(packet->data),
                                static_cast<std::size_t>(packet->size));
    if (!jpeg_->decode(jpeg, &decoded_.emplace())) {
      decoded_.reset();
      return false;
    }
    decoded_->pts = packet->pts;
    return true;
  }
  if (packet == nullptr) return avcodec_send_packet(context_.get(), nullptr) >= 0;
  if (coded_by_ && !begun_) begin(*packet);
  const PacketPtr changed = in_decoding_order(*packet);
  const bool taken = avcodec_send_packet(context_.get(), changed ? changed.get() : packet) >= 0;
  if (budget_->take_refusal()) {
    keeps_too_many_ = true;
    error_ =
        "the stream keeps more reference pictures than a camera of this picture size needs; set "
        "fewer reference frames in the camera";
  }
  return taken && !keeps_too_many_;
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
  if (jpeg_) {
    if (!decoded_) return Result::kNone;
    *picture = *std::exchange(decoded_, std::nullopt);
    return Result::kPicture;
  }
  std::shared_ptr<AVFrame> frame(av_frame_alloc(), AvDeleter());
  const int code = avcodec_receive_frame(context_.get(), frame.get());
  if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) {
    return Result::kNone;
  }
  if (code < 0 || frame->decode_error_flags != 0 || (frame->flags & AV_FRAME_FLAG_CORRUPT) != 0) {
    return Result::kDamaged;
  }
  budget_->give_out(frame.get());
  if (not_right_ > 0) {
    --not_right_;
    return receive(picture);
  }
  beginning_ = false;
  const AVPixFmtDescriptor* format = av_pix_fmt_desc_get(static_cast<AVPixelFormat>(frame->format));
  picture->chroma = {};
  if (has_luma_plane(format)) {
    picture->chroma = chroma_of(*frame, *format);
  } else {
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
  picture->interlaced = frame->interlaced_frame != 0;
  picture->owner = frame;
  return Result::kPicture;
}

}  // namespace alidade
