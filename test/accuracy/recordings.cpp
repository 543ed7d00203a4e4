#include "test/accuracy/recordings.h"

#include <yaml-cpp/yaml.h>

#include <cmath>
#include <filesystem>
#include <map>

#include "platform/storage/csv_reader.h"
#include "platform/storage/recording.h"

namespace alidade::test {
namespace {

constexpr const char* kFour[] = {"focal_length", "radial_distortion", "clock_offset", "line_delay"};

double value_of(const YAML::Node& file, const char* key, const char* member = "value") {
  return file[key][member].as<double>();
}

Eigen::Vector3d axis_of(const YAML::Node& file, const char* key) {
  const auto axis = file[key]["value"].as<std::vector<double>>();
  return Eigen::Vector3d(axis.at(0), axis.at(1), axis.at(2)).normalized();
}

void read_truth(const YAML::Node& truth, const YAML::Node& noise, Simulation* s) {
  s->focal_length = value_of(truth, "focal_length");
  s->aspect = value_of(truth, "aspect");
  s->radial_distortion = value_of(truth, "radial_distortion");
  s->clock_offset = value_of(truth, "clock_offset");
  s->line_delay = value_of(truth, "line_delay");
  s->pan_axis = axis_of(truth, "pan_axis");
  s->tilt_axis = axis_of(truth, "tilt_axis");
  s->pan_scale = value_of(truth, "pan_scale");
  s->tilt_scale = value_of(truth, "tilt_scale");
  const auto sigma = [&](const char* key) { return noise[key].as<double>(); };
  s->pixel_sigma = sigma("pixel_sigma_px");
  s->pan_tilt_sigma = sigma("pan_tilt_sigma_rad");
  s->image_stamp_sigma_s = sigma("image_stamp_sigma_s");
  s->telemetry_stamp_sigma_s = sigma("telemetry_stamp_sigma_s");
  s->image_period_sigma_s = sigma("image_period_sigma_s");
  s->telemetry_period_sigma_s = sigma("telemetry_period_sigma_s");
  s->image_rate_hz = 1 / sigma("image_period_s");
  s->telemetry_rate_hz = 1 / sigma("telemetry_period_s");
}

// The direction that appears at a pixel at a time, by Newton's steps on the simulator's projection.
Eigen::Vector3d direction_at(const Simulation& s, double time, double u, double v) {
  const Eigen::Vector2d angle = s.angles(time);
  const Eigen::Matrix3d R = internal::camera_to_base(s, angle);
  Eigen::Vector2d slope((u - s.width / 2.0) / s.focal_length,
                        (v - s.height / 2.0) / s.focal_length);
  const Eigen::Vector2d target(u, v);
  for (int i = 0; i < 5; ++i) {
    Eigen::Vector2d pixel = target;
    const Eigen::Vector3d d = R * Eigen::Vector3d(slope[0], slope[1], 1);
    if (!internal::pixel_at(s, angle, d, &pixel[0], &pixel[1])) break;
    slope += (target - pixel) / s.focal_length;
  }
  return (R * Eigen::Vector3d(slope[0], slope[1], 1)).normalized();
}

bool read_tables(const std::string& directory, GivenRecording* given, std::string* error) {
  CalibrationInput& input = given->recording.input;
  std::vector<FrameStamp> frames;
  std::vector<PanTiltSample> samples;
  if (!read_frames_csv(directory, &frames, error)) return false;
  if (!read_telemetry_csv(directory, &samples, error)) return false;
  for (const FrameStamp& frame : frames) {
    input.frames.push_back({frame.frame, frame.receive_time_s, frame.sequence});
  }
  for (const PanTiltSample& sample : samples) {
    input.telemetry.push_back(
        {sample.latest_time_s, sample.pan_rad, sample.tilt_rad, sample.sequence});
    given->recording.telemetry_time_s.push_back(sample.latest_time_s -
                                                given->simulation.clock_offset);
  }
  given->recording.telemetry_is_outlier.assign(samples.size(), false);

  std::map<std::int64_t, double> time_of_frame;
  double worst = 0;
  if (!read_csv(
          directory + "/truth.csv",
          {{"frame", true, true},
           {"time_s", true, false},
           {"pan_rad", true, false},
           {"tilt_rad", true, false}},
          [&](const CsvCells& cells) {
            const double time = *cells[1];
            time_of_frame[static_cast<std::int64_t>(*cells[0])] = time;
            const Eigen::Vector2d angle(*cells[2], *cells[3]);
            worst = std::max(worst, (angle - given->simulation.angles(time)).norm());
            return std::string();
          },
          error)) {
    return false;
  }
  // A tenth of a pixel: the bound needs no better.
  if (worst * given->simulation.focal_length > 0.1) {
    *error = directory + "/truth.csv: not the published path, off by " + std::to_string(worst) +
             " rad; bounds are known for that one alone";
    return false;
  }
  for (const CalibrationFrame& frame : input.frames) {
    given->recording.frame_time_s.push_back(time_of_frame.at(frame.frame));
  }

  std::vector<TrackPoint> tracks;
  if (!read_tracks_csv(directory, &tracks, error)) return false;
  std::map<std::int64_t, std::int64_t> landmark_of;
  for (const TrackPoint& point : tracks) {
    const auto next = static_cast<std::int64_t>(landmark_of.size());
    const auto [landmark, is_new] = landmark_of.emplace(point.landmark, next);
    input.observations.push_back(
        {point.frame, landmark->second, point.u_px, point.v_px, point.sigma_px});
    if (!is_new) continue;
    const double time = time_of_frame.at(point.frame) + point.v_px * given->simulation.line_delay;
    given->recording.landmarks.push_back(
        direction_at(given->simulation, time, point.u_px, point.v_px));
  }
  given->recording.observation_is_outlier.assign(input.observations.size(), false);
  return true;
}

}  // namespace

bool read_given_recording(const std::string& directory, GivenRecording* given, std::string* error) {
  *given = {};
  given->name = std::filesystem::path(directory).filename().string();
  try {
    const YAML::Node noise = YAML::LoadFile(directory + "/noise.yaml");
    read_truth(YAML::LoadFile(directory + "/truth.yaml"), noise, &given->simulation);
    CalibrationInput& input = given->recording.input;
    RecordingInfo info;
    if (!read_recording_info(directory, &info, error)) return false;
    input.width = given->simulation.width = info.width;
    input.height = given->simulation.height = info.height;
    input.noise.image_stamp_sigma_s = given->simulation.image_stamp_sigma_s;
    input.noise.image_period_s = noise["image_period_s"].as<double>();
    input.noise.image_period_sigma_s = given->simulation.image_period_sigma_s;
    input.noise.telemetry_stamp_sigma_s = given->simulation.telemetry_stamp_sigma_s;
    input.noise.telemetry_period_s = noise["telemetry_period_s"].as<double>();
    input.noise.telemetry_period_sigma_s = given->simulation.telemetry_period_sigma_s;
    input.noise.pan_tilt_sigma_rad = given->simulation.pan_tilt_sigma;
    given->options.pan_scale.sigma = given->options.tilt_scale.sigma =
        noise["pan_tilt_scale_sigma"].as<double>();
    const YAML::Node peer = YAML::LoadFile(directory + "/peer.yaml");
    for (int i = 0; i < 4; ++i) {
      given->peer[i] = value_of(peer, kFour[i]);
      given->peer_sigma[i] = value_of(peer, kFour[i], "sigma");
    }
    given->peer_pan_axis = axis_of(peer, "pan_axis");
    given->peer_tilt_axis = axis_of(peer, "tilt_axis");
    given->peer_cpu_s = peer["cpu_s"].as<double>();
    if (std::filesystem::exists(directory + "/limit.yaml")) {
      const YAML::Node limit = YAML::LoadFile(directory + "/limit.yaml");
      given->limit = FourParameters(
          limit["focal_length_rel"].as<double>(), limit["radial_distortion"].as<double>(),
          limit["clock_offset_s"].as<double>(), limit["line_delay_s"].as<double>());
    }
    return read_tables(directory, given, error);
  } catch (const YAML::Exception& flaw) {
    *error = directory + ": " + flaw.what();
  } catch (const std::out_of_range&) {
    *error = directory + ": a table names a frame that truth.csv does not have";
  }
  return false;
}

}  // namespace alidade::test
