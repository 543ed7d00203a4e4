#pragma once
// What the tests and the benchmark watch the video server with: a libavformat client that knows
// nothing of the server, and a picture whose number can be read back after lossy compression.
// One thread per object. Every wait ends at a deadline, with an error.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace alidade {

// CLOCK_MONOTONIC in seconds.
double monotonic_s();

// CLOCK_REALTIME - CLOCK_MONOTONIC in seconds, by a bracketed read.
double utc_minus_monotonic_s();

// A grey gradient with number (0 .. 65535) as a row of 16 black or white squares along the top.
// width must be a multiple of 16, height at least width / 16.
std::vector<std::uint8_t> numbered_picture(int width, int height, int number);
int read_number(const std::uint8_t* gray, int width, std::ptrdiff_t stride);

enum class Transport { kTcp, kUdp, kPlainRtp };

struct ReceivedFrame {
  int number = 0;  // as drawn by numbered_picture
  bool key_frame = false;
  double receive_time_s = 0;    // CLOCK_MONOTONIC, when libavformat returned the packet
  std::optional<double> utc_s;  // of the capture; known after the first RTCP sender report
};

class AvClient {
 public:
  AvClient();
  ~AvClient();
  AvClient(const AvClient&) = delete;
  AvClient& operator=(const AvClient&) = delete;

  // Opens an rtsp:// URL or an SDP file. 0, or libav's error code.
  [[nodiscard]] int open(const std::string& url, Transport transport);

  // The next frame that can be decoded, or nothing if the connection ended or was silent for
  // kDeadlineS.
  [[nodiscard]] std::optional<ReceivedFrame> read();

  static constexpr double kDeadlineS = 30;

 private:
  struct Session;
  std::unique_ptr<Session> session_;
};

}  // namespace alidade
