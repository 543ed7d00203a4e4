#include "edge_app/commands/localize.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/mapping/localization.h"
#include "core/mapping/map_building.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/localization_json.h"
#include "edge_app/commands/map_recording.h"
#include "edge_app/storage/scene_map_file.h"
#include "platform/system/whole_file.h"
#include "platform/video/picture_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;

void write_line(const ordered_json& json) {
  const std::string line = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
  std::fputs(line.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
}

class Asking {
 public:
  Asking(const LocalizeCommand& options, const SceneMap& map)
      : options_(options),
        localizer_(map),
        detector_(localization_features(false)),
        quick_(localization_features(true)),
        width_(map.lens.width()),
        height_(map.lens.height()),
        line_delay_(map.line_delay),
        mechanics_(map.mechanics.value_or(Mechanics<double>())) {}

  void picture(const std::string& path) {
    Picture picture;
    std::string error;
    if (!open_to_read(path, &error).is_open()) throw CommandError(kExitUsage, error);
    if (!read_picture_file(path, &picture, &error)) throw CommandError(kExitUsage, error);
    require_size(path, picture.width, picture.height);
    ordered_json json;
    json["picture"] = path;
    add_localization(localizer_.find(features_of(
                         detector_, {picture.luma, picture.width, picture.height, picture.stride})),
                     mechanics_, &json);
    write_line(json);
  }

  void recording(const std::string& directory) {
    const MapRecording recording = load_map_recording(directory, !options_.no_telemetry);
    require_size(directory, recording.info.width, recording.info.height);
    std::optional<PublishedCalibration> calibration;
    if (!options_.calibration.empty()) {
      calibration = require_calibration_file(options_.calibration);
    }
    const Calibration* known = calibration ? &calibration->calibration : nullptr;
    const FocalLengthKnowledge focal_lengths =
        known != nullptr ? FocalLengthKnowledge(*known, calibration->zoom_curve)
                         : FocalLengthKnowledge();
    std::vector<std::size_t> frames;
    for (std::size_t i = 0; i < recording.frames.size();
         i += static_cast<std::size_t>(options_.every)) {
      frames.push_back(i);
    }
    for_each_picture(recording, frames, [&](std::size_t frame, const ImageView& image) {
      const FrameStamp& stamp = recording.frames[frame];
      const MapView view = map_view(recording, stamp, known, focal_lengths);
      LocalizationHint hint;
      const double line_delay =
          known != nullptr && known->line_delay != 0 ? known->line_delay : line_delay_;
      if (view.telemetry) {
        hint.angular_velocity = view.angular_velocity;
        hint.zoom_rate = view.zoom_rate;
        hint.line_delay = line_delay;
        hint.motion_doubt = motion_doubt(recording, stamp, known, focal_lengths, view, line_delay);
      }
      if (view.telemetry && view.log_f) {
        hint.R_base_from_camera =
            R_base_from_camera(mechanics_, true_from_measured(mechanics_, *view.telemetry));
        hint.R_sigma = view.angle_sigma;
        hint.focal_length = FocalLengthPrior{*view.log_f, 0.02};
      }
      ordered_json json;
      json["recording"] = directory;
      json["frame"] = stamp.frame;
      json["receive_time_s"] = stamp.receive_time_s;
      if (view.zoom) json["zoom"] = *view.zoom;
      Localization found;
      if (hint.focal_length) found = localizer_.find(features_of(quick_, image), hint);
      if (found.status != LocalizationStatus::kOk) {
        found = localizer_.find(features_of(detector_, image), hint);
      }
      add_localization(found, mechanics_, &json);
      write_line(json);
    });
  }

 private:
  void require_size(const std::string& what, int width, int height) const {
    if (width == width_ && height == height_) return;
    throw CommandError(kExitUsage, fmt::format("{}: {}x{} px, but {} is for {}x{} px; a map is for "
                                               "pictures of its own camera and size",
                                               what, width, height, options_.map, width_, height_));
  }

  const LocalizeCommand& options_;
  Localizer localizer_;
  FeatureDetector detector_;
  FeatureDetector quick_;
  int width_, height_;
  double line_delay_;
  Mechanics<double> mechanics_;
};

}  // namespace

int localize_pictures(const LocalizeCommand& options) {
  SceneMap map;
  std::string error;
  if (!load_scene_map(options.map, &map, &error)) throw CommandError(kExitUsage, error);
  Asking asking(options, map);
  for (const std::string& path : options.pictures) {
    if (fs::is_directory(path)) {
      asking.recording(path);
    } else {
      asking.picture(path);
    }
  }
  return kExitOk;
}

}  // namespace alidade
