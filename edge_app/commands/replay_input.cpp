#include "edge_app/commands/replay_input.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <system_error>

#include "edge_app/storage/calibration_store.h"

namespace alidade {

namespace fs = std::filesystem;

PublishedCalibration find_calibration(const std::string& recording,
                                      const std::string& calibration) {
  if (!calibration.empty()) {
    std::error_code ignored;
    if (fs::exists(calibration, ignored)) return require_calibration_file(calibration);
    if (const std::vector<std::string> zooms = calibrations_of_zooms(calibration); !zooms.empty()) {
      const std::size_t shown = std::min<std::size_t>(zooms.size(), 4);
      throw CommandError(
          kExitUsage,
          fmt::format("{}: there is no such file, as the camera tells its zoom; give that of the "
                      "recording's zoom: {}{}",
                      calibration, fmt::join(zooms.begin(), zooms.begin() + shown, ", "),
                      shown < zooms.size() ? ", ..." : ""));
    }
    return require_calibration_file(calibration);
  }
  const fs::path beside = fs::path(recording) / "alidade" / "calibration.yaml";
  if (!fs::exists(beside)) {
    throw CommandError(
        kExitUsage,
        fmt::format("{0}: has no calibration ({1}); make one with `alidade calibrate {0}`, or give "
                    "the calibration.file of `alidade run` with --calibration FILE",
                    recording, beside.string()));
  }
  return require_calibration_file(beside.string());
}

std::string size_error(const RecordingInfo& info, const PublishedCalibration& calibration,
                       const std::string& recording) {
  const Camera<double>& camera = calibration.calibration.camera;
  if (info.width == camera.width && info.height == camera.height) return "";
  return fmt::format(
      "{}: frames have {}x{} px, but {} is for {}x{} px; give a calibration for this "
      "size with --calibration, or set video.width and video.height to the calibration's "
      "size and record again",
      recording, info.width, info.height, calibration.name, camera.width, camera.height);
}

bool has_images(const std::string& recording) {
  std::error_code ignored;
  return fs::exists(fs::path(recording) / "video.mkv", ignored) ||
         fs::is_directory(fs::path(recording) / "frames", ignored);
}

RecordedImages::RecordedImages(const std::string& recording)
    : source_(open_recorded_frames({recording, true, false})) {
  next_ = next_of<Frame>(*source_);
  if (!next_) {
    throw CommandError(kExitFailed, recording + ": none of its pictures can be decoded");
  }
}

std::optional<Frame> RecordedImages::of(const FrameStamp& stamp) {
  std::optional<Frame> frame;
  if (next_ && next_->stamp.frame == stamp.frame &&
      next_->stamp.receive_time_s == stamp.receive_time_s) {
    frame = std::move(next_);
    next_ = next_of<Frame>(*source_);
  }
  return frame;
}

ImageView view_of(const std::optional<Frame>& image) {
  if (!image) return {};
  return {image->luma, image->width, image->height, image->stride};
}

}  // namespace alidade
