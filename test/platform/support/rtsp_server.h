#pragma once
// RtspServer: runs the program rtsp_server as a child that can be killed and started again.

#include <sys/types.h>

#include <string>

namespace alidade {

struct RtspStream {
  std::string path;
  std::string launch;  // GStreamer pipeline
};

// Test pictures of 320x240 at 30 Hz, all white (luma 235), and MJPEG, H.264 or H.265 of them.
extern const char* const kWhitePictures;
extern const RtspStream kMjpegStream;
extern const RtspStream kH264Stream;
extern const RtspStream kH265Stream;

// When PLAY comes, the server winds back what it has begun: the first of these and the next can come with one timestamp.
constexpr int kPicturesBeforePlay = 1;

class RtspServer {
 public:
  // certificate: PEM file with it and its key, for RTSP over TLS.
  explicit RtspServer(RtspStream stream, std::string user = "", std::string password = "",
                      std::string certificate = "");
  ~RtspServer() { kill(); }
  RtspServer(const RtspServer&) = delete;
  RtspServer& operator=(const RtspServer&) = delete;

  std::string url() const {
    return (certificate_.empty() ? "rtsp" : "rtsps") + std::string("://127.0.0.1:") +
           std::to_string(port_) + stream_.path;
  }

  void kill();     // as a power failure would
  void restart();  // on the same port
  void freeze();   // keeps its connections, and says nothing on them
  void thaw();

 private:
  RtspStream stream_;
  std::string user_;
  std::string password_;
  std::string certificate_;
  int port_ = 0;
  pid_t child_ = -1;
};

}  // namespace alidade
