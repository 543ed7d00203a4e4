#include "test/simulator/servers/video_server.h"

#include <gst/gst.h>
#include <gst/rtsp-server/rtsp-server.h>
#include <gst/sdp/gstsdpmessage.h>

#include <atomic>
#include <condition_variable>
#include <fstream>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#include "test/simulator/servers/frame_input.h"

namespace alidade {
namespace {

using Codec = VideoServerOptions::Codec;

// A frame leaves as one burst of packets: the socket has to hold it.
constexpr guint kSocketBufferBytes = 4 << 20;

constexpr const char* kRole = "viewer";

struct GFree {
  void operator()(gchar* text) const { g_free(text); }
};

struct GErrorFree {
  void operator()(GError* error) const { g_error_free(error); }
};
using GErrorPtr = std::unique_ptr<GError, GErrorFree>;

struct MainContextUnref {
  void operator()(GMainContext* context) const { g_main_context_unref(context); }
};

struct MainLoopUnref {
  void operator()(GMainLoop* loop) const { g_main_loop_unref(loop); }
};

struct SdpFree {
  void operator()(GstSDPMessage* message) const { gst_sdp_message_free(message); }
};

struct CapsUnref {
  void operator()(GstCaps* caps) const { gst_caps_unref(caps); }
};

bool fail(std::string* error, const std::string& reason) {
  *error = "video server: " + reason;
  return false;
}

// A thread with a GLib main loop: it accepts connections and serves RTSP requests.
class LoopThread {
 public:
  LoopThread()
      : context_(g_main_context_new()),
        loop_(g_main_loop_new(context_.get(), FALSE)),
        thread_([this] {
          g_main_context_push_thread_default(context_.get());
          g_main_loop_run(loop_.get());
          g_main_context_pop_thread_default(context_.get());
        }) {}

  ~LoopThread() {
    run([this] { g_main_loop_quit(loop_.get()); });
    thread_.join();
  }
  LoopThread(const LoopThread&) = delete;
  LoopThread& operator=(const LoopThread&) = delete;

  // Runs the task on the thread and waits until it is done.
  void run(std::function<void()> task) {
    Call call;
    call.task = std::move(task);
    std::unique_lock<std::mutex> lock(call.mutex);
    // Not g_main_context_invoke: it would run the task here if the loop has not begun yet.
    GSource* source = g_idle_source_new();
    g_source_set_callback(source, &LoopThread::invoke, &call, nullptr);
    g_source_attach(source, context_.get());
    g_source_unref(source);
    call.finished.wait(lock, [&call] { return call.done; });
  }

  GMainContext* context() { return context_.get(); }

 private:
  struct Call {
    std::function<void()> task;
    std::mutex mutex;
    std::condition_variable finished;
    bool done = false;
  };

  static gboolean invoke(gpointer data) {
    Call& call = *static_cast<Call*>(data);
    const std::lock_guard<std::mutex> lock(call.mutex);
    call.task();
    call.done = true;
    // Under the lock: the caller, once awake, takes the call away.
    call.finished.notify_one();
    return G_SOURCE_REMOVE;
  }

  std::unique_ptr<GMainContext, MainContextUnref> context_;
  std::unique_ptr<GMainLoop, MainLoopUnref> loop_;
  std::thread thread_;
};

GstRTSPFilterResult remove_client(GstRTSPServer*, GstRTSPClient*, gpointer) {
  return GST_RTSP_FILTER_REMOVE;
}

GstRTSPFilterResult remove_session(GstRTSPSessionPool*, GstRTSPSession*, gpointer) {
  return GST_RTSP_FILTER_REMOVE;
}

class RtspServer {
 public:
  RtspServer(const VideoServerOptions& options, FrameInput& input)
      : options_(options), input_(input), server_(gst_rtsp_server_new()) {}

  ~RtspServer() {
    if (accept_source_ == nullptr) return;
    loop_.run([this] {
      g_source_destroy(accept_source_);
      g_source_unref(accept_source_);
      remove_all();
    });
  }
  RtspServer(const RtspServer&) = delete;
  RtspServer& operator=(const RtspServer&) = delete;

