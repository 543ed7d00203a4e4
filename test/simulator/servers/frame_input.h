#pragma once
// The head of the video server's GStreamer pipelines: encoded frames and their capture times go in
// through an appsrc, and the pipeline's clock is arranged so that RTP timestamps and RTCP sender
// reports are true.
//
// The clock given to the pipeline is CLOCK_MONOTONIC plus the constant that turns it into NTP time
// (UTC seconds since 1900). A buffer's running time is its capture time on that clock, and RTP
// sessions are told to take the NTP time of a sender report from the same reading of the same clock
// as the RTP timestamp: the two agree to the tick, however late the report is made.
// Thread-safe. Used by VideoServer only.

#include <gst/gst.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "test/simulator/servers/video_server.h"

namespace alidade {

struct GObjectUnref {
  void operator()(void* object) const { g_object_unref(object); }
};
template <class T>
using GObjectPtr = std::unique_ptr<T, GObjectUnref>;

class FrameInput {
 public:
  // Needs gst_init to have been called.
  explicit FrameInput(const VideoServerOptions& options);

  // The elements from the appsrc to the RTP payloader "pay0", as a gst-launch line.
  [[nodiscard]] const std::string& launch_line() const { return launch_line_; }

  // Sets a pipeline's clock; to be called before it starts.
  void prepare(GstElement* pipeline) const;

  // Frames go to the appsrc inside bin from now on, beginning with a key frame.
  void connect(GstElement* bin);

  // Frames are discarded from now on, if they went into bin.
  void disconnect(GstElement* bin);

  // As VideoServer::push.
  void push(const std::uint8_t* data, std::size_t size, double capture_time_s);

 private:
  const VideoServerOptions::Codec codec_;
  std::string launch_line_;
  GObjectPtr<GstClock> clock_;
  GstClockTime start_time_;    // on CLOCK_MONOTONIC: running time zero
  GstClockTime base_time_;     // the same on clock_
  std::mutex mutex_;           // guards what follows
  GstElement* bin_ = nullptr;  // only compared, never followed
  GObjectPtr<GstElement> source_;
  bool wait_for_key_frame_ = true;
};

}  // namespace alidade
