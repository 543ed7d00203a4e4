#include "edge_app/commands/map_build.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/mapping/keyframe_choice.h"
#include "core/mapping/lens_prior.h"
#include "core/mapping/map_building.h"
#include "core/model/recording_needs.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/map_recording.h"
#include "edge_app/commands/map_report.h"
#include "edge_app/commands/output_directory.h"
#include "edge_app/storage/scene_map_file.h"
#include "edge_app/taps/small_image.h"
#include "platform/video/jpeg_decoder.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

struct Chosen {
  std::size_t recording;
  std::size_t frame;  // index into the views of that recording
};

std::optional<PublishedCalibration> calibration_of(const MapBuildCommand& options) {
  if (!options.calibration.empty()) return require_calibration_file(options.calibration);
  const fs::path beside = fs::path(options.recordings.front()) / "alidade" / "calibration.yaml";
  if (!fs::exists(beside)) return std::nullopt;
  return require_calibration_file(beside.string());
}

void require_one_size(const std::vector<MapRecording>& recordings) {
  const RecordingInfo& first = recordings.front().info;
  for (const MapRecording& each : recordings) {
    if (each.info.width == first.width && each.info.height == first.height) continue;
    throw CommandError(
        kExitUsage,
        fmt::format(
            "{}: frames have {}x{} px, those of {} have {}x{}; a map is for one camera at one size",
            each.directory, each.info.width, each.info.height, recordings.front().directory,
            first.width, first.height));
  }
}

// How fast the pictures of a map may turn.
struct Pace {
  double readout_s = 0;    // s, of a whole picture
  bool is_known = false;   // a calibration is given; then telemetry gives each row's orientation
  std::size_t frames = 0;  // frames whose speed telemetry gives
  std::size_t fast = 0;    // of these, the ones that are too fast
  double longest_f = 0;    // px, the longest focal length of them
  [[nodiscard]] double most_motion_px() const {
    return is_known ? kSlowMotionCalibrated_px : kSlowMotion_px;
  }
  [[nodiscard]] double most_haste() const { return most_motion_px() / kSlowMotion_px; }

  // For the person who turns the camera.
  [[nodiscard]] std::string text() const {
    const double most_px = most_motion_px();
    std::string out = fmt::format("so slowly that a picture moves by at most {:g} px", most_px);
    if (longest_f == 0) return out + " while it is read out";
    out += fmt::format(
        " in the {:.3g} ms in which it is read out, {:.2g} deg/s at a focal length of "
        "{:.0f} px",
        1e3 * readout_s, 180 / kPi * most_px / longest_f / readout_s, longest_f);
    if (!is_known) {
      out += fmt::format(
          " (that read-out time is a guess; with a calibration of `alidade calibrate` beside the "
          "first recording, or by --calibration, {:g} px are allowed)",
          kSlowMotionCalibrated_px);
    }
    return out;
  }
};

// The read-out time if nothing states it.
constexpr double kGuessedReadout_s = 0.03;

