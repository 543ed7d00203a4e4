#pragma once
// open_rtp(): MJPEG, H.264 or H.265 video over RTSP or plain RTP (libavformat, libavcodec).
//
// url is one of: rtsp://host[:port]/path, or rtsps:// for the same over TLS; the name of an .sdp file; rtp://@:port or
// rtp://group:port (then `format` says what comes).
// A thread of its own, started by the first read() and so with the scheduling of the capture
// thread, connects, stamps and queues; read() decodes. So a stamp is never late by a decoding time,
// and a read() can time out without hurting the stream.
// - receive_time_s: arrival of the frame's last packet. sender_time_s: the RTP timestamp in seconds,
//   unwrapped, from some moment near the connection's beginning on. sender_utc_s: by the packets'
//   extension 0xABAC (ONVIF: when the picture was taken), else by the latest RTCP report.
// - A frame is delivered when its last packet is here. An H.264 or H.265 frame with lost or overtaking packets,
//   a connection's first one, and each one of a sender that sets markers within pictures is delivered
//   when the next one begins.
// - Damaged and undecodable frames are skipped and counted. When the reader is too slow, what waits is
//   dropped and counted. What comes before the next key frame, then and at a connection's beginning,
//   cannot be decoded and is not counted.
// - H.264 and H.265: a lost packet spoils all pictures up to the next key frame, or up to where a recovery point says that
//   all is right again. libavcodec would not tell: it makes up what is missing. The damaged one is skipped; those behind it
//   come without luma, or not at all if they are copied.
// - A connection without a whole picture for timeout_s is lost, whatever packets come. Pictures that a
//   key frame must precede count as life, for as long as it takes: cameras that save bits set key frames many seconds
//   apart, and plain RTP is joined at any moment between two. waiting() says so.
// - Luma is the decoder's plane 0, without copy or conversion.
// - copy_to: each delivered frame's data is also stored, not re-encoded, in that Matroska file, in
//   which a kill loses at most the last second. The file goes on over reconnections.
// Streams with B-frames are refused: they come out of order and late. Such as only allow for them are not, nor do their
// pictures wait for any.
// kDisconnected: refused, not there, no such stream, no pictures. kFailed: no password or a wrong one, a
// certificate that is not trusted, no video, another codec, B-frames, a transport that the camera does not send by, pictures without luma; once
// pictures have come these, too, are kDisconnected: a camera that boots may be all that for a moment, and no peer ends the
// program. A redirection that is refused (link_rules.h) is always kDisconnected, an unusable URL and a copy that cannot be written always
// kFailed.

#include <cstdint>
#include <memory>
#include <string>

#include "platform/streams/picture_size.h"
#include "platform/system/link_rules.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct RtpSourceOptions {
  enum class Transport { kTcp, kUdp };

  std::string url;
  std::string user;  // these go before what the URL may hold
  std::string password;
  LinkRules rules;                        // of rtsp:// and rtsps://
  std::string format = "MJPG";            // rtp:// only: MJPG, H264 or H265
  Transport transport = Transport::kTcp;  // rtsp:// only: RTP interleaved with RTSP, or in UDP;
                                          // rtsps:// knows the first only
  bool decode = true;  // false: Frame::luma stays null, only the first frame is decoded
  // rtsps:// only: PEM file that holds the camera's own certificate, or its authority's, in place of the system's. What is
  // the camera's own is taken whatever name and dates stand in it.
  std::string certificate_file;
  double timeout_s = 3;      // without a whole picture for so long, the connection counts as lost
  double max_backoff_s = 5;  // longest pause between two tries
  // A larger picture is not decoded: its frame has its size, and no luma. In a copy there is none.
  std::int64_t max_pixels = kMostLivePixels;
  std::string copy_to;  // video.mkv to copy the stream into; empty: none
};

[[nodiscard]] std::unique_ptr<FrameSource> open_rtp(const RtpSourceOptions& options);

}  // namespace alidade
