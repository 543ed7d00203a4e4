#pragma once
// What the sub-commands share: exit codes, the one-line failure, and the way from a configuration to
// sources and to the options of a real-time step.

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "core/ground/plane_estimate.h"
#include "edge_app/config/config.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/step/orientation_step.h"
#include "platform/pan_tilt/pan_tilt_source.h"
#include "platform/video/frame_source.h"

namespace alidade {

enum ExitCode : int { kExitOk = 0, kExitFailed = 1, kExitUsage = 2 };

// Ends the command with one line on stderr: what is wrong, where, what would be right.
struct CommandError : std::runtime_error {
  CommandError(ExitCode code, const std::string& line)
      : std::runtime_error(line), exit_code(code) {}
  ExitCode exit_code;
};

// Loads it and logs its warnings; throws CommandError.
Config require_config(const std::string& path);

// The video of a configuration of which the rest need not be there (ConfigScope::kVideo); throws CommandError.
VideoConfig require_video_config(const std::string& path);

// A calibration with what a person calls it.
struct NamedCalibration {
  Calibration calibration;
  bool calibrated = false;  // false: the data sheet's values
  std::string name;         // file, or "data sheet"
  ZoomCurve zoom_curve;     // of the file; may be empty
};

NamedCalibration require_calibration_file(const std::string& path);

// The file's calibration; the data sheet's if there is no file, or not yet (calibration.auto).
NamedCalibration choose_calibration(const Config& config);

// The ground plane that the configuration names; null if it names none.
std::shared_ptr<const PlaneEstimate> require_plane(const Config& config);

// A camera known from its data sheet only: nominal axes, no offsets, and standard deviations that admit it.
Calibration data_sheet_calibration(const CameraConfig& camera);

// With the noise the configuration states, or the noise.yaml of a recording.
OrientationStepOptions step_options(const Config& config, const NamedCalibration& calibration);
OrientationStepOptions step_options(const RecordingNoise& noise,
                                    const NamedCalibration& calibration);

// decode: with images. copy_to: a file for the video stream; empty: none.
std::unique_ptr<FrameSource> make_frame_source(const VideoConfig& config, bool decode,
                                               const std::string& copy_to = "");
std::unique_ptr<PanTiltSource> make_pan_tilt_source(const PanTiltConfig& config);

// What a live source may take to its first item, beyond its own timeout, s: logging in, and a first key frame; longer than it takes
// a source to say that it waits.
inline constexpr double kConnectSlack_s = 4;

// One line: the link stands, and brings nothing.
std::string nothing_came(const std::string& source, double wait_s);

// Logs the frames that a live source received damaged or had to drop, if any.
void log_source_losses(const FrameSource& source);

// Recordings bear the stamps of their own clock, so that live and recorded streams cannot be mixed.
bool is_recording(const Config& config);

bool is_terminal(int descriptor);

}  // namespace alidade