// Chooses the frames that become keyframes, at most `most`. Frames with telemetry are chosen by
// place, in addition to the keyframes of `there`; the others evenly over time. Slow frames come
// first. A place that no slow frame shows is taken from the slowest frame that shows it.
std::vector<Chosen> choose(const std::vector<MapRecording>& recordings,
                           const std::vector<std::vector<MapView>>& views, const SceneMap& there,
                           const MapBuildOptions& build, int most, Pace* pace) {
  struct Fast {
    double haste;
    Chosen chosen;
    SeenPlace place;
  };
  std::vector<Fast> fast;
  KeyframeChoice choice(build.width, build.height);
  for (const SceneKeyframe& k : there.keyframes) {
    if (k.telemetry) choice.keep({*k.telemetry, k.position});
  }
  std::vector<Chosen> placed;
  std::vector<Chosen> others;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    for (std::size_t i = 0; i < views[r].size(); ++i) {
      const MapView& view = views[r][i];
      if (!view.telemetry || !view.log_f) {
        const bool has_angles = recordings[r].has_angles && !recordings[r].telemetry.empty();
        if (!has_angles || !view.log_f) others.push_back({r, i});
        continue;
      }
      const double haste =
          choice.haste(*view.log_f, view.angular_velocity.norm(), view.zoom_rate, pace->readout_s);
      const SeenPlace place{*view.telemetry, *view.log_f};
      ++pace->frames;
      pace->longest_f = std::max(pace->longest_f, std::exp(*view.log_f));
      if (haste > 1) {
        fast.push_back({haste, {r, i}, place});
        if (haste <= pace->most_haste()) continue;
        ++pace->fast;
      } else if (choice.is_new(place)) {
        choice.keep(place);
        placed.push_back({r, i});
      }
    }
  }
  std::stable_sort(fast.begin(), fast.end(),
                   [](const Fast& a, const Fast& b) { return a.haste < b.haste; });
  for (const Fast& one : fast) {
    if (one.haste > pace->most_haste()) break;
    if (!choice.is_new(one.place)) continue;
    choice.keep(one.place);
    placed.push_back(one.chosen);
  }
  const auto thinned = [](const std::vector<Chosen>& all, std::size_t count) {
    if (all.size() <= count) return all;
    std::vector<Chosen> some;
    for (std::size_t i = 0; i < count; ++i) some.push_back(all[i * all.size() / count]);
    return some;
  };
  const auto limit = static_cast<std::size_t>(most);
  std::vector<Chosen> out = thinned(placed, limit);
  const std::vector<Chosen> rest = thinned(others, limit - std::min(limit, out.size()));
  out.insert(out.end(), rest.begin(), rest.end());
  std::sort(out.begin(), out.end(), [](const Chosen& a, const Chosen& b) {
    return std::pair(a.recording, a.frame) < std::pair(b.recording, b.frame);
  });
  return out;
}

// The whole lens over the zooms of the views. Nothing if a view is not of this calibration, as one
// of an older map that another one made.
std::optional<LensPrior> prior_of(const PublishedCalibration& known,
                                  const std::vector<MapView>& views,
                                  const LensPriorOptions& options) {
  constexpr double kOneZoom = 0.01;  // of log f
  const auto by_log_f = [](const MapView& a, const MapView& b) { return *a.log_f < *b.log_f; };
  if (!std::all_of(views.begin(), views.end(), [](const MapView& view) { return view.log_f; }))
    return std::nullopt;
  const auto [least, most] = std::minmax_element(views.begin(), views.end(), by_log_f);
  LensPrior prior;
  if (known.zoom_curve.empty()) {
    prior = lens_prior(known.calibration, options);
  } else if (!least->zoom || !most->zoom) {
    return std::nullopt;
  } else if (*most->log_f - *least->log_f < kOneZoom) {
    Calibration there;
    if (!known.zoom_curve.at(*least->zoom, &there)) return std::nullopt;
    prior = lens_prior(there, options);
  } else {
    prior = lens_prior(known.zoom_curve, *least->zoom, *most->zoom, options);
  }
  const bool covers = prior.lens.begin_s() <= *least->log_f && *most->log_f <= prior.lens.end_s();
  return covers ? std::optional(prior) : std::nullopt;
}

