#include "test/simulator/servers/frame_input.h"

#include <gst/app/gstappsrc.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>

namespace alidade {
namespace {

// Frames that may wait inside an appsrc. More means that the network cannot keep up.
constexpr guint64 kMaxQueuedFrames = 8;

constexpr GstClockTime kReportInterval = GST_SECOND;

constexpr std::int64_t kUnixEpochNtpS = 2208988800;  // RFC 5905: 1970 seen from 1900

template <class Clock>
std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Clock::now().time_since_epoch())
      .count();
}

// CLOCK_REALTIME - CLOCK_MONOTONIC: the reading of UTC that two readings of the monotonic clock
// enclose most tightly.
std::int64_t utc_minus_monotonic_ns() {
  std::int64_t offset = 0;
  std::int64_t narrowest = std::numeric_limits<std::int64_t>::max();
  for (int i = 0; i < 16; ++i) {
    const std::int64_t before = now_ns<std::chrono::steady_clock>();
    const std::int64_t utc = now_ns<std::chrono::system_clock>();
    const std::int64_t after = now_ns<std::chrono::steady_clock>();
    if (after - before < narrowest) {
      narrowest = after - before;
      offset = utc - (before + (after - before) / 2);
    }
  }
  return offset;
}

std::string launch_line_of(const VideoServerOptions& options) {
  gint numerator = 0;
  gint denominator = 1;
  gst_util_double_to_fraction(options.rate_hz, &numerator, &denominator);
  const std::string size =
      ",width=" + std::to_string(options.width) + ",height=" + std::to_string(options.height) +
      ",framerate=" + std::to_string(numerator) + "/" + std::to_string(denominator);
  const std::string source = "appsrc name=source is-live=true format=time block=false caps=";
  // perfect-rtptime would count bytes or frames instead of taking the buffers' times.
  if (options.codec == VideoServerOptions::Codec::kMjpeg) {
    return source + "image/jpeg" + size +
           " ! rtpjpegpay name=pay0 pt=26 mtu=1400 perfect-rtptime=false";
  }
  if (options.codec == VideoServerOptions::Codec::kH265) {
    return source + "video/x-h265,stream-format=byte-stream,alignment=au" + size +
           " ! rtph265pay name=pay0 pt=96 mtu=1400 config-interval=-1 perfect-rtptime=false";
  }
  return source + "video/x-h264,stream-format=byte-stream,alignment=au" + size +
         " ! rtph264pay name=pay0 pt=96 mtu=1400 config-interval=-1 perfect-rtptime=false";
}

// Whether the first slice of an Annex B access unit is of an IDR picture.
bool is_idr(VideoServerOptions::Codec codec, const std::uint8_t* data, std::size_t size) {
  const bool h265 = codec == VideoServerOptions::Codec::kH265;
  for (std::size_t i = 3; i < size; ++i) {
    if (data[i - 3] != 0 || data[i - 2] != 0 || data[i - 1] != 1) continue;
    // H.265: slices are all types below 32, IDR is 19 and 20; H.264: 1 to 5, and 5.
    const unsigned type = h265 ? data[i] >> 1U & 0x3fU : data[i] & 0x1fU;
    if (h265 ? type < 32 : type >= 1 && type <= 5) {
      return h265 ? type == 19 || type == 20 : type == 5;
    }
  }
  return false;
}

void on_element_added(GstBin*, GstBin*, GstElement* element, gpointer) {
  const GstElementFactory* factory = gst_element_get_factory(element);
  if (factory == nullptr || std::strcmp(GST_OBJECT_NAME(factory), "rtpsession") != 0) return;
  gst_util_set_object_arg(G_OBJECT(element), "ntp-time-source", "clock-time");
  g_object_set(element, "rtcp-sync-send-time", FALSE, "rtcp-min-interval", kReportInterval,
               nullptr);
}

}  // namespace

FrameInput::FrameInput(const VideoServerOptions& options)
    : codec_(options.codec), launch_line_(launch_line_of(options)) {
  clock_.reset(GST_CLOCK(gst_object_ref_sink(
      g_object_new(GST_TYPE_SYSTEM_CLOCK, "clock-type", GST_CLOCK_TYPE_MONOTONIC, nullptr))));
  const std::int64_t offset =
      utc_minus_monotonic_ns() + kUnixEpochNtpS * static_cast<std::int64_t>(GST_SECOND);
  gst_clock_set_calibration(clock_.get(), 0, static_cast<GstClockTime>(offset), 1, 1);
  start_time_ = static_cast<GstClockTime>(now_ns<std::chrono::steady_clock>());
  base_time_ = start_time_ + static_cast<GstClockTime>(offset);
}

void FrameInput::prepare(GstElement* pipeline) const {
  gst_pipeline_use_clock(GST_PIPELINE(pipeline), clock_.get());
  // Without a start time the pipeline keeps the base time it is given.
  gst_element_set_start_time(pipeline, GST_CLOCK_TIME_NONE);
  gst_element_set_base_time(pipeline, base_time_);
  g_signal_connect(pipeline, "deep-element-added", G_CALLBACK(on_element_added), nullptr);
}

void FrameInput::connect(GstElement* bin) {
  const std::lock_guard<std::mutex> lock(mutex_);
  bin_ = bin;
  source_.reset(gst_bin_get_by_name(GST_BIN(bin), "source"));
  wait_for_key_frame_ = true;
}

void FrameInput::disconnect(GstElement* bin) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (bin_ != bin) return;
  bin_ = nullptr;
  source_.reset();
}

void FrameInput::push(const std::uint8_t* data, std::size_t size, double capture_time_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!source_) return;
  const double running_time_ns =
      std::round(capture_time_s * 1e9 - static_cast<double>(start_time_));
  if (running_time_ns < 0) return;
  GstAppSrc* source = GST_APP_SRC(source_.get());
  if (gst_app_src_get_current_level_buffers(source) >= kMaxQueuedFrames) {
    wait_for_key_frame_ = true;
    return;
  }
  if (wait_for_key_frame_ && codec_ != VideoServerOptions::Codec::kMjpeg &&
      !is_idr(codec_, data, size)) {
    return;
  }
  wait_for_key_frame_ = false;
  GstBuffer* buffer = gst_buffer_new_allocate(nullptr, size, nullptr);
  gst_buffer_fill(buffer, 0, data, size);
  GST_BUFFER_PTS(buffer) = static_cast<GstClockTime>(running_time_ns);
  gst_app_src_push_buffer(source, buffer);
}

}  // namespace alidade