  bool start(std::string* error) {
    gst_rtsp_server_set_address(server_.get(), options_.address.c_str());
    gst_rtsp_server_set_service(server_.get(), std::to_string(options_.port).c_str());
    // Clients are served by loop_, not by a pool of threads.
    const GObjectPtr<GstRTSPThreadPool> threads(gst_rtsp_server_get_thread_pool(server_.get()));
    gst_rtsp_thread_pool_set_max_threads(threads.get(), 0);
    if (!options_.user.empty()) require_digest();
    add_stream();
    g_signal_connect(server_.get(), "client-connected", G_CALLBACK(on_connected), this);

    GError* reason = nullptr;
    accept_source_ = gst_rtsp_server_create_source(server_.get(), nullptr, &reason);
    if (accept_source_ == nullptr) {
      const GErrorPtr owner(reason);
      return fail(error, "cannot listen on " + options_.address + ":" +
                             std::to_string(options_.port) + ": " + reason->message);
    }
    g_source_attach(accept_source_, loop_.context());
    return true;
  }

  int port() const { return gst_rtsp_server_get_bound_port(server_.get()); }

  int clients() const { return clients_; }

  void disconnect_clients() {
    loop_.run([this] { remove_all(); });
  }

 private:
  void require_digest() {
    const GObjectPtr<GstRTSPAuth> auth(gst_rtsp_auth_new());
    gst_rtsp_auth_set_supported_methods(auth.get(), GST_RTSP_AUTH_DIGEST);
    GstRTSPToken* token =
        gst_rtsp_token_new(GST_RTSP_TOKEN_MEDIA_FACTORY_ROLE, G_TYPE_STRING, kRole, nullptr);
    gst_rtsp_auth_add_digest(auth.get(), options_.user.c_str(), options_.password.c_str(), token);
    gst_rtsp_token_unref(token);
    gst_rtsp_server_set_auth(server_.get(), auth.get());
  }

  void add_stream() {
    GstRTSPMediaFactory* factory = gst_rtsp_media_factory_new();
    gst_rtsp_media_factory_set_launch(factory, ("( " + input_.launch_line() + " )").c_str());
    gst_rtsp_media_factory_set_shared(factory, TRUE);
    gst_rtsp_media_factory_set_latency(factory, 0);
    gst_rtsp_media_factory_set_buffer_size(factory, kSocketBufferBytes);
    if (!options_.user.empty()) {
      gst_rtsp_media_factory_add_role(factory, kRole, GST_RTSP_PERM_MEDIA_FACTORY_ACCESS,
                                      G_TYPE_BOOLEAN, TRUE, GST_RTSP_PERM_MEDIA_FACTORY_CONSTRUCT,
                                      G_TYPE_BOOLEAN, TRUE, nullptr);
    }
    g_signal_connect(factory, "media-configure", G_CALLBACK(on_media), this);
    const GObjectPtr<GstRTSPMountPoints> paths(gst_rtsp_server_get_mount_points(server_.get()));
    gst_rtsp_mount_points_add_factory(paths.get(), options_.path.c_str(), factory);
  }

  void remove_all() {
    gst_rtsp_server_client_filter(server_.get(), remove_client, nullptr);
    // A session over UDP would outlive its connection.
    const GObjectPtr<GstRTSPSessionPool> sessions(gst_rtsp_server_get_session_pool(server_.get()));
    gst_rtsp_session_pool_filter(sessions.get(), remove_session, nullptr);
  }

  static void on_connected(GstRTSPServer*, GstRTSPClient* client, gpointer self) {
    ++static_cast<RtspServer*>(self)->clients_;
    g_signal_connect(client, "closed", G_CALLBACK(on_closed), self);
  }

  static void on_closed(GstRTSPClient*, gpointer self) {
    --static_cast<RtspServer*>(self)->clients_;
  }