// A calibration knows the lens better than the pictures of a map do: over a narrow range of angles
// only the perspective within each picture shows the focal length, and an error of the distortion
// feigns that. So the focal length stays within its sigma, and what temperature and focus do to a
// lens from day to day. How far a movement of the zoom misses its reading is `repeatability`.
// views: of all pictures.
void hold_lens(const PublishedCalibration& known, const std::vector<MapView>& views,
               MapBuildOptions* build) {
  constexpr double kFromDayToDay = 1e-4;  // of f
  double sigma = 0;
  if (known.zoom_curve.empty()) sigma = relative_focal_length_sigma(known.calibration);
  const ZoomCurve::Content& curve = known.zoom_curve.content();
  for (int i = 0; i < curve.nodes; ++i) {
    if (!curve.is_between[static_cast<std::size_t>(i)])
      sigma = std::max(sigma, relative_focal_length_sigma(known.zoom_curve.node(i)));
  }
  if (!known.zoom_curve.empty()) build->repeatability = std::max(1e-4, curve.repeatability);
  const double held = std::hypot(kFromDayToDay, sigma);
  for (double* prior : {&build->adjustment.level_sigma[0], &build->adjustment.bend_sigma[0]})
    *prior = std::min(*prior, held);
  const std::optional<LensPrior> prior =
      prior_of(known, views, {held, build->centre_share * build->width, build->lens_spacing});
  if (!prior) return;
  build->lens = prior->lens;
  build->adjustment.level_sigmas = prior->sigmas;
}

// The existing map, with the pictures of its keyframes; empty without a path.
SceneMap map_to_add(const std::string& path, const MapBuildOptions& build) {
  SceneMap map;
  if (path.empty()) return map;
  std::string error;
  if (!load_scene_map(path, &map, &error, true)) throw CommandError(kExitUsage, error);
  if (map.lens.width() != build.width || map.lens.height() != build.height) {
    throw CommandError(kExitUsage, fmt::format("{}: is for {}x{} px, but the recordings have "
                                               "{}x{}; a map is for one camera at one size",
                                               path, map.lens.width(), map.lens.height(),
                                               build.width, build.height));
  }
  return map;
}

MapView view_of(const SceneKeyframe& k, double angle_sigma) {
  MapView view;
  view.recording = k.recording;
  view.frame = k.frame;
  view.time_utc_s = k.time_utc_s;
  view.zoom = k.zoom;
  view.log_f = k.position;
  view.telemetry = k.telemetry;
  view.angle_sigma = angle_sigma;
  view.angular_velocity = k.angular_velocity;
  view.zoom_rate = k.zoom_rate;
  return view;
}

// Adds the keyframes of `map`. Their features are found anew, as a map stores only those that
// became landmarks.
void add_keyframes(const SceneMap& map, double angle_sigma, const FeatureDetector& detector,
                   MapBuilder* builder) {
  JpegDecoder decoder;
  for (const SceneKeyframe& k : map.keyframes) {
    const std::string jpeg(k.picture.begin(), k.picture.end());
    Picture picture;
    if (jpeg.empty() || !decoder.decode(jpeg, &picture)) {
      spdlog::warn("keyframe {} of the map to add has no picture, and is left out", k.id);
      continue;
    }
    builder->add(
        view_of(k, angle_sigma),
        features_of(detector, {picture.luma, picture.width, picture.height, picture.stride}),
        k.picture);
  }
}

std::string name_of(const MapView& view) {
  return fmt::format("{} frame {}", view.recording, view.frame);
}

std::string names_of(const MapBuilder& builder, const std::vector<int>& pictures) {
  constexpr std::size_t kNamed = 4;
  std::string out;
  for (std::size_t i = 0; i < std::min(kNamed, pictures.size()); ++i) {
    out += (i > 0 ? ", " : "") + name_of(builder.view(pictures[i]));
  }
  if (pictures.size() > kNamed) out += fmt::format(" and {} more", pictures.size() - kNamed);
  return out;
}

// How many frames were left out as they moved too fast. It may explain a refusal.
std::string fast_text(const Pace& pace) {
  return pace.fast == 0 ? ""
                        : fmt::format("; {} of {} frames moved too fast", pace.fast, pace.frames);
}

