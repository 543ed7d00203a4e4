#include "test/simulator/recording_writer.h"

#include <cmath>
#include <cstdio>
#include <functional>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <random>
#include <utility>
#include <vector>

#include "test/simulator/parallel.h"
#include "test/simulator/pattern_renderer.h"
#include "test/simulator/picture_filter.h"
#include "test/simulator/random.h"
#include "test/simulator/renderer.h"
#include "test/simulator/servers/encoder.h"
#include "test/simulator/telemetry.h"
#include "test/simulator/timeline.h"
#include "test/simulator/track_writer.h"
#include "test/simulator/truth.h"
#include "test/simulator/video_writer.h"

namespace alidade::simulator {
namespace {

namespace fs = std::filesystem;
using Images = RecordingConfig::Images;

constexpr double kTelemetryMargin = 1;  // s before the first and after the last frame

void prepare_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (!fs::is_directory(directory)) {
    throw std::runtime_error(directory.string() + ": cannot be made a directory");
  }
  if (!fs::is_empty(directory)) {
    throw std::runtime_error(directory.string() + ": is not empty; name a new directory");
  }
}

std::vector<FrameEvent> all_frames(const Config& config) {
  std::vector<FrameEvent> frames;
  FrameTimeline timeline(config);
  for (FrameEvent event = timeline.next(); event.capture_s < config.duration;
       event = timeline.next()) {
    frames.push_back(event);
  }
  return frames;
}

void write_recording_yaml(const Config& config, const fs::path& directory) {
  OutputFile output(directory / "recording.yaml");
  output.stream() << "format: 1\nwidth: " << config.image.width
                  << "\nheight: " << config.image.height
                  << "\nnotes: made by alidade-simulate, seed " << config.seed << "\n";
  output.flush();
}

void write_frames(const std::vector<FrameEvent>& frames, const Path& path,
                  const CameraModel& camera, const fs::path& directory) {
  OutputFile stamps(directory / "frames.csv");
  TruthCsv truth(directory / "truth.csv", camera);
  stamps.stream() << "frame,receive_time_s,sender_time_s,sequence\n";
  for (const FrameEvent& event : frames) {
    stamps.stream() << event.frame << ',' << event.stamp_s << ',' << event.sender_s << ','
                    << event.sequence << '\n';
    truth.add(event, path.at(event.capture_s), 0);
  }
  stamps.flush();
  truth.flush();
}

void write_telemetry(const Config& config, const Path& path, const fs::path& directory) {
  OutputFile output(directory / "telemetry.csv");
  output.stream() << "receive_time_s,pan_rad,tilt_rad," << (config.zoom ? "zoom," : "")
                  << "sequence\n";
  Telemetry telemetry(config, path);
  JitteredStamps stamps(config.timing.telemetry, config.seed, Stream::kTelemetryStamp);
  const double rate = config.telemetry.rate_hz;
  const auto count = std::llround((config.duration + 2 * kTelemetryMargin) * rate);
  for (std::int64_t i = 0; i < count; ++i) {
    const double time = static_cast<double>(i) / rate - kTelemetryMargin;
    const Angles angles = telemetry.measure(time);
    output.stream() << stamps.stamp(time) + config.camera.clock_offset << ',' << angles.pan << ','
                    << angles.tilt << ',';
    if (config.zoom) output.stream() << telemetry.zoom().value() << ',';
    output.stream() << i << '\n';
  }
  output.flush();
}

// What a person would know of the noise; what is zero is left for the estimator to find.
void write_noise_yaml(const Config& config, const fs::path& directory) {
  OutputFile output(directory / "noise.yaml");
  const auto sigma = [&](const char* name, double value) {
    if (value > 0) output.stream() << name << ": " << value << '\n';
  };
  // A stamp sigma says that stamps scatter to both sides; of late ones it would promise too much.
  const auto stamp_sigma = [](const JitterConfig& jitter) {
    const bool late = jitter.exponential > 0 || jitter.burst_probability > 0;
    return late ? 0 : jitter.sigma;
  };
  std::mt19937_64 generator = make_generator(config.seed, Stream::kPeriods);
  std::normal_distribution<double> normal;
  const auto period = [&](const char* stream, double rate, double period_sigma) {
    const double draw = normal(generator);
    if (period_sigma <= 0) return;
    output.stream() << stream << "_period_s: " << 1 / rate + period_sigma * draw << '\n'
                    << stream << "_period_sigma_s: " << period_sigma << '\n';
  };
  const TimingConfig& timing = config.timing;
  const TelemetryConfig& telemetry = config.telemetry;
  sigma("image_stamp_sigma_s", stamp_sigma(timing.image));
  period("image", config.image.rate_hz, timing.image_period_sigma);
  sigma("telemetry_stamp_sigma_s", stamp_sigma(timing.telemetry));
  period("telemetry", telemetry.rate_hz, timing.telemetry_period_sigma);
  sigma("pan_tilt_sigma_rad",
        std::sqrt(telemetry.sigma * telemetry.sigma + telemetry.quantum * telemetry.quantum / 12));
  if (config.recording.images == Images::kNone) {
    sigma("pixel_sigma_px", config.recording.pixel_sigma);
  }
  output.flush();
}

// As a data sheet would tell it: two digits of the focal length (with a zoom, of that at time 0), nothing else.
void write_guess_yaml(const Config& config, const CameraModel& camera, const fs::path& directory) {
  const double focal_length = camera.lens_at(0).focal_length;
  const double unit = std::pow(10, std::floor(std::log10(focal_length)) - 1);
  const double guess = config.guess_focal_length.value_or(std::round(focal_length / unit) * unit);
  OutputFile output(directory / "guess.yaml");
  output.stream() << "focal_length: {value: " << guess
                  << "}\nradial_distortion: {value: 0}\nclock_offset: {value: 0}\n"
                     "line_delay: {value: 0}\n";
  output.flush();
}

// One picture after the other, as it is kept.
class PictureEncoder {
 public:
  explicit PictureEncoder(const Config& config) : config_(config) {
    const EncodingConfig& encoding = config.recording.encoding;
    if (!has_memory()) return;
    const auto standard = encoding.codec == VideoCodec::kH265 ? VideoEncoder::Standard::kH265
                                                              : VideoEncoder::Standard::kH264;
    std::string error;
    if (!encoder_.open(standard, config.image.width, config.image.height, config.image.rate_hz,
                       {encoding.kbit_s, encoding.gop}, &error)) {
      throw std::runtime_error(error);
    }
  }

