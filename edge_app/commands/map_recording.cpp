#include "edge_app/commands/map_recording.h"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numeric>
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

constexpr double kTimeError_s = 3e-3;  // of a stamp that is not filtered

// Telemetry at a time.
struct Telling {
  PanTilt<double> measured;  // rad, interpolated linearly
  PanTilt<double> rate;      // rad/s
  double rate_sigma = 0;     // rad/s, of both
  std::optional<double> zoom;
  double zoom_rate = 0;        // device units/s
  double zoom_rate_sigma = 0;  // likewise
};

// A cubic through the samples around a time. Two samples alone would give a rate with all of their
// noise; the cubic still follows a head that turns about.
struct RateFit {
  Vector2<double> rate = Vector2<double>::Zero();          // rad/s, of pan and tilt
  Vector2<double> acceleration = Vector2<double>::Zero();  // rad/s^2
  double rate_share = 0;                                   // sigma of a rate / sigma of an angle
  double residual = 0;                                     // rad, root mean square of one angle
};

// Nothing if there are too few samples near that time.
std::optional<RateFit> fit_rates(const std::vector<PanTiltSample>& samples, std::size_t after,
                                 double time_s) {
  constexpr std::size_t kEachSide = 5;
  constexpr double kMostAway_s = 0.25;
  constexpr int kPowers = 4;
  constexpr Eigen::Index kLeast = 7;
  const std::size_t first = after > kEachSide ? after - kEachSide : 0;
  const std::size_t last = std::min(samples.size(), after + kEachSide);
  std::vector<std::size_t> near;
  for (std::size_t i = first; i < last; ++i) {
    if (std::abs(samples[i].latest_time_s - time_s) <= kMostAway_s) near.push_back(i);
  }
  const auto rows = static_cast<Eigen::Index>(near.size());
  if (rows < kLeast) return std::nullopt;
  Eigen::Matrix<double, Eigen::Dynamic, kPowers> A(rows, kPowers);
  Eigen::Matrix<double, Eigen::Dynamic, 2> angles(rows, 2);
  const PanTilt<double> from{samples[near.front()].pan_rad, samples[near.front()].tilt_rad};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const PanTiltSample& sample = samples[near[static_cast<std::size_t>(i)]];
    const double t = sample.latest_time_s - time_s;
    A.row(i) << 1, t, t * t, t * t * t;
    angles.row(i) = minus(PanTilt<double>{sample.pan_rad, sample.tilt_rad}, from).transpose();
  }
  const Eigen::ColPivHouseholderQR<Eigen::Matrix<double, Eigen::Dynamic, kPowers>> qr(A);
  if (qr.rank() < kPowers) return std::nullopt;
  const Eigen::Matrix<double, kPowers, 2> c = qr.solve(angles);
  const Eigen::Matrix<double, kPowers, kPowers> covariance = (A.transpose() * A).inverse();
  RateFit out;
  out.rate = c.row(1);
  out.acceleration = 2 * c.row(2);
  out.rate_share = std::sqrt(std::max(0.0, covariance(1, 1)));
  const double freedom = 2 * static_cast<double>(rows - kPowers);
  out.residual = std::sqrt((A * c - angles).squaredNorm() / freedom);
  return out;
}

// rad, of one angle: about such cubics, without the worst of them.
double angle_noise(const std::vector<PanTiltSample>& samples) {
  constexpr double kKept = 0.95;
  std::vector<double> squares;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const auto fit = fit_rates(samples, i, samples[i].latest_time_s);
    if (fit) squares.push_back(fit->residual * fit->residual);
  }
  if (squares.empty()) return 0;
  std::sort(squares.begin(), squares.end());
  squares.resize(std::max<std::size_t>(
      1, static_cast<std::size_t>(kKept * static_cast<double>(squares.size()))));
  const double sum = std::accumulate(squares.begin(), squares.end(), 0.0);
  return std::sqrt(sum / static_cast<double>(squares.size()));
}

// Rates of the samples a and a + 1; nothing at the ends and of samples at one time.
std::optional<Vector2<double>> rate_between(const std::vector<PanTiltSample>& samples,
                                            std::size_t a) {
  if (a + 1 >= samples.size()) return std::nullopt;
  const double span = samples[a + 1].latest_time_s - samples[a].latest_time_s;
  if (!(span > 0)) return std::nullopt;
  const PanTilt<double> from{samples[a].pan_rad, samples[a].tilt_rad};
  return minus({samples[a + 1].pan_rad, samples[a + 1].tilt_rad}, from) / span;
}

std::optional<double> zoom_rate_between(const std::vector<PanTiltSample>& samples, std::size_t a) {
  if (a + 1 >= samples.size() || !samples[a].zoom || !samples[a + 1].zoom) return std::nullopt;
  const double span = samples[a + 1].latest_time_s - samples[a].latest_time_s;
  if (!(span > 0)) return std::nullopt;
  return (*samples[a + 1].zoom - *samples[a].zoom) / span;
}