[[noreturn]] void refuse(const MapBuilder& builder, const MapBuild& build, const Pace& pace) {
  const std::string what = to_string(build.status);
  switch (build.status) {
    case MapBuildStatus::kNotConnected: {
      std::string parts;
      for (std::size_t g = 0; g < std::min<std::size_t>(4, build.groups.size()); ++g) {
        parts += fmt::format("{}{} ({})", g > 0 ? "; " : "", build.groups[g].size(),
                             names_of(builder, build.groups[g]));
      }
      throw CommandError(
          kExitFailed,
          fmt::format(
              "{}: {} unconnected parts, with pictures {}{}; add recordings that pass from one "
              "part to the other, at zooms between, {}, neighbouring views overlapping by {:g} % "
              "or more; or take the largest with --largest-part",
              what, build.groups.size(), parts, fast_text(pace), pace.text(),
              100 * kMapOverlapAsked));
    }
    case MapBuildStatus::kNoTexture:
      throw CommandError(kExitFailed,
                         fmt::format("{}: {} of {} pictures have too little texture; record by "
                                     "day, where there is something to see",
                                     what, build.without_texture.size(), builder.size()));
    case MapBuildStatus::kNoFocalLength:
      throw CommandError(kExitFailed, what +
                                          "; give --focal-length, and zoom readings for all "
                                          "recordings or for none");
    default:
      throw CommandError(kExitFailed, what + "; show more of the scene, each part several times");
  }
}

class Progress {
 public:
  void say(double done, const char* what) {
    if (!is_terminal(STDERR_FILENO)) return;
    std::fprintf(stderr, "\r%3.0f %%  %-24s", 100 * done, what);
    if (done >= 1) std::fputc('\n', stderr);
  }
};

}  // namespace