  // Whether a picture takes those before it; else encode() may be called from any thread.
  [[nodiscard]] bool has_memory() const {
    return config_.recording.encoding.codec != VideoCodec::kMjpeg;
  }

  [[nodiscard]] std::vector<std::uint8_t> encode(std::vector<std::uint8_t> image) {
    const int width = config_.image.width;
    const int height = config_.image.height;
    if (has_memory()) return encoder_.encode(image.data(), width, false);
    if (config_.recording.images == Images::kVideo) {
      return encode_jpeg(image.data(), width, height, width, config_.sensor.jpeg_quality);
    }
    const cv::Mat picture(height, width, CV_8U, image.data());
    std::vector<std::uint8_t> bytes;
    cv::imencode(config_.recording.images == Images::kPng ? ".png" : ".pgm", picture, bytes,
                 {cv::IMWRITE_PNG_COMPRESSION, 1});
    return bytes;
  }

 private:
  const Config& config_;
  VideoEncoder encoder_;
};

// Before a pattern a head says nothing, and a sender's exact clock would hide the stamps' jitter.
void write_pattern_frames(const std::vector<FrameEvent>& frames, const PatternCamera& camera,
                          const fs::path& directory) {
  OutputFile stamps(directory / "frames.csv");
  PatternTruthCsv truth(directory / "truth.csv");
  stamps.stream() << "frame,receive_time_s,sequence\n";
  for (const FrameEvent& event : frames) {
    stamps.stream() << event.frame << ',' << event.stamp_s << ',' << event.sequence << '\n';
    truth.add(event, camera.pose(event.capture_s), 0);
  }
  stamps.flush();
  truth.flush();
}

using Render = std::function<std::vector<std::uint8_t>(const FrameEvent&)>;

// The video's own stamps are those of frames.csv before a pattern, where the file may be read by itself; else capture times.
void write_images(const Config& config, const std::vector<FrameEvent>& frames, const Render& render,
                  const fs::path& directory) {
  const bool video = config.recording.images == Images::kVideo;
  const char* extension = config.recording.images == Images::kPng ? "png" : "pgm";
  std::optional<VideoWriter> writer;
  if (video) {
    writer.emplace(directory / "video.mkv", config.recording.encoding.codec, config.image.width,
                   config.image.height, config.image.rate_hz);
  } else {
    fs::create_directory(directory / "frames");
  }
  PictureEncoder encoder(config);
  PictureFilter filter(config.sensor, config.image);
  const bool in_order = filter.changes() || encoder.has_memory();
  Progress progress("rendering frame", frames.size());
  // Rendered side by side in batches, written in order.
  const std::size_t batch = 4 * processors();
  for (std::size_t start = 0; start < frames.size(); start += batch) {
    std::vector<std::vector<std::uint8_t>> encoded(std::min(batch, frames.size() - start));
    parallel_for(encoded.size(), [&](std::size_t i) {
      encoded[i] = render(frames[start + i]);
      if (!in_order) encoded[i] = encoder.encode(std::move(encoded[i]));
    });
    for (std::size_t i = 0; i < encoded.size(); ++i) {
      if (in_order) {
        filter.apply(&encoded[i]);
        encoded[i] = encoder.encode(std::move(encoded[i]));
      }
      if (encoded[i].empty()) throw std::runtime_error("a frame could not be encoded");
      if (video) {
        const FrameEvent& event = frames[start + i];
        writer->write(encoded[i], config.pattern ? event.stamp_s : event.capture_s);
        continue;
      }
      std::array<char, 32> name{};
      std::snprintf(name.data(), name.size(), "%06lld.%s",
                    static_cast<long long>(frames[start + i].frame), extension);
      OutputFile file(directory / "frames" / name.data());
      file.stream().write(reinterpret_cast<const char*>(encoded[i].data()),
                          static_cast<std::streamsize>(encoded[i].size()));
      file.flush();
    }
    progress.show(start + encoded.size());
  }
  if (video) writer->finish();
}

void write_pattern_recording(const Config& config, const fs::path& directory) {
  const PatternRenderer renderer(config);
  prepare_directory(directory);
  const std::vector<FrameEvent> frames = all_frames(config);
  write_recording_yaml(config, directory);
  write_pattern_frames(frames, renderer.camera(), directory);
  write_lens_yaml(directory / "truth.yaml", config);
  write_images(
      config, frames,
      [&](const FrameEvent& event) { return renderer.render(event.capture_s, event.sequence); },
      directory);
}

}  // namespace

void write_recording(const Config& config, const fs::path& directory) {
  if (config.duration <= 0) throw ConfigError("duration_s is missing: a recording needs an end");
  if (config.pattern) return write_pattern_recording(config, directory);
  const std::unique_ptr<Path> path = make_path(config);
  const CameraModel camera(config.camera, config.image, *path, make_zoom(config));
  const bool images = config.recording.images != Images::kNone;
  const auto renderer = images ? std::make_unique<Renderer>(config, *path) : nullptr;

  prepare_directory(directory);
  const std::vector<FrameEvent> frames = all_frames(config);
  write_recording_yaml(config, directory);
  write_frames(frames, *path, camera, directory);
  write_telemetry(config, *path, directory);
  write_noise_yaml(config, directory);
  write_guess_yaml(config, camera, directory);
  write_truth_yaml(directory / "truth.yaml", config, camera);
  if (images) {
    write_images(
        config, frames,
        [&](const FrameEvent& event) { return renderer->render(event.capture_s, event.sequence); },
        directory);
  } else {
    write_tracks(config, frames, camera, directory / "tracks.csv");
  }
}

}  // namespace alidade::simulator
