#include "edge_app/commands/map_recording.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <optional>

#include "core/calibration/number_text.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/video_tracks.h"
#include "edge_app/self_calibration/steady_samples.h"
#include "platform/video/recording_frame_source.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

// Sigma of log f from a data sheet with one number, and with a range. Between the ends of a range
// the lens need not follow the straight line.
constexpr double kSheetSigma = 0.02;
constexpr double kRangeSigma = 0.1;
// rad, sigma of telemetry's orientation: noise and backlash with a calibration; without one also
// the directions of the axes.
constexpr double kCalibratedAngleSigma = 5e-4;
constexpr double kNominalAngleSigma = 1e-2;

// s: how far telemetry's time may be off the picture's, with and without a calibration; how long an
// unknown read-out takes. kLineDelayShare: relative error of a known line delay.
constexpr double kKnownClock_s = 0.05;
constexpr double kUnknownClock_s = 1;
constexpr double kUnknownReadOut_s = 0.03;
constexpr double kLineDelayShare = 0.02;

// Telemetry, interpolated linearly at a time.
struct Telling {
  PanTilt<double> measured;  // rad
  PanTilt<double> rate;      // rad/s
  std::optional<double> zoom;
  double zoom_rate = 0;  // device units/s
};

std::optional<Telling> telling_at(const std::vector<PanTiltSample>& samples, double time_s) {
  const auto after =
      std::upper_bound(samples.begin(), samples.end(), time_s,
                       [](double t, const PanTiltSample& s) { return t < s.latest_time_s; });
  if (after == samples.begin() || after == samples.end()) return std::nullopt;
  const PanTiltSample& a = *std::prev(after);
  const PanTiltSample& b = *after;
  const double span = b.latest_time_s - a.latest_time_s;
  const double part = span > 0 ? (time_s - a.latest_time_s) / span : 0;
  const PanTilt<double> from{a.pan_rad, a.tilt_rad};
  const Vector2<double> way = minus({b.pan_rad, b.tilt_rad}, from);
  Telling out;
  out.measured = plus(from, Vector2<double>(part * way));
  if (span > 0) out.rate = {way.x() / span, way.y() / span};
  if (a.zoom && b.zoom) {
    out.zoom = *a.zoom + part * (*b.zoom - *a.zoom);
    if (span > 0) out.zoom_rate = (*b.zoom - *a.zoom) / span;
  } else if (a.zoom || b.zoom) {
    out.zoom = a.zoom ? a.zoom : b.zoom;
  }
  return out;
}

// The time of a frame's middle row on telemetry's clock. Without a calibration its receive time.
double telemetry_time_of(const MapRecording& recording, const FrameStamp& frame,
                         const Calibration* calibration) {
  if (calibration == nullptr) return frame.receive_time_s;
  const double middle_s = calibration->line_delay * recording.info.height / 2;
  return frame.receive_time_s + middle_s + calibration->clock_offset;
}

double focal_length_of(const std::string& text) {
  const std::optional<double> px = number_of(text);
  if (px && *px >= 10 && *px <= 1e6) return *px;
  throw CommandError(kExitUsage,
                     fmt::format("--focal-length: '{}' is not a focal length in px; give one, such "
                                 "as 1250, or WIDE:TELE, such as 1250:25000",
                                 text));
}

}  // namespace

FocalLengthKnowledge::FocalLengthKnowledge(const Calibration& calibration, const ZoomCurve& curve)
    : needs_reading_(!curve.empty()) {
  at_ = [calibration, curve](const std::optional<double>& zoom) -> std::optional<FocalLengthPrior> {
    Calibration c = calibration;
    if (!curve.empty() && (!zoom || !curve.at(*zoom, &c))) return std::nullopt;
    return FocalLengthPrior{std::log(c.camera.focal_length),
                            std::max(1e-4, relative_focal_length_sigma(c))};
  };
}

FocalLengthKnowledge::FocalLengthKnowledge(double px) {
  at_ = [px](const std::optional<double>&) { return FocalLengthPrior{std::log(px), kSheetSigma}; };
}

