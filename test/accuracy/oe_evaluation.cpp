#include "test/accuracy/oe_evaluation.h"

#include <time.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <map>

#include "core/model/direction.h"
#include "core/realtime/pt_mode.h"

namespace alidade::test {
namespace {

// CPU time of this thread: what other processes do on a shared machine is not OE mode's doing.
double cpu_time_s() {
  timespec now{};
  ::clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

Eigen::Vector2d grid_pixel(const simulator::ImageConfig& image, int point) {
  return {(point % kGridColumns + 0.5) * image.width / kGridColumns,
          (point / kGridColumns + 0.5) * image.height / kGridRows};
}

// Directions of growing u and v, seen at a pixel; rows are unit vectors in base.
Eigen::Matrix<double, 2, 3> image_axes(const Eigen::Matrix3d& base_from_camera,
                                       const Eigen::Vector3d& ray) {
  const Eigen::Vector3d along_u = (Eigen::Vector3d::UnitX() - ray.x() * ray).normalized();
  Eigen::Matrix<double, 2, 3> axes;
  axes.row(0) = base_from_camera * along_u;
  axes.row(1) = base_from_camera * ray.cross(along_u);
  return axes;
}

// Truth of one frame, once for all that is compared with it.
struct FrameTruth {
  std::array<Eigen::Vector2d, kGridPoints> u;
  std::array<Eigen::Vector3d, kGridPoints> d;
  std::array<Eigen::Matrix<double, 2, 3>, kGridPoints> axes;
};

FrameTruth truth_of(const RenderedRecording& recording, int frame, FrameEvaluation* out) {
  const simulator::Config& config = recording.config();
  const double focal_length = config.camera.focal_length;
  const double field = simulator::horizontal_field_of_view(config);
  FrameTruth truth;
  // Straight lines through pan and tilt at the rows of the grid.
  Eigen::Matrix<double, kGridRows, 2> rows;
  Eigen::Matrix<double, kGridRows, 2> line;
  std::array<Eigen::Vector2d, kGridRows> angles;
  const auto angles_at = [&](double time) {
    const simulator::Angles at = recording.angles(time);
    return Eigen::Vector2d(at.pan, at.tilt);
  };
  for (int point = 0; point < kGridPoints; ++point) {
    const auto i = static_cast<std::size_t>(point);
    truth.u[i] = grid_pixel(config.image, point);
    const double time = recording.time(frame) + truth.u[i].y() * config.camera.line_delay;
    const Eigen::Vector3d ray = recording.ray(truth.u[i]);
    const Eigen::Matrix3d turn = recording.base_from_camera(time);
    truth.d[i] = turn * ray;
    truth.axes[i] = image_axes(turn, ray);
    const Eigen::Vector2d at = angles_at(time);
    const Eigen::Vector3d pan_axis = recording.camera().pan_axis();
    const Eigen::Vector3d tilt_axis =
        Eigen::AngleAxisd(at.x(), pan_axis) * recording.camera().tilt_axis();
    out->J_angle[i].col(0) = focal_length * truth.axes[i] * pan_axis.cross(truth.d[i]);
    out->J_angle[i].col(1) = focal_length * truth.axes[i] * tilt_axis.cross(truth.d[i]);
    const int row = point / kGridColumns;
    angles.at(static_cast<std::size_t>(row)) = at;
    rows.row(row) = at;
    line.row(row) << 1, truth.u[i].y() / config.image.height - 0.5;
  }
  const Eigen::Matrix2d fit = (line.transpose() * line).ldlt().solve(line.transpose() * rows);
  const Eigen::Matrix<double, kGridRows, 2> bend = line * fit - rows;
  for (int point = 0; point < kGridPoints; ++point) {
    const auto i = static_cast<std::size_t>(point);
    out->constant_rate_px[i] = out->J_angle[i] * bend.row(point / kGridColumns).transpose();
  }

  constexpr double kStep = 1e-3;  // s
  const double readout = config.camera.line_delay * config.image.height;
  const double middle = recording.time(frame) + readout / 2;
  for (const double time : {middle - readout / 2, middle, middle + readout / 2}) {
    out->speed = std::max(out->speed, (angles_at(time + kStep) - angles_at(time - kStep)).norm() /
                                          (2 * kStep) / field);
  }
  out->acceleration =
      (angles_at(middle + kStep) - 2 * angles_at(middle) + angles_at(middle - kStep)).norm() /
      (kStep * kStep) / field;
  return truth;
}

// False if the estimate has a pixel without a direction or a covariance that is none.
bool compare(const FrameOrientation& estimate, const FrameTruth& truth, double focal_length,
             GridErrors* errors, double* sigma_px) {
  for (std::size_t i = 0; i < truth.u.size(); ++i) {
    Vector3<double> d;
    Matrix2<double> covariance;
    if (estimate.direction(truth.u[i], &d, &covariance) != ProjectionStatus::kOk) return false;
    const Eigen::LLT<Eigen::Matrix2d> factor(covariance);
    if (factor.info() != Eigen::Success) return false;
    (*errors)[i].px = focal_length * (truth.axes[i] * (d - truth.d[i]));
    const Eigen::Vector2d xi = tangent_basis(d).transpose() * (d - truth.d[i]);
    (*errors)[i].whitened = factor.matrixL().solve(xi);
    if (i == kGridPoints / 2 && sigma_px != nullptr) {
      *sigma_px = focal_length * std::sqrt(covariance.trace() / 2);
    }
  }
  return true;
}

// Collects where the truth says that landmarks were seen.
class LandmarkTruth {
 public:
  void add(const RenderedRecording& recording, int frame, const OeMode& oe) {
    for (int i = 0; i < oe.statistics().found; ++i) {
      const OeObservation& observation = oe.observations()[i];
      Octave& octave = octaves_.at(static_cast<std::size_t>(observation.octave));
      ++octave.observations;
      if (!observation.inlier) continue;
      ++octave.inliers;
      if (observation.covariance.trace() > kEdgeVariance * (1 << 2 * observation.octave)) {
        ++octave.edges;
        continue;
      }
      octave.residual_square += observation.residual.squaredNorm();
      octave.variance += observation.covariance.trace();
      const Eigen::Vector3d d = recording.direction(frame, observation.u);
      Sums& sums = landmarks_[observation.id];
      if (sums.count == 0) {
        sums.first = d;
        sums.octave = observation.octave;
      }
      const Eigen::Vector3d px = recording.config().camera.focal_length * (d - sums.first);
      ++sums.count;
      sums.sum += px;
      sums.square += px.squaredNorm();
    }
  }

  [[nodiscard]] std::array<OctaveEvaluation, LandmarkMap::kMaxOctaves> result() const {
    std::array<double, LandmarkMap::kMaxOctaves> scatter{};
    std::array<double, LandmarkMap::kMaxOctaves> freedom{};
    for (const auto& [id, sums] : landmarks_) {
      const auto octave = static_cast<std::size_t>(sums.octave);
      scatter.at(octave) += sums.square - sums.sum.squaredNorm() / sums.count;
      freedom.at(octave) += sums.count - 1;
    }
    std::array<OctaveEvaluation, LandmarkMap::kMaxOctaves> all;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Octave& octave = octaves_.at(i);
      const double known = std::max(1, octave.inliers - octave.edges);
      all.at(i) = {octave.observations,
                   octave.inliers,
                   octave.edges,
                   std::sqrt(octave.residual_square / known),
                   std::sqrt(octave.variance / known),
                   freedom.at(i) > 0 ? std::sqrt(scatter.at(i) / freedom.at(i)) : 0};
    }
    return all;
  }

 private:
  static constexpr double kEdgeVariance = 1;  // px^2 of the octave
  struct Octave {
    int observations = 0, inliers = 0, edges = 0;
    double residual_square = 0, variance = 0;
  };
  struct Sums {
    int count = 0;
    int octave = 0;
    Eigen::Vector3d first = Eigen::Vector3d::Zero(), sum = Eigen::Vector3d::Zero();
    double square = 0;
  };
  std::array<Octave, LandmarkMap::kMaxOctaves> octaves_;
  std::map<std::uint32_t, Sums> landmarks_;
};

template <class Pick>
ErrorSet collect(const Evaluation& evaluation, const Pick& pick) {
  ErrorSet set;
  for (const FrameEvaluation& frame : evaluation.frames) {
    if (frame.frame < kWarmUpFrames) continue;
    for (int point = 0; point < kGridPoints; ++point) {
      Eigen::Vector2d px;
      if (!pick(frame, static_cast<std::size_t>(point), &px)) continue;
      set.px.push_back(px);
      set.frame.push_back(&frame);
      set.point.push_back(point);
    }
  }
  return set;
}

}  // namespace

Evaluation evaluate(const RenderedRecording& recording, const std::vector<cv::Mat>& images,
                    const Calibration& calibration, const EvaluationOptions& options) {
  const double focal_length = recording.config().camera.focal_length;
  OeOptions oe_options = options.oe;
  oe_options.max_width = recording.config().image.width;
  oe_options.max_height = recording.config().image.height;
  OeMode oe(oe_options);
  oe.reset(calibration);
  Evaluation result;
  result.memory_bytes = oe.memory_bytes();
  LandmarkTruth landmarks;
  for (int pass = 0; pass < options.passes; ++pass) {
    const bool counts = pass == options.passes - 1;
    for (int frame = 0; frame < recording.size(); ++frame) {
      const cv::Mat& image = images[static_cast<std::size_t>(frame)];
      InterpolatedPanTilt telemetry;
      bool known = has_result(recording.telemetry(calibration, frame, &telemetry));
      const Disturbance* disturbance = options.disturbance;
      if (disturbance != nullptr && recording.time(frame) >= disturbance->from &&
          recording.time(frame) < disturbance->to) {
        const double sigma = disturbance->claimed_sigma_px / focal_length;
        telemetry.angle.pan += disturbance->telemetry_offset_px / focal_length;
        telemetry.covariance.topLeftCorner<2, 2>() += sigma * sigma * Eigen::Matrix2d::Identity();
        known = known && !disturbance->telemetry_lost;
      }

      FrameEvaluation evaluated;
      evaluated.frame = frame;
      evaluated.time_s = recording.time(frame);
      FrameOrientation orientation;
      const double time = recording.time(frame) + pass * recording.config().duration;
      const double start = cpu_time_s();
      const OeStatus status =
          oe.process(view_of(image), time, known ? &telemetry : nullptr, &orientation);
      const double answered = cpu_time_s();
      if (counts) {
        landmarks.add(recording, frame, oe);
        if (options.look) options.look(frame, image, oe);
      }
      const double resumed = cpu_time_s();
      oe.maintain();
      evaluated.process_s = answered - start;
      evaluated.maintain_s = cpu_time_s() - resumed;
      if (!counts) continue;

      const FrameTruth truth = truth_of(recording, frame, &evaluated);
      evaluated.statistics = oe.statistics();
      const bool written = status != OeStatus::kNoPrediction && status != OeStatus::kNotFinite;
      if (written &&
          compare(orientation, truth, focal_length, &evaluated.errors, &evaluated.sigma_px)) {
        evaluated.mode = orientation.mode;
      }
      FrameOrientation pt;
      evaluated.pt_known = known && pt_orientation(calibration, time, telemetry, &pt) &&
                           compare(pt, truth, focal_length, &evaluated.pt_errors, nullptr);
      result.frames.push_back(evaluated);
    }
  }
  result.octaves = landmarks.result();
  result.map_size = oe.map().size();
  return result;
}

ErrorSet errors_of(const Evaluation& evaluation) {
  return collect(evaluation, [](const FrameEvaluation& frame, std::size_t i, Eigen::Vector2d* px) {
    *px = frame.errors[i].px;
    return frame.mode != OrientationMode::kNone;
  });
}

ErrorSet pt_errors_of(const Evaluation& evaluation) {
  return collect(evaluation, [](const FrameEvaluation& frame, std::size_t i, Eigen::Vector2d* px) {
    *px = frame.pt_errors[i].px;
    return frame.pt_known;
  });
}

ErrorSet constant_rate_errors_of(const Evaluation& evaluation) {
  return collect(evaluation, [](const FrameEvaluation& frame, std::size_t i, Eigen::Vector2d* px) {
    *px = frame.constant_rate_px[i];
    return true;
  });
}

ErrorSet map_errors_of(const Evaluation& evaluation) {
  return collect(evaluation, [](const FrameEvaluation& frame, std::size_t i, Eigen::Vector2d* px) {
    *px = frame.errors[i].px - frame.J_angle[i] * frame.statistics.map_offset.vector();
    return frame.mode != OrientationMode::kNone;
  });
}

ErrorSet without_common_offset(ErrorSet errors) {
  Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const auto J = [&](std::size_t n) -> const Eigen::Matrix2d& {
    return errors.frame[n]->J_angle.at(static_cast<std::size_t>(errors.point[n]));
  };
  for (std::size_t n = 0; n < errors.px.size(); ++n) {
    information += J(n).transpose() * J(n);
    right += J(n).transpose() * errors.px[n];
  }
  const Eigen::Vector2d offset = information.ldlt().solve(right);
  for (std::size_t n = 0; n < errors.px.size(); ++n) errors.px[n] -= J(n) * offset;
  return errors;
}

double rms(const ErrorSet& errors) {
  double sum = 0;
  for (const Eigen::Vector2d& px : errors.px) sum += px.squaredNorm();
  return errors.px.empty() ? std::numeric_limits<double>::quiet_NaN()
                           : std::sqrt(sum / static_cast<double>(errors.px.size()));
}

Honesty honesty_of(const std::vector<const FrameEvaluation*>& frames) {
  Honesty honesty;
  std::vector<Eigen::Vector2d> centre;
  double sum = 0;
  for (const FrameEvaluation* frame : frames) {
    if (frame->mode == OrientationMode::kNone) continue;
    double worst = 0;
    for (const PointError& error : frame->errors) {
      sum += error.normalised_square() / 2;
      worst = std::max(worst, std::sqrt(error.normalised_square()));
    }
    honesty.worst_sigmas = std::max(honesty.worst_sigmas, worst);
    honesty.beyond_five_sigmas += worst > 5 ? 1 : 0;
    centre.push_back(frame->errors[kGridPoints / 2].whitened);
  }
  const std::size_t n = centre.size();
  honesty.frames = static_cast<int>(n);
  if (n == 0) return honesty;
  honesty.nees = sum / static_cast<double>(n * kGridPoints);
  double square = 0;
  for (const auto& z : centre) square += z.squaredNorm();
  double correlated = 1;
  for (std::size_t lag = 1; lag < n && square > 0; ++lag) {
    double product = 0;
    for (std::size_t i = 0; i + lag < n; ++i) product += centre[i].dot(centre[i + lag]);
    // The products of a long lag are few, and so is their sum.
    const double rho = product / square;
    correlated += 2 * rho * rho;
  }
  honesty.independent = std::max(1.0, static_cast<double>(n) / correlated);
  honesty.interval =
      mean_square_interval(static_cast<int>(std::lround(2 * honesty.independent)), 0.95);
  return honesty;
}

std::vector<const FrameEvaluation*> frames_between(const Evaluation& evaluation, double from_s,
                                                   double to_s) {
  std::vector<const FrameEvaluation*> frames;
  for (const FrameEvaluation& frame : evaluation.frames) {
    if (frame.time_s >= from_s && frame.time_s < to_s) frames.push_back(&frame);
  }
  return frames;
}

}  // namespace alidade::test
