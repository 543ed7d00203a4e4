#pragma once
// The virtual camera's video side: takes encoded frames and serves them by RTSP (DESCRIBE, SETUP,
// PLAY; RTP over UDP or interleaved in TCP; digest authentication when user is set), or, if
// rtp_port is set, pushes plain RTP with RTCP and writes the SDP file that a receiver opens. MJPEG
// goes by RFC 2435, H.264 by RFC 6184; one stream is shared by all clients.
//
// Time: a frame's RTP timestamp is 90000 * capture_time_s + constant, and the RTCP sender reports
// tie it to the UTC of the capture: UTC = CLOCK_MONOTONIC + an offset read once, when the server is
// made (so a later step of the host's clock is not followed). Reports go out about once a second.
// A frame captured before the server was made is refused: it has no timestamp.
//
// Threads: start(), stop() and the destructor belong to one; push() may be called from any, also
// while that one starts or stops; the others from any while the server is started. push() copies
// the frame, never waits for the network, and allocates.

#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace alidade {

struct VideoServerOptions {
  std::string address = "127.0.0.1";
  int port = 0;  // of RTSP; 0 = any free one, see VideoServer::port()
  std::string path = "/video";
  enum class Codec { kMjpeg, kH264, kH265 };
  Codec codec = Codec::kMjpeg;
  int width = 0;       // px
  int height = 0;      // px
  double rate_hz = 0;  // told to clients; 0 = unknown
  std::string user;    // of RTSP; empty = open to all
  std::string password;
  std::string rtp_host = "127.0.0.1";
  int rtp_port = 0;      // 0 = RTSP; else plain RTP to this port, even, and RTCP to the next
  std::string sdp_file;  // plain RTP only: written by start()
};

class VideoServer {
 public:
  explicit VideoServer(VideoServerOptions options);
  ~VideoServer();
  VideoServer(const VideoServer&) = delete;
  VideoServer& operator=(const VideoServer&) = delete;

  // Whether start() could take these options; if not, *error says why.
  [[nodiscard]] static bool validate(const VideoServerOptions& options, std::string* error);

  // On failure says why in *error. May be called again after stop().
  [[nodiscard]] bool start(std::string* error);

  // Ends all connections. Frames pushed later are discarded.
  void stop();

  // The RTSP port listened on; 0 before start() and with plain RTP.
  [[nodiscard]] int port() const;

  // Sends one frame, a JPEG as of encode_jpeg or an access unit of VideoEncoder, to every client that plays.
  // Discarded if nobody plays, or if the network is so slow that frames pile up inside the server;
  // after a gap H.264 and H.265 go on with the next IDR. capture_time_s is of CLOCK_MONOTONIC.
  void push(const std::uint8_t* data, std::size_t size, double capture_time_s);

  // RTSP connections open now.
  [[nodiscard]] int clients() const;

  // Closes them; a client may come back at once.
  void disconnect_clients();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace alidade