int build_map(const MapBuildCommand& options) {
  std::string error;
  if (!may_write_scene_map(options.map, &error)) throw CommandError(kExitFailed, error);
  const OutputLock lock(options.map);
  std::vector<MapRecording> recordings;
  std::vector<double> readings;
  for (const std::string& directory : options.recordings) {
    recordings.push_back(load_map_recording(directory, !options.no_telemetry));
    const std::vector<double> more = recordings.back().zoom_readings();
    readings.insert(readings.end(), more.begin(), more.end());
  }
  require_one_size(recordings);
  const auto calibration = calibration_of(options);
  const Calibration* known = calibration ? &calibration->calibration : nullptr;
  MapBuildOptions build;
  build.width = recordings.front().info.width;
  build.height = recordings.front().info.height;
  if (known != nullptr &&
      (known->camera.width != build.width || known->camera.height != build.height)) {
    throw CommandError(kExitUsage,
                       fmt::format("{}: is for {}x{} px, but the recordings have {}x{}; give a "
                                   "calibration for this size with --calibration",
                                   calibration->name, known->camera.width, known->camera.height,
                                   build.width, build.height));
  }
  // Without telemetry readings count only where somebody knows what they mean.
  const bool knows_readings = (calibration && !calibration->zoom_curve.empty()) ||
                              options.focal_length.find(':') != std::string::npos;
  if (options.no_telemetry && !knows_readings) readings.clear();
  const FocalLengthKnowledge focal_lengths = focal_length_knowledge(
      options.focal_length, known, calibration ? calibration->zoom_curve : ZoomCurve(), readings);
  build.mechanics = known != nullptr ? known->mechanics : Mechanics<double>();
  if (known != nullptr) build.line_delay = known->line_delay;
  build.largest_part = options.largest_part;
  if (options.focal_length.find(':') != std::string::npos) {
    build.log_f_sigma = 0.1;
    build.adjustment.level_sigma[0] = 0.3;
    build.adjustment.bend_sigma[0] = 0.1;
  }

  std::vector<std::vector<MapView>> views;
  for (const MapRecording& recording : recordings) {
    views.emplace_back();
    for (const FrameStamp& frame : recording.frames) {
      views.back().push_back(map_view(recording, frame, known, focal_lengths));
      if (focal_lengths.needs_reading() && !views.back().back().log_f) views.back().pop_back();
    }
    if (views.back().empty()) {
      throw CommandError(kExitUsage,
                         recording.directory +
                             ": no frame has a zoom reading that the calibration or data sheet "
                             "covers; leave it out, or record telemetry with zoom");
    }
  }
  const SceneMap there = map_to_add(options.add, build);
  const double angle_sigma = views.front().front().angle_sigma;
  if (known != nullptr && options.focal_length.empty()) {
    std::vector<MapView> all;
    for (const std::vector<MapView>& some : views) all.insert(all.end(), some.begin(), some.end());
    for (const SceneKeyframe& k : there.keyframes) all.push_back(view_of(k, angle_sigma));
    hold_lens(*calibration, all, &build);
  }
  Progress progress;
  MapBuilder builder(build);
  const FeatureDetector detector;
  add_keyframes(there, angle_sigma, detector, &builder);
  Pace pace;
  pace.is_known = known != nullptr;
  pace.readout_s = std::abs(build.line_delay) * build.height;
  if (pace.readout_s == 0) pace.readout_s = kGuessedReadout_s;
  const std::vector<Chosen> chosen =
      choose(recordings, views, there, build, options.keyframes, &pace);
  std::size_t done = 0;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    std::vector<std::size_t> frames;
    std::vector<const MapView*> of_frame;
    for (const Chosen& c : chosen) {
      if (c.recording != r) continue;
      const MapView& view = views[r][c.frame];
      // Search by frame number, as frames without a zoom reading have no view.
      const auto at = std::find_if(recordings[r].frames.begin(), recordings[r].frames.end(),
                                   [&](const FrameStamp& s) { return s.frame == view.frame; });
      frames.push_back(static_cast<std::size_t>(at - recordings[r].frames.begin()));
      of_frame.push_back(&view);
    }
    for_each_picture(recordings[r], frames, [&](std::size_t frame, const ImageView& image) {
      const auto at =
          static_cast<std::size_t>(std::find(frames.begin(), frames.end(), frame) - frames.begin());
      const std::string jpeg = small_jpeg(image, image.width);
      builder.add(*of_frame[at], features_of(detector, image), {jpeg.begin(), jpeg.end()});
      progress.say(0.4 * static_cast<double>(++done) / static_cast<double>(chosen.size()),
                   "features");
    });
  }
  if (builder.size() < 2) {
    throw CommandError(
        kExitFailed,
        fmt::format("only {} of {} frames can be keyframes{}; a map needs pictures that have "
                    "telemetry around their time and move {}; see alidade check",
                    builder.size(), recordings.front().frames.size(), fast_text(pace),
                    pace.text()));
  }
  const MapBuild result =
      builder.build([&](double part, const char* what) { progress.say(0.4 + 0.6 * part, what); });
  progress.say(1, "");
  if (!result.without_texture.empty()) {
    spdlog::warn("left out, as they have too little texture: {}",
                 names_of(builder, result.without_texture));
  }
  if (!result.not_connected.empty()) {
    spdlog::warn("left out, as they match no other picture: {}",
                 names_of(builder, result.not_connected));
  }
  if (result.status != MapBuildStatus::kOk) refuse(builder, result, pace);
  if (!save_scene_map(options.map, result.map, &error)) throw CommandError(kExitFailed, error);
  std::fputs(
      options.json ? map_json(result.map, options.map).c_str() : map_text(result.map).c_str(),
      stdout);
  if (!options.json) {
    std::fputs(fmt::format("{} of {} pictures, {} pairs compared, {} linked; {} tracks, {} "
                           "observations, {:.2g} px rms\n",
                           result.map.keyframes.size(), builder.size(), result.compared,
                           result.linked, result.tracks, result.observations, result.residual_px)
                   .c_str(),
               stdout);
  }
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
  return kExitOk;
}

}  // namespace alidade