  static void on_media(GstRTSPMediaFactory*, GstRTSPMedia* media, gpointer self) {
    FrameInput& input = static_cast<RtspServer*>(self)->input_;
    const GObjectPtr<GstElement> bin(gst_rtsp_media_get_element(media));
    const GObjectPtr<GstElement> pipeline(
        GST_ELEMENT(gst_object_get_parent(GST_OBJECT(bin.get()))));
    input.prepare(pipeline.get());
    input.connect(bin.get());
    g_signal_connect(media, "unprepared", G_CALLBACK(on_unprepared), self);
  }

  static void on_unprepared(GstRTSPMedia* media, gpointer self) {
    const GObjectPtr<GstElement> bin(gst_rtsp_media_get_element(media));
    static_cast<RtspServer*>(self)->input_.disconnect(bin.get());
  }

  const VideoServerOptions& options_;
  FrameInput& input_;
  GObjectPtr<GstRTSPServer> server_;
  GSource* accept_source_ = nullptr;
  std::atomic<int> clients_{0};
  LoopThread loop_;
};

class RtpPusher {
 public:
  RtpPusher(const VideoServerOptions& options, FrameInput& input)
      : options_(options),
        input_(input),
        pipeline_(GST_ELEMENT(gst_object_ref_sink(gst_pipeline_new(nullptr)))) {}

  ~RtpPusher() {
    input_.disconnect(pipeline_.get());
    gst_element_set_state(pipeline_.get(), GST_STATE_NULL);
  }
  RtpPusher(const RtpPusher&) = delete;
  RtpPusher& operator=(const RtpPusher&) = delete;

  bool start(std::string* error) {
    const std::string line = input_.launch_line() +
                             " ! rtp.send_rtp_sink_0 rtpbin name=rtp"
                             " rtp.send_rtp_src_0 ! udpsink name=rtp_sink sync=false async=false"
                             " rtp.send_rtcp_src_0 ! udpsink name=rtcp_sink sync=false async=false";
    GError* reason = nullptr;
    GstElement* bin = gst_parse_bin_from_description(line.c_str(), FALSE, &reason);
    const GErrorPtr owner(reason);
    if (bin == nullptr) return fail(error, reason->message);
    input_.prepare(pipeline_.get());
    gst_bin_add(GST_BIN(pipeline_.get()), bin);
    aim("rtp_sink", options_.rtp_port);
    aim("rtcp_sink", options_.rtp_port + 1);
    if (!write_sdp(error)) return false;
    if (gst_element_set_state(pipeline_.get(), GST_STATE_PLAYING) == GST_STATE_CHANGE_FAILURE) {
      return fail(error, "cannot send RTP to " + options_.rtp_host + ":" +
                             std::to_string(options_.rtp_port));
    }
    input_.connect(pipeline_.get());
    return true;
  }

 private:
  void aim(const char* sink_name, int port) {
    const GObjectPtr<GstElement> sink(gst_bin_get_by_name(GST_BIN(pipeline_.get()), sink_name));
    g_object_set(sink.get(), "host", options_.rtp_host.c_str(), "port", port, "buffer-size",
                 static_cast<gint>(kSocketBufferBytes), nullptr);
  }

  bool write_sdp(std::string* error) const {
    if (options_.sdp_file.empty()) return true;
    // H.264 and H.265 carry their parameter sets in the stream: the SDP need not repeat them.
    const std::unique_ptr<GstCaps, CapsUnref> caps(gst_caps_from_string(
        options_.codec == Codec::kMjpeg
            ? "application/x-rtp,media=video,payload=26,clock-rate=90000,encoding-name=JPEG"
        : options_.codec == Codec::kH265
            ? "application/x-rtp,media=video,payload=96,clock-rate=90000,encoding-name=H265"
            : "application/x-rtp,media=video,payload=96,clock-rate=90000,encoding-name=H264,"
              "packetization-mode=(string)1"));
    GstSDPMessage* sdp = nullptr;
    gst_sdp_message_new(&sdp);
    const std::unique_ptr<GstSDPMessage, SdpFree> owner(sdp);
    gst_sdp_message_set_version(sdp, "0");
    gst_sdp_message_set_origin(sdp, "-", "0", "0", "IN", "IP4", options_.address.c_str());
    gst_sdp_message_set_session_name(sdp, "virtual camera");
    gst_sdp_message_set_connection(sdp, "IN", "IP4", options_.rtp_host.c_str(), 0, 0);
    gst_sdp_message_add_time(sdp, "0", "0", nullptr);
    GstSDPMedia* media = nullptr;
    gst_sdp_media_new(&media);
    gst_sdp_media_set_port_info(media, static_cast<guint>(options_.rtp_port), 1);
    gst_sdp_media_set_proto(media, "RTP/AVP");
    gst_sdp_media_set_media_from_caps(caps.get(), media);
    gst_sdp_message_add_media(sdp, media);
    gst_sdp_media_free(media);
    const std::unique_ptr<gchar, GFree> text(gst_sdp_message_as_text(sdp));
    std::ofstream file(options_.sdp_file);
    file << text.get();
    file.close();
    return file ? true : fail(error, "cannot write " + options_.sdp_file);
  }

