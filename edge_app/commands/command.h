#pragma once
// What the sub-commands share: exit codes, CommandError, and functions that make sources
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

// Loads the configuration and logs its warnings. For a recording, video.width and video.height
// become the recording's, if it can be read. Throws CommandError if the file cannot be read or is
// not a valid configuration.
Config require_config(const std::string& path);

// Section `video` of a configuration that needs no other section (ConfigScope::kVideo). Throws
// CommandError if the file cannot be read or is not such a configuration.
VideoConfig require_video_config(const std::string& path);

// The calibration in a file, with its zoom curve, without a map. Throws CommandError if the file
// cannot be read or is not a calibration.
PublishedCalibration require_calibration_file(const std::string& path);

// The calibration of calibration.file. The data sheet's if no file is named, or if the file does
// not exist yet, calibration.auto is set and camera.focal_length_px is given. The image size is
// then that of section `video`. If no file is named, camera.focal_length_px must be set, as
// parse_config() demands. Throws CommandError if the file cannot be used, or if it is for another
// image size than section `video` states for a live video.
PublishedCalibration choose_calibration(const Config& config);

// The ground plane that the configuration names; null if it names none. Throws CommandError if its
// file cannot be read or is not a plane.
std::shared_ptr<const PlaneEstimate> require_plane(const Config& config);

// A camera that is known only from its data sheet, with nominal axes and a clock offset of 0.
// camera.focal_length_px must be set. Sigmas: 0.05 rad for each axis, 0.1 s for the clock offset,
// that of the focal length if its range is given, 0 (exact) for all else. Sets no image size.
Calibration data_sheet_calibration(const CameraConfig& camera);

// Options of a real-time step with this calibration. The noise is what the configuration, or the
// noise.yaml of a recording, states. With a Config: throws CommandError if pan_error or tilt_error
// changes faster than the steps of pan_tilt.angle_quantum_rad can show.
OrientationStepOptions step_options(const Config& config, const PublishedCalibration& calibration);
OrientationStepOptions step_options(const RecordingNoise& noise,
                                    const PublishedCalibration& calibration);

// Never null. decode: frames have images.
std::unique_ptr<FrameSource> make_frame_source(const VideoConfig& config, bool decode);
// Never null. With type `none` the stream ends at once (ReadStatus::kEnd).
std::unique_ptr<PanTiltSource> make_pan_tilt_source(const PanTiltConfig& config);

// s. A live source has its own timeout and this much more until its first item must be there: for
// the login and a first key frame. The source's own error, if it has one, comes earlier.
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