FocalLengthKnowledge::FocalLengthKnowledge(double wide_px, double tele_px, double wide_reading,
                                           double tele_reading)
    : needs_reading_(true) {
  at_ = [=](const std::optional<double>& zoom) -> std::optional<FocalLengthPrior> {
    if (!zoom) return std::nullopt;
    const double part = (*zoom - wide_reading) / (tele_reading - wide_reading);
    return FocalLengthPrior{std::log(wide_px) + part * std::log(tele_px / wide_px), kRangeSigma};
  };
}

std::optional<FocalLengthPrior> FocalLengthKnowledge::at(const std::optional<double>& zoom) const {
  return at_ ? at_(zoom) : std::nullopt;
}

FocalLengthKnowledge focal_length_knowledge(const std::string& focal_length,
                                            const Calibration* calibration, const ZoomCurve& curve,
                                            const std::vector<double>& readings) {
  const auto [least, most] = std::minmax_element(readings.begin(), readings.end());
  const bool zooms = !readings.empty() && *most > *least;
  if (!focal_length.empty()) {
    const std::size_t colon = focal_length.find(':');
    if (colon == std::string::npos) {
      if (zooms) {
        throw CommandError(
            kExitUsage,
            "--focal-length: the recordings zoom; give WIDE:TELE, the focal lengths at the least "
            "and the greatest reading, or a calibration of several zooms");
      }
      return FocalLengthKnowledge(focal_length_of(focal_length));
    }
    if (!zooms) {
      throw CommandError(kExitUsage,
                         "--focal-length: WIDE:TELE needs zoom readings in telemetry.csv that "
                         "differ; give one focal length");
    }
    return {focal_length_of(focal_length.substr(0, colon)),
            focal_length_of(focal_length.substr(colon + 1)), *least, *most};
  }
  if (calibration != nullptr) return {*calibration, curve};
  if (zooms) {
    throw CommandError(kExitUsage,
                       "the recordings zoom, but the focal length at their readings is unknown; "
                       "give --focal-length WIDE:TELE, or --calibration FILE with a zoom_curve");
  }
  return {};
}

std::vector<double> MapRecording::zoom_readings() const {
  std::vector<double> out;
  for (const PanTiltSample& sample : telemetry) {
    if (sample.zoom) out.push_back(*sample.zoom);
  }
  return out;
}

MapRecording load_map_recording(const std::string& directory, bool with_telemetry) {
  const auto require = [](bool ok, const std::string& error) {
    if (!ok) throw CommandError(kExitUsage, error);
  };
  MapRecording out;
  out.directory = directory;
  std::string error;
  require(read_recording_info(directory, &out.info, &error), error);
  require(has_video(directory),
          directory + ": no pictures in it; a scene map needs video.mkv or frames/");
  require(read_frames_csv(directory, &out.frames, &error), error);
  require(!out.frames.empty(), directory + "/frames.csv: no frames; record some");
  if (with_telemetry && fs::exists(fs::path(directory) / "telemetry.csv")) {
    require(read_telemetry_csv(directory, &out.telemetry, &error), error);
    std::stable_sort(out.telemetry.begin(), out.telemetry.end(),
                     [](const PanTiltSample& a, const PanTiltSample& b) {
                       return a.latest_time_s < b.latest_time_s;
                     });
    steady_zoom(std::nullopt, &out.telemetry);
  }
  return out;
}

MapView map_view(const MapRecording& recording, const FrameStamp& frame,
                 const Calibration* calibration, const FocalLengthKnowledge& known) {
  MapView view;
  view.recording = recording.directory;
  view.frame = frame.frame;
  view.time_utc_s = frame.sender_utc_s.value_or(0);
  const Calibration nominal;
  const Calibration& c = calibration != nullptr ? *calibration : nominal;
  const auto told =
      telling_at(recording.telemetry, telemetry_time_of(recording, frame, calibration));
  const auto f = known.at(told ? told->zoom : std::nullopt);
  if (f) view.log_f = f->log_f;
  if (!told) return view;
  view.zoom = told->zoom;
  view.telemetry = told->measured;
  view.angle_sigma = calibration != nullptr ? kCalibratedAngleSigma : kNominalAngleSigma;
  const Mechanics<double> mechanics = calibration != nullptr ? c.mechanics : Mechanics<double>();
  view.angular_velocity = angular_velocity(mechanics, true_from_measured(mechanics, told->measured),
                                           true_from_measured(mechanics, told->rate));
  if (told->zoom && told->zoom_rate != 0) {
    constexpr double kStep_s = 1e-3;
    const auto later = known.at(*told->zoom + kStep_s * told->zoom_rate);
    if (f && later) view.zoom_rate = (later->log_f - f->log_f) / kStep_s;
  }
  return view;
}