  const VideoServerOptions& options_;
  FrameInput& input_;
  GObjectPtr<GstElement> pipeline_;
};

}  // namespace

struct VideoServer::Impl {
  explicit Impl(VideoServerOptions given) : options(std::move(given)) {
    gst_init(nullptr, nullptr);
  }

  const VideoServerOptions options;
  FrameInput input{options};
  std::unique_ptr<RtspServer> rtsp;
  std::unique_ptr<RtpPusher> rtp;
};

bool VideoServer::validate(const VideoServerOptions& options, std::string* error) {
  const std::string size = std::to_string(options.width) + "x" + std::to_string(options.height);
  if (options.width <= 0 || options.height <= 0) return fail(error, "no image size: " + size);
  // RFC 2435 counts in blocks of 8 px with one byte.
  if (options.codec == Codec::kMjpeg && (options.width % 8 != 0 || options.height % 8 != 0 ||
                                         options.width > 2040 || options.height > 2040)) {
    return fail(error, "RTP carries JPEG only in multiples of 8 up to 2040, not " + size);
  }
  if (!(options.rate_hz >= 0)) return fail(error, "a negative frame rate");
  if (options.rtp_port % 2 != 0 || options.rtp_port < 0 || options.rtp_port > 65534) {
    return fail(error, "rtp_port must be even and below 65535 (RTCP takes the next), not " +
                           std::to_string(options.rtp_port));
  }
  if (options.port < 0 || options.port > 65535) {
    return fail(error, "no such port: " + std::to_string(options.port));
  }
  if (options.path.empty() || options.path[0] != '/') {
    return fail(error, "the path must begin with '/', not be \"" + options.path + "\"");
  }
  return true;
}

VideoServer::VideoServer(VideoServerOptions options)
    : impl_(std::make_unique<Impl>(std::move(options))) {}

VideoServer::~VideoServer() { stop(); }

bool VideoServer::start(std::string* error) {
  Impl& impl = *impl_;
  if (impl.rtsp || impl.rtp) return fail(error, "already started");
  if (!validate(impl.options, error)) return false;
  if (impl.options.rtp_port != 0) {
    auto rtp = std::make_unique<RtpPusher>(impl.options, impl.input);
    if (!rtp->start(error)) return false;
    impl.rtp = std::move(rtp);
  } else {
    auto rtsp = std::make_unique<RtspServer>(impl.options, impl.input);
    if (!rtsp->start(error)) return false;
    impl.rtsp = std::move(rtsp);
  }
  return true;
}

void VideoServer::stop() {
  impl_->rtp.reset();
  impl_->rtsp.reset();
}

int VideoServer::port() const { return impl_->rtsp ? impl_->rtsp->port() : 0; }

void VideoServer::push(const std::uint8_t* data, std::size_t size, double capture_time_s) {
  impl_->input.push(data, size, capture_time_s);
}

int VideoServer::clients() const { return impl_->rtsp ? impl_->rtsp->clients() : 0; }

void VideoServer::disconnect_clients() {
  if (impl_->rtsp) impl_->rtsp->disconnect_clients();
}

}  // namespace alidade
