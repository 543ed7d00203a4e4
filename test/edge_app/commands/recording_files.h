#pragma once
// A simulated recording as the files that a person has.

#include <sstream>
#include <string>
#include <vector>

#include "test/support/simulated_recording.h"
#include "test/support/temporary_directory.h"

namespace alidade::test {

inline void write_frames(const TemporaryDirectory& directory, const CalibrationInput& input) {
  std::ostringstream text;
  text.precision(17);
  text << "frame,receive_time_s,sequence\n";
  for (const CalibrationFrame& frame : input.frames) {
    text << frame.frame << ',' << frame.stamp_s << ',' << *frame.sequence << '\n';
  }
  directory.write("frames.csv", text.str());
}

// zoom: of each sample; empty: the file has no such column.
inline void write_telemetry(const TemporaryDirectory& directory, const CalibrationInput& input,
                            double unit_rad = 1, const std::vector<double>& zoom = {}) {
  std::ostringstream text;
  text.precision(17);
  text << "receive_time_s,pan_rad,tilt_rad,sequence" << (zoom.empty() ? "\n" : ",zoom\n");
  for (std::size_t i = 0; i < input.telemetry.size(); ++i) {
    const CalibrationTelemetry& sample = input.telemetry[i];
    text << sample.stamp_s << ',' << sample.pan_rad / unit_rad << ',' << sample.tilt_rad / unit_rad
         << ',' << *sample.sequence;
    if (!zoom.empty()) text << ',' << zoom[i];
    text << '\n';
  }
  directory.write("telemetry.csv", text.str());
}

inline std::string tracks_text(const CalibrationInput& input) {
  std::ostringstream text;
  text.precision(17);
  text << "frame,landmark,u_px,v_px,sigma_px\n";
  for (const CalibrationObservation& o : input.observations) {
    text << o.frame << ',' << o.landmark << ',' << o.u_px << ',' << o.v_px << ',' << o.sigma_px
         << '\n';
  }
  return text.str();
}

inline void write_noise(const TemporaryDirectory& directory, const CalibrationNoise& noise) {
  std::ostringstream text;
  text.precision(17);
  const auto write = [&text](const char* name, const std::optional<double>& value) {
    if (value) text << name << ": " << *value << '\n';
  };
  write("image_stamp_sigma_s", noise.image_stamp_sigma_s);
  write("image_period_s", noise.image_period_s);
  write("image_period_sigma_s", noise.image_period_sigma_s);
  write("telemetry_stamp_sigma_s", noise.telemetry_stamp_sigma_s);
  write("telemetry_period_s", noise.telemetry_period_s);
  write("telemetry_period_sigma_s", noise.telemetry_period_sigma_s);
  write("pan_tilt_sigma_rad", noise.pan_tilt_sigma_rad);
  directory.write("noise.yaml", text.str());
}

inline void write_recording(const TemporaryDirectory& directory, const CalibrationInput& input) {
  directory.write("recording.yaml", "format: 1\nwidth: " + std::to_string(input.width) +
                                        "\nheight: " + std::to_string(input.height) + "\n");
  write_frames(directory, input);
  write_telemetry(directory, input);
  directory.write("tracks.csv", tracks_text(input));
  write_noise(directory, input.noise);
}

}  // namespace alidade::test