MotionDoubt motion_doubt(const MapRecording& recording, const FrameStamp& frame,
                         const Calibration* calibration, const FocalLengthKnowledge& known,
                         const MapView& view, double line_delay) {
  const double time_s = telemetry_time_of(recording, frame, calibration);
  const double window_s = calibration != nullptr ? kKnownClock_s : kUnknownClock_s;
  const std::vector<PanTiltSample>& samples = recording.telemetry;
  // Begin two samples before the first one in the window, so that the intervals before the frame
  // count even if the window is shorter than a sample's period.
  auto first =
      std::lower_bound(samples.begin(), samples.end(), time_s - window_s,
                       [](const PanTiltSample& s, double t) { return s.latest_time_s < t; });
  for (int i = 0; i < 2 && first != samples.begin(); ++i) --first;
  double most_turn = 0, turn_off = 0, most_zoom = 0, zoom_off = 0;
  bool is_zoom_told = true;
  int intervals = 0;
  for (auto a = first; a != samples.end() && std::next(a) != samples.end(); ++a) {
    const PanTiltSample& b = *std::next(a);
    const double span = b.latest_time_s - a->latest_time_s;
    if (!(span > 0)) continue;
    const Vector2<double> way =
        minus(PanTilt<double>{b.pan_rad, b.tilt_rad}, PanTilt<double>{a->pan_rad, a->tilt_rad});
    const Calibration nominal;
    const Mechanics<double>& mechanics =
        (calibration != nullptr ? *calibration : nominal).mechanics;
    const Vector3<double> w = angular_velocity(
        mechanics, true_from_measured(mechanics, {a->pan_rad, a->tilt_rad}),
        true_from_measured(mechanics, PanTilt<double>{way.x() / span, way.y() / span}));
    most_turn = std::max(most_turn, w.norm());
    turn_off = std::max(turn_off, (w - view.angular_velocity).norm());
    const auto f_a = known.at(a->zoom);
    const auto f_b = known.at(b.zoom);
    if (a->zoom && b.zoom && *a->zoom == *b.zoom) {
      zoom_off = std::max(zoom_off, std::abs(view.zoom_rate));
    } else if (a->zoom && b.zoom && f_a && f_b) {
      const double rate = (f_b->log_f - f_a->log_f) / span;
      most_zoom = std::max(most_zoom, std::abs(rate));
      zoom_off = std::max(zoom_off, std::abs(rate - view.zoom_rate));
    } else {
      is_zoom_told = false;
    }
    ++intervals;
    if (a->latest_time_s > time_s + window_s) break;
  }
  MotionDoubt out = kUnknownMotion;
  if (!view.telemetry || intervals < 2) return out;
  const double read_out_s = std::abs(line_delay) * recording.info.height;
  const auto doubt = [&](double off, double most) {
    return read_out_s > 0 ? read_out_s * (off + kLineDelayShare * most) : kUnknownReadOut_s * most;
  };
  out.turn = doubt(turn_off, most_turn);
  if (is_zoom_told) out.log_f = doubt(zoom_off, most_zoom);
  return out;
}

void for_each_picture(const MapRecording& recording, const std::vector<std::size_t>& frames,
                      const std::function<void(std::size_t, const ImageView&)>& use) {
  const auto video = open_recorded_frames({recording.directory, true, false});
  for (std::size_t next = 0; next < frames.size();) {
    Frame frame;
    const ReadStatus status = video->read(frame, std::numeric_limits<double>::infinity());
    if (status == ReadStatus::kEnd) return;
    if (status != ReadStatus::kOk) throw CommandError(kExitFailed, video->error());
    // Skip frames whose picture could not be decoded.
    while (next < frames.size() && recording.frames[frames[next]].frame < frame.stamp.frame) {
      ++next;
    }
    if (next == frames.size() || recording.frames[frames[next]].frame != frame.stamp.frame) {
      continue;
    }
    use(frames[next], {frame.luma, frame.width, frame.height, frame.stride});
    ++next;
  }
}

}  // namespace alidade