std::optional<Telling> telling_at(const MapRecording& recording, double time_s) {
  const std::vector<PanTiltSample>& samples = recording.telemetry;
  const auto next =
      std::upper_bound(samples.begin(), samples.end(), time_s,
                       [](double t, const PanTiltSample& s) { return t < s.latest_time_s; });
  if (next == samples.begin() || next == samples.end()) return std::nullopt;
  const auto after = static_cast<std::size_t>(next - samples.begin());
  const PanTiltSample& a = samples[after - 1];
  const PanTiltSample& b = samples[after];
  const double span = b.latest_time_s - a.latest_time_s;
  const double part = span > 0 ? (time_s - a.latest_time_s) / span : 0;
  const PanTilt<double> from{a.pan_rad, a.tilt_rad};
  Telling out;
  out.measured = plus(from, Vector2<double>(part * minus({b.pan_rad, b.tilt_rad}, from)));
  if (const auto fit = fit_rates(samples, after, time_s)) {
    out.rate = {fit->rate.x(), fit->rate.y()};
    out.rate_sigma = std::hypot(fit->rate_share * std::max(recording.angle_noise, fit->residual),
                                kTimeError_s * fit->acceleration.cwiseAbs().maxCoeff());
  } else if (const auto here = rate_between(samples, after - 1)) {
    // Few samples: how much the rate changes to the intervals beside is how little is known.
    out.rate = {here->x(), here->y()};
    out.rate_sigma = std::sqrt(2.0) * recording.angle_noise / span;
    for (const std::size_t beside : {std::max<std::size_t>(after, 2) - 2, after}) {
      if (const auto there = rate_between(samples, beside))
        out.rate_sigma = std::max(out.rate_sigma, (*there - *here).cwiseAbs().maxCoeff());
    }
  }
  if (const auto here = zoom_rate_between(samples, after - 1)) {
    out.zoom = *a.zoom + part * (*b.zoom - *a.zoom);
    out.zoom_rate = *here;
    for (const std::size_t beside : {std::max<std::size_t>(after, 2) - 2, after}) {
      if (const auto there = zoom_rate_between(samples, beside))
        out.zoom_rate_sigma = std::max(out.zoom_rate_sigma, std::abs(*there - *here));
    }
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

MapRecording load_map_recording(const std::string& directory, bool with_angles) {
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
  out.has_angles = with_angles;
  if (fs::exists(fs::path(directory) / "telemetry.csv")) {
    require(read_telemetry_csv(directory, &out.telemetry, &error), error);
    std::stable_sort(out.telemetry.begin(), out.telemetry.end(),
                     [](const PanTiltSample& a, const PanTiltSample& b) {
                       return a.latest_time_s < b.latest_time_s;
                     });
    steady_zoom(std::nullopt, &out.telemetry);
    out.angle_noise = angle_noise(out.telemetry);
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
  const auto told = telling_at(recording, telemetry_time_of(recording, frame, calibration));
  const auto f = known.at(told ? told->zoom : std::nullopt);
  if (f) view.log_f = f->log_f;
  // A data sheet's error is common to all pictures, and not meant here.
  if (f && calibration != nullptr) view.log_f_sigma = f->sigma;
  if (f) {
    // Until telemetry tells more: how fast a camera turns that is to see something. A head turns it
    // about its optical axis by the sine of its tilt alone.
    constexpr double kFields = 0.5;  // fields of view a second
    constexpr double kAboutAxis = 0.2;
    view.motion_sigma.head<3>().setConstant(kFields * recording.info.width / std::exp(f->log_f));
    view.motion_sigma[2] *= kAboutAxis;
  }
  if (!told) return view;
  view.zoom = told->zoom;
  if (recording.has_angles) {
    view.telemetry = told->measured;
    view.angle_sigma = calibration != nullptr ? kCalibratedAngleSigma : kNominalAngleSigma;
    const Mechanics<double> mechanics = calibration != nullptr ? c.mechanics : Mechanics<double>();
    view.angular_velocity =
        angular_velocity(mechanics, true_from_measured(mechanics, told->measured),
                         true_from_measured(mechanics, told->rate));
    view.motion_sigma.head<3>().setConstant(told->rate_sigma);
  }
  if (told->zoom && told->zoom_rate != 0) {
    constexpr double kStep_s = 1e-3;
    const auto later = known.at(*told->zoom + kStep_s * told->zoom_rate);
    if (f && later) view.zoom_rate = (later->log_f - f->log_f) / kStep_s;
    view.log_f_sigma = std::hypot(view.log_f_sigma, kTimeError_s * view.zoom_rate);
    view.motion_sigma[3] = std::abs(view.zoom_rate / told->zoom_rate) * told->zoom_rate_sigma;
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
