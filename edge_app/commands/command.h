#pragma once
// What the sub-commands share: exit codes, the failure of one line, and functions that make sources
// and the options of a real-time step from a configuration.

#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

#include "core/ground/plane_estimate.h"
#include "edge_app/config/config.h"
#include "edge_app/config/noise_file.h"
#include "edge_app/record/published_calibration.h"
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

// Loads the configuration and logs its warnings; throws CommandError.
Config require_config(const std::string& path);

// Section `video` of a configuration that needs no other (ConfigScope::kVideo); throws
// CommandError.
VideoConfig require_video_config(const std::string& path);

// The calibration in a file, with its zoom curve, without a map. Throws CommandError.
PublishedCalibration require_calibration_file(const std::string& path);

// The calibration of calibration.file. The data sheet's if no file is named, or if calibration.auto
// is set and the file does not exist yet. Throws CommandError.
PublishedCalibration choose_calibration(const Config& config);

// The ground plane that the configuration names; null if it names none. Throws CommandError.
std::shared_ptr<const PlaneEstimate> require_plane(const Config& config);

// A camera that is known only from its data sheet: nominal axes, no offsets, and standard
// deviations large enough to allow for the real ones.
Calibration data_sheet_calibration(const CameraConfig& camera);

// Options of a real-time step with this calibration. The noise is what the configuration, or the
// noise.yaml of a recording, states.
OrientationStepOptions step_options(const Config& config, const PublishedCalibration& calibration);
OrientationStepOptions step_options(const RecordingNoise& noise,
                                    const PublishedCalibration& calibration);

// Never null. decode: frames have images. copy_to: the video stream is copied to this file; empty:
// to none.
std::unique_ptr<FrameSource> make_frame_source(const VideoConfig& config, bool decode,
                                               const std::string& copy_to = "");
std::unique_ptr<PanTiltSource> make_pan_tilt_source(const PanTiltConfig& config);

// A live source may take so much longer than its own timeout to its first item, for the login and a
// first key frame. The source reports earlier what it waits for.
inline constexpr double kConnectSlack_s = 4;

// One line: the link is connected and nothing came.
std::string nothing_came(const std::string& source, double wait_s);

// Logs the frames that a live source received damaged or had to drop, if any.
void log_source_losses(const FrameSource& source);

// Whether the streams are those of a recording. The time stamps of a recording belong to its own
// clock, so live and recorded streams cannot be mixed.
bool is_recording(const Config& config);

bool is_terminal(int descriptor);

}  // namespace alidade
