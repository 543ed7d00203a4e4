#pragma once
// Simulated recordings that others made, from folders: the recording format (platform/storage) with
//   tracks.csv   frame,landmark,u_px,v_px,sigma_px        noise.yaml   what is known of the noise
//   truth.yaml, truth.csv (frame,time_s,pan_rad,tilt_rad) the truth
//   peer.yaml    what another program estimated           limit.yaml   its bound (may be absent)
// The published path is assumed and checked against truth.csv. Landmarks are where the truth puts
// their first observation: its noise does not matter to a bound.

#include <optional>
#include <string>

#include "test/support/simulated_recording.h"

namespace alidade::test {

// Of four parameters: focal length (relative), radial distortion, clock offset, line delay.
using FourParameters = Eigen::Vector4d;

struct GivenRecording {
  std::string name;
  Simulation simulation;  // the truth
  SimulatedRecording recording;
  CalibrationOptions options;
  FourParameters peer = FourParameters::Zero();  // estimates; the focal length in px
  FourParameters peer_sigma = FourParameters::Zero();
  Eigen::Vector3d peer_pan_axis;
  Eigen::Vector3d peer_tilt_axis;
  double peer_cpu_s = 0;
  std::optional<FourParameters> limit;
};

// False: *error says what is wrong, in one line.
[[nodiscard]] bool read_given_recording(const std::string& directory, GivenRecording* given,
                                        std::string* error);

}  // namespace alidade::test
