#include "test/simulator/live.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <mutex>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "test/simulator/parallel.h"
#include "test/simulator/pattern_renderer.h"
#include "test/simulator/picture_filter.h"
#include "test/simulator/renderer.h"
#include "test/simulator/servers/encoder.h"
#include "test/simulator/servers/head_server.h"
#include "test/simulator/servers/mjpeg_stream.h"
#include "test/simulator/servers/onvif_server.h"
#include "test/simulator/servers/vapix_server.h"
#include "test/simulator/servers/video_server.h"
#include "test/simulator/telemetry.h"
#include "test/simulator/timeline.h"
#include "test/simulator/truth.h"
#include "test/simulator/zoom.h"

namespace alidade::simulator {
namespace {

constexpr double kDegreesPerRadian = 180 / 3.14159265358979323846;

double monotonic_now() {
  timespec time{};
  clock_gettime(CLOCK_MONOTONIC, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Sleeps until a moment of CLOCK_MONOTONIC, or shortly after `stop` is set.
void sleep_until(double moment, const std::atomic<bool>& stop) {
  constexpr double kSlice = 0.1;
  while (!stop && monotonic_now() < moment) {
    const double target = std::min(moment, monotonic_now() + kSlice);
    timespec time{};
    time.tv_sec = static_cast<time_t>(target);
    time.tv_nsec = static_cast<long>(1e9 * (target - std::floor(target)));
    clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr);
  }
}

// What the camera looks at: a scene from a head, or a printed pattern from a hand.
class Subject {
 public:
  Subject(const Config& config, const Path& path) : path_(path) {
    if (config.pattern) {
      pattern_.emplace(config);
    } else {
      scene_.emplace(config, path);
    }
  }

  [[nodiscard]] std::vector<std::uint8_t> render(double t0_s, std::int64_t sequence) const {
    return pattern_ ? pattern_->render(t0_s, sequence) : scene_->render(t0_s, sequence);
  }

  // After how many frames what is seen repeats; 0: it does not, or not after a whole number.
  [[nodiscard]] std::int64_t period(double rate_hz) const {
    if (!scene_ || !scene_->steady()) return 0;
    const Zoom* zoom = scene_->camera().zoom();
    const std::int64_t turns = whole_frames(path_.period_s(), rate_hz);
    if (zoom == nullptr || !zoom->path().moves()) return turns;
    const std::int64_t zooms = whole_frames(zoom->period_s(), rate_hz);
    return turns > 0 && zooms > 0 ? std::lcm(turns, zooms) : 0;
  }

  void write_truth(const Config& config) {
    const std::filesystem::path& folder = config.truth_dir;
    std::filesystem::create_directories(folder);
    if (pattern_) {
      write_lens_yaml(folder / "truth.yaml", config);
      poses_.emplace(folder / "truth.csv");
    } else {
      write_truth_yaml(folder / "truth.yaml", config, scene_->camera());
      angles_.emplace(folder / "truth.csv", scene_->camera());
    }
  }
  // Nothing without write_truth().
  void add_truth(const FrameEvent& event, double origin_s) {
    if (poses_) poses_->add(event, pattern_->camera().pose(event.capture_s), origin_s);
    if (angles_) angles_->add(event, path_.at(event.capture_s), origin_s);
  }
  void flush_truth() {
    if (poses_) poses_->flush();
    if (angles_) angles_->flush();
  }

 private:
  static std::int64_t whole_frames(double period_s, double rate_hz) {
    const double frames = period_s * rate_hz;
    return std::abs(frames - std::round(frames)) < 1e-6 ? std::llround(frames) : 0;
  }

  const Path& path_;
  std::optional<Renderer> scene_;  // one of the two
  std::optional<PatternRenderer> pattern_;
  std::optional<TruthCsv> angles_;
  std::optional<PatternTruthCsv> poses_;
};

// How many frames stand for all of them.
std::size_t frames_to_render(const Config& config, const Subject& subject) {
  const std::int64_t per_period = subject.period(config.image.rate_hz);
  const double in_all = std::ceil(config.duration * config.image.rate_hz);
  if (per_period == 0 && config.duration <= 0) {
    throw ConfigError(
        "duration_s is missing: this path, zoom, scene or hand does not repeat after a whole "
        "number of frames");
  }
  double count = per_period > 0 ? static_cast<double>(per_period) : in_all;
  if (config.duration > 0) count = std::min(count, in_all);
  return static_cast<std::size_t>(count);
}

std::vector<std::vector<std::uint8_t>> encoded_frames(const Config& config, const Subject& subject,
                                                      std::size_t count,
                                                      const std::atomic<bool>& stop) {
  const int width = config.image.width;
  const int height = config.image.height;
  const EncodingConfig& encoding = config.live.encoding;
  const bool jpeg = encoding.codec == VideoCodec::kMjpeg;
  const auto standard = encoding.codec == VideoCodec::kH265 ? VideoEncoder::Standard::kH265
                                                            : VideoEncoder::Standard::kH264;
  VideoEncoder encoder;
  std::string error;
  if (!jpeg && !encoder.open(standard, width, height, config.image.rate_hz,
                             {encoding.kbit_s, encoding.gop}, &error)) {
    throw std::runtime_error(error);
  }
  std::vector<std::vector<std::uint8_t>> frames(count);
  const auto render = [&](std::size_t i) {
    return subject.render(static_cast<double>(i) / config.image.rate_hz,
                          static_cast<std::int64_t>(i));
  };
  const auto keep_jpeg = [&](std::size_t i) {
    if (!jpeg) return;
    frames[i] = encode_jpeg(frames[i].data(), width, height, width, config.sensor.jpeg_quality);
  };
  PictureFilter filter(config.sensor, config.image);
  // What goes round comes after its own end.
  if (subject.period(config.image.rate_hz) == static_cast<std::int64_t>(count)) {
    for (std::size_t i = count - std::min(count, filter.memory()); i < count && !stop; ++i) {
      std::vector<std::uint8_t> before = render(i);
      filter.apply(&before);
    }
  }
  Progress progress("rendering frame", count);
  const std::size_t batch = 4 * processors();
  for (std::size_t start = 0; start < count && !stop; start += batch) {
    const std::size_t size = std::min(batch, count - start);
    parallel_for(size, [&](std::size_t i) {
      frames[start + i] = render(start + i);
      if (!filter.changes()) keep_jpeg(start + i);
    });
    for (std::size_t i = start; i < start + size; ++i) {
      if (filter.changes()) {
        filter.apply(&frames[i]);
        keep_jpeg(i);
      }
      // The first frame begins the loop anew each time round, so nothing may precede it.
      if (!jpeg) frames[i] = encoder.encode(frames[i].data(), width, i == 0);
      if (frames[i].empty()) throw std::runtime_error("a frame could not be encoded");
    }
    progress.show(start + size);
  }
  return frames;
}

VideoServerOptions video_options(const Config& config) {
  VideoServerOptions options;
  options.port = config.live.rtsp_port;
  const VideoCodec codec = config.live.encoding.codec;
  options.codec = codec == VideoCodec::kH264   ? VideoServerOptions::Codec::kH264
                  : codec == VideoCodec::kH265 ? VideoServerOptions::Codec::kH265
                                               : VideoServerOptions::Codec::kMjpeg;
  options.width = config.image.width;
  options.height = config.image.height;
  options.rate_hz = config.image.rate_hz;
  options.user = config.live.user;
  options.password = config.live.password;
  return options;
}

VideoServerOptions rtp_options(const Config& config) {
  VideoServerOptions options = video_options(config);
  options.rtp_host = config.live.rtp_host;
  options.rtp_port = config.live.rtp_port;
  options.sdp_file = config.live.sdp_file.string();
  return options;
}

HeadServer::Link link_of(LiveConfig::Link link) {
  switch (link) {
    case LiveConfig::Link::kTcp:
      return HeadServer::Link::kTcp;
    case LiveConfig::Link::kUdp:
      return HeadServer::Link::kUdp;
    case LiveConfig::Link::kSerial:
      break;
  }
  return HeadServer::Link::kSerial;
}

// What a live camera tells of itself at one moment.
struct Reading {
  double pan_deg = 0;
  double tilt_deg = 0;
  std::optional<double> zoom;  // device units
  double zoom_part = 0;        // 0 at the wide end, 1 at the tele end
};

const char* onvif_encoding(VideoCodec codec) {
  switch (codec) {
    case VideoCodec::kH264:
      return "H264";
    case VideoCodec::kH265:
      return "H265";
    case VideoCodec::kMjpeg:
      break;
  }
  return "JPEG";
}

// ONVIF in its generic space: -1..1 for half a turn of pan and a quarter of tilt either way, 0..1 for the zoom.
OnvifDevice onvif_device(const Config& config, const std::string& stream_url,
                         const std::function<Reading()>& position) {
  const LiveConfig& live = config.live;
  OnvifDevice device;
  device.stream_url = stream_url;
  device.encoding = onvif_encoding(live.encoding.codec);
  device.encoder_profile = "High";
  device.width = config.image.width;
  device.height = config.image.height;
  device.rate_hz = static_cast<int>(std::lround(config.image.rate_hz));
  device.gov_length = live.encoding.gop > 0 ? live.encoding.gop : device.rate_hz;
  device.login = live.user.empty() ? OnvifDevice::Login::kNone : OnvifDevice::Login::kToken;
  device.user = live.user;
  device.password = live.password;
  device.announced_host.clear();
  device.position = [position] {
    const Reading now = position();
    char text[128];
    std::snprintf(text, sizeof text, R"(<tt:PanTilt x="%.7f" y="%.7f"/><tt:Zoom x="%.7g"/>)",
                  now.pan_deg / 180, now.tilt_deg / 90, now.zoom_part);
    return std::string(text);
  };
  return device;
}

template <class Server>
void start(Server& server) {
  std::string error;
  if (!server.start(&error)) throw std::runtime_error(error);
}

}  // namespace

void serve_live(const Config& given, const std::atomic<bool>& stop) {
  Config config = given;
  if (config.pattern) config.path.amplitude = 0;  // what no hand turns rests
  const double video_latency = config.telemetry.latency - config.camera.clock_offset;
  if (video_latency < 0) {
    throw ConfigError(
        "clock_offset_ms must not exceed the telemetry's latency_ms: live video cannot arrive "
        "before it is captured");
  }
  std::string error;
  if (!VideoServer::validate(video_options(config), &error)) throw ConfigError(error);
  const std::unique_ptr<Path> path = make_path(config);
  Subject subject(config, *path);
  const auto frames = encoded_frames(config, subject, frames_to_render(config, subject), stop);
  if (stop) return;

  if (!config.truth_dir.empty()) subject.write_truth(config);

  VideoServer video(video_options(config));
  start(video);
  std::optional<VideoServer> rtp;
  if (config.live.rtp_port != 0) start(rtp.emplace(rtp_options(config)));

  const double origin = monotonic_now();
  Telemetry telemetry(config, *path);
  VapixServerOptions vapix_options;
  vapix_options.port = config.live.http_port;
  vapix_options.user = config.live.user;
  vapix_options.password = config.live.password;
  std::mutex measuring;  // each server asks on threads of its own
  const std::optional<Zoom> zoom = make_zoom(config);
  const auto position_at = [&](double now) {
    const std::lock_guard<std::mutex> lock(measuring);
    const Angles angles = telemetry.measure(now - origin - config.telemetry.latency);
    Reading reading{angles.pan * kDegreesPerRadian, angles.tilt * kDegreesPerRadian,
                    telemetry.zoom(), 0};
    if (zoom) reading.zoom_part = zoom->part(*reading.zoom);
    return reading;
  };
  const auto position = [&] { return position_at(monotonic_now()); };
  VapixServer vapix(vapix_options, [&](double now) {
    const Reading there = position_at(now);
    return VapixPosition{there.pan_deg, there.tilt_deg, there.zoom.value_or(1)};
  });
  start(vapix);
  const std::string video_url = "rtsp://127.0.0.1:" + std::to_string(video.port()) + "/video";
  std::string ready = "ready " + video_url + " http://127.0.0.1:" + std::to_string(vapix.port());
  std::optional<MjpegStream> mjpeg;
  if (config.live.mjpeg_port) {
    start(mjpeg.emplace(
        MjpegStreamOptions{*config.live.mjpeg_port, config.live.user, config.live.password}));
    ready += " mjpeg=http://127.0.0.1:" + std::to_string(mjpeg->port()) + "/mjpg/video.mjpg";
  }
  std::optional<OnvifServer> onvif;
  if (config.live.onvif_port) {
    onvif.emplace(onvif_device(config, video_url, position), *config.live.onvif_port);
    ready += " onvif=" + onvif->url();
  }
  std::optional<HeadServer> head;
  if (config.live.head) {
    const auto head_position = [&] {
      const Reading now = position();
      const auto steps = std::lround(config.live.head->tele_zoom * now.zoom_part);
      return HeadPosition{now.pan_deg, now.tilt_deg, now.zoom ? static_cast<int>(steps) : 1};
    };
    head.emplace(link_of(config.live.head_link), config.live.head->make(head_position));
    ready += " head=" + head->address();
  }
  std::printf("%s\n", ready.c_str());
  std::fflush(stdout);

  FrameTimeline timeline(config);
  double next_flush = origin;
  while (!stop) {
    FrameEvent event = timeline.next();
    if (config.duration > 0 && event.capture_s >= config.duration) break;
    event.stamp_s += video_latency;
    sleep_until(origin + event.stamp_s, stop);
    if (stop) break;
    const auto& frame = frames[static_cast<std::size_t>(event.sequence) % frames.size()];
    video.push(frame.data(), frame.size(), origin + event.sender_s);
    if (rtp) rtp->push(frame.data(), frame.size(), origin + event.sender_s);
    if (mjpeg) mjpeg->push(frame.data(), frame.size(), origin + event.sender_s);
    subject.add_truth(event, origin);
    if (monotonic_now() >= next_flush) {
      subject.flush_truth();
      next_flush += 1;
    }
  }
  subject.flush_truth();
  if (rtp) rtp->stop();
  if (mjpeg) mjpeg->stop();
  video.stop();
  vapix.stop();
}

}  // namespace alidade::simulator
