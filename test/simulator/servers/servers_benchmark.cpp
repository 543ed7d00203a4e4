// Latency of the virtual camera's servers over loopback: from push() of an encoded frame to its
// packet in a libavformat client (mean, p50, p95), and one digest-authenticated VAPIX poll.
#include <benchmark/benchmark.h>
#include <curl/curl.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <thread>
#include <vector>

#include "test/simulator/servers/av_client.h"
#include "test/simulator/servers/encoder.h"
#include "test/simulator/servers/vapix_server.h"
#include "test/simulator/servers/video_server.h"

namespace alidade {
namespace {

constexpr int kWidth = 1280;
constexpr int kHeight = 720;

std::vector<std::uint8_t> jpeg_with_number(int number) {
  const auto picture = numbered_picture(kWidth, kHeight, number);
  return encode_jpeg(picture.data(), kWidth, kHeight, kWidth, 85);
}

void add_percentiles(benchmark::State& state, std::vector<double> latency_s) {
  std::sort(latency_s.begin(), latency_s.end());
  state.counters["p50_ms"] = 1e3 * latency_s[latency_s.size() / 2];
  state.counters["p95_ms"] = 1e3 * latency_s[latency_s.size() * 95 / 100];
}

void mjpeg_frame(benchmark::State& state, Transport transport) {
  VideoServerOptions options;
  options.width = kWidth;
  options.height = kHeight;
  VideoServer server(options);
  std::string error;
  if (!server.start(&error)) return state.SkipWithError(error.c_str());
  constexpr int kWarmUp = 0;
  constexpr int kMeasured = 1;
  const auto warm_up = jpeg_with_number(kWarmUp);
  const auto measured = jpeg_with_number(kMeasured);
  AvClient client;
  std::atomic<bool> opened{false};
  std::thread pusher([&] {
    while (!opened) {
      server.push(warm_up.data(), warm_up.size(), monotonic_s());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  const int status =
      client.open("rtsp://127.0.0.1:" + std::to_string(server.port()) + "/video", transport);
  opened = true;
  pusher.join();
  if (status < 0) return state.SkipWithError("no stream");
  std::vector<double> latency_s;
  while (state.KeepRunning()) {
    const double pushed_s = monotonic_s();
    server.push(measured.data(), measured.size(), pushed_s);
    auto frame = client.read();
    while (frame && frame->number != kMeasured) frame = client.read();
    if (!frame) return state.SkipWithError("a frame was lost");
    latency_s.push_back(frame->receive_time_s - pushed_s);
    state.SetIterationTime(latency_s.back());
  }
  add_percentiles(state, latency_s);
}

std::size_t ignore(char*, std::size_t size, std::size_t count, void*) { return size * count; }

void vapix_poll(benchmark::State& state) {
  VapixServerOptions options;
  options.user = "root";
  options.password = "pass";
  VapixServer server(options, [](double) { return VapixPosition{1, 2, 3}; });
  std::string error;
  if (!server.start(&error)) return state.SkipWithError(error.c_str());
  const std::string url =
      "http://127.0.0.1:" + std::to_string(server.port()) + "/axis-cgi/com/ptz.cgi?query=position";
  CURL* curl = curl_easy_init();
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_NOPROXY, "*");
  curl_easy_setopt(curl, CURLOPT_HTTPAUTH, CURLAUTH_DIGEST);
  curl_easy_setopt(curl, CURLOPT_USERPWD, "root:pass");
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, ignore);
  std::vector<double> latency_s;
  while (state.KeepRunning()) {
    const double sent_s = monotonic_s();
    if (curl_easy_perform(curl) != CURLE_OK) {
      state.SkipWithError("no answer");
      break;
    }
    latency_s.push_back(monotonic_s() - sent_s);
    state.SetIterationTime(latency_s.back());
  }
  curl_easy_cleanup(curl);
  if (!latency_s.empty()) add_percentiles(state, latency_s);
}

BENCHMARK_CAPTURE(mjpeg_frame, rtsp_tcp, Transport::kTcp)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(mjpeg_frame, rtsp_udp, Transport::kUdp)
    ->UseManualTime()
    ->Unit(benchmark::kMillisecond);
BENCHMARK(vapix_poll)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace alidade

BENCHMARK_MAIN();
