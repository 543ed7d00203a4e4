// What PT mode costs, beside a plain implementation of the same formulas: samples in a std::map,
// matrices of dynamic size, and fixed-point iterations in place of the closed-form inverse and of
// Newton's search for the row (the paper's way, section IV-F). Times are for one look-up or one pixel.
// The statistics are over repetitions: median and p99 of their means.

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <map>
#include <vector>

#include "core/realtime/pt_mode.h"
#include "test/benchmark/paper_camera.h"

namespace alidade::benchmarks {
namespace {

// ---- the plain way ----

struct PlainOrientation {
  Eigen::MatrixXd R;
  Eigen::VectorXd angular_velocity;
  Eigen::MatrixXd covariance;
};

// The cubic through the eight samples around the middle row, and the covariance of what it says.
PlainOrientation plain_orientation(const Calibration& calibration,
                                   const std::map<double, Eigen::VectorXd>& telemetry,
                                   double frame_time) {
  const double half_readout = calibration.line_delay * calibration.camera.height / 2;
  const double time = frame_time + calibration.clock_offset + half_readout;
  auto end = telemetry.upper_bound(time);
  for (int i = 0; i < 4 && end != telemetry.end(); ++i) ++end;
  const auto first = std::prev(end, 8);
  Eigen::MatrixXd powers(8, 4);
  Eigen::MatrixXd angles(8, 2);
  int row = 0;
  for (auto it = first; it != end; ++it, ++row) {
    const double x = it->first - time;
    powers.row(row) << 1, x, x * x, x * x * x;
    angles.row(row) = it->second;
  }
  const Eigen::MatrixXd solver =
      powers.colPivHouseholderQr().solve(Eigen::MatrixXd::Identity(8, 8));
  const Eigen::MatrixXd coefficients = solver * angles;
  const Eigen::VectorXd rate = coefficients.row(1);
  const Eigen::VectorXd angle = coefficients.row(0).transpose() - half_readout * rate;

  const Eigen::MatrixXd weights = solver.topRows(2);
  const Eigen::MatrixXd by_angle = weights * weights.transpose();
  const double own_variance = std::pow(TelemetryNoise().period_sigma_s, 2) / 2;
  const double shared_variance = 2 * kStampSigma * kStampSigma - own_variance;
  Eigen::MatrixXd covariance(4, 4);
  for (int i = 0; i < 2; ++i) {
    for (int j = 0; j < 2; ++j) {
      covariance.block(2 * i, 2 * j, 2, 2) =
          kAngleSigma * kAngleSigma * by_angle(i, j) * Eigen::MatrixXd::Identity(2, 2) +
          (own_variance * by_angle(i, j) + (i + j == 0 ? shared_variance : 0)) * rate *
              rate.transpose();
    }
  }
  Eigen::MatrixXd to_row_0 = Eigen::MatrixXd::Identity(4, 4);
  to_row_0.topRightCorner(2, 2) = -half_readout * Eigen::MatrixXd::Identity(2, 2);
  covariance = to_row_0 * covariance * to_row_0.transpose();

  Matrix<double, 3, 2> J_angle;
  Matrix<double, 3, 4> J_axes;
  const Matrix3<double> R =
      R_base_from_camera(calibration.mechanics, {angle[0], angle[1]}, &J_angle, &J_axes);
  const Eigen::MatrixXd J_motion =
      motion_parameter_jacobian<double>(calibration.mechanics,
                                        {{angle[0], angle[1]}, {rate[0], rate[1]}, 0})
          .topRows<2>();
  Eigen::MatrixXd J = Eigen::MatrixXd(J_angle) * J_motion;
  J.middleCols(index(Parameter::kPanAxis0), 4) += J_axes;
  const Eigen::MatrixXd cov_parameters = calibration.covariance;
  return {R, J_angle * rate,
          J_angle * covariance.topLeftCorner(2, 2) * J_angle.transpose() +
              J * cov_parameters * J.transpose()};
}

Vector3<double> plain_unproject(const Camera<double>& camera, const Vector2<double>& u) {
  const Vector2<double> distorted((u.x() - camera.width / 2.0) / camera.focal_length,
                                  (u.y() - camera.height / 2.0) / camera.focal_length);
  Vector2<double> x = distorted;
  for (int i = 0; i < 100; ++i) {
    const Vector2<double> next = distorted / (1 + camera.distortion.radial * x.squaredNorm());
    const double step = (next - x).norm();
    x = next;
    if (step < 1e-14) break;
  }
  return Vector3<double>(x.x(), x.y(), 1).normalized();
}

Matrix3<double> plain_rotation(const FrameOrientation& frame, double row) {
  const Vector3<double> turned = row * frame.calibration.line_delay * frame.angular_velocity;
  const double angle = turned.norm();
  if (angle == 0) return frame.R_base_from_camera;
  return frame.R_base_from_camera * Eigen::AngleAxisd(angle, turned / angle).toRotationMatrix();
}

Vector2<double> plain_pixel(const FrameOrientation& frame, const Vector3<double>& d_b) {
  const Camera<double>& camera = frame.calibration.camera;
  Vector2<double> u(0, camera.height / 2.0);
  for (int i = 0; i < 100; ++i) {
    const Vector3<double> d_c = plain_rotation(frame, u.y()).transpose() * d_b;
    const Vector2<double> x = d_c.head<2>() / d_c.z();
    const double scale = camera.focal_length * (1 + camera.distortion.radial * x.squaredNorm());
    const Vector2<double> next(scale * x.x() + camera.width / 2.0,
                               scale * x.y() + camera.height / 2.0);
    const double step = (next - u).norm();
    u = next;
    if (step < 1e-9) break;
  }
  return u;
}

// ---- benchmarks ----

template <std::size_t Capacity>
void orientation(benchmark::State& state, double oldest_age) {
  const auto buffer = filled_buffer<Capacity>();
  const Calibration calibration = paper_calibration();
  const auto times = frame_times(*buffer.newest_time(), oldest_age);
  FrameOrientation frame;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        pt_orientation(calibration, buffer, times[i++ % kQueries], kStampSigma, &frame));
    benchmark::DoNotOptimize(frame);
  }
}

void BM_Orientation(benchmark::State& state) { orientation<256>(state, 0.2); }
void BM_OrientationOfAnyAge(benchmark::State& state) { orientation<256>(state, 8); }
void BM_OrientationOfAnyAgeIn4096(benchmark::State& state) { orientation<4096>(state, 130); }

// Both ways must do the same work: wherever PT mode takes the cubic, they agree.
void expect_same_result(const Calibration& calibration,
                        const std::map<double, Eigen::VectorXd>& telemetry,
                        const std::vector<double>& times) {
  TelemetryNoise noise;
  noise.pan_tilt_sigma = kAngleSigma;
  TelemetryBuffer<256> buffer(noise);
  for (const auto& [time, angle] : telemetry) {
    if (buffer.push({time, kStampSigma, angle[0], angle[1]}) != PushStatus::kStored) std::abort();
  }
  int same = 0;
  for (const double time : times) {
    FrameOrientation frame;
    if (!has_result(pt_orientation(calibration, buffer, time, kStampSigma, &frame))) std::abort();
    const PlainOrientation plain = plain_orientation(calibration, telemetry, time);
    same += (plain.R - frame.R_base_from_camera).norm() < 1e-9 &&
            (plain.covariance - frame.orientation_covariance).norm() <
                1e-3 * frame.orientation_covariance.norm();
  }
  if (same < kQueries / 2) std::abort();
}

void BM_PlainOrientation(benchmark::State& state) {
  std::map<double, Eigen::VectorXd> telemetry;
  for (const TelemetrySample& sample : paper_telemetry(256)) {
    telemetry[sample.time_s] = Eigen::Vector2d(sample.pan, sample.tilt);
  }
  const Calibration calibration = paper_calibration();
  const auto times = frame_times(telemetry.rbegin()->first, 0.2);
  std::size_t i = 0;
  expect_same_result(calibration, telemetry, times);
  for (auto _ : state) {
    benchmark::DoNotOptimize(plain_orientation(calibration, telemetry, times[i++ % kQueries]));
  }
}

void BM_TelemetryQuery(benchmark::State& state) {
  const auto buffer = filled_buffer<256>();
  const auto times = frame_times(*buffer.newest_time() - 0.0844, 0.2);
  InterpolatedPanTilt result;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(buffer.query(times[i++ % kQueries], kStampSigma, &result));
    benchmark::DoNotOptimize(result);
  }
}

void BM_TelemetryPush(benchmark::State& state) {
  TelemetryBuffer<256> buffer;
  const auto telemetry = paper_telemetry(kQueries);
  double lap = 0;
  std::size_t i = 0;
  for (auto _ : state) {
    TelemetrySample sample = telemetry[i];
    sample.time_s += lap;
    benchmark::DoNotOptimize(buffer.push(sample));
    if (++i == telemetry.size()) {
      i = 0;
      lap += kQueries / 30.0;
    }
  }
}

void direction(benchmark::State& state, Matrix2<double>* covariance) {
  const FrameOrientation frame = paper_frame();
  const auto targets = pixels();
  Vector3<double> d_b;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(frame.direction(targets[i++ % kQueries], &d_b, covariance));
    benchmark::DoNotOptimize(d_b);
  }
}

void BM_Direction(benchmark::State& state) { direction(state, nullptr); }
void BM_DirectionWithCovariance(benchmark::State& state) {
  Matrix2<double> covariance;
  direction(state, &covariance);
}

void BM_PlainDirection(benchmark::State& state) {
  const FrameOrientation frame = paper_frame();
  const auto targets = pixels();
  std::size_t i = 0;
  for (auto _ : state) {
    const Vector2<double>& u = targets[i++ % kQueries];
    const Vector3<double> d_b =
        plain_rotation(frame, u.y()) * plain_unproject(frame.calibration.camera, u);
    benchmark::DoNotOptimize(d_b);
  }
}

std::vector<Vector3<double>> directions(const FrameOrientation& frame) {
  std::vector<Vector3<double>> result;
  for (const Vector2<double>& u : pixels()) {
    Vector3<double> d_b;
    if (frame.direction(u, &d_b) != ProjectionStatus::kOk) std::abort();
    result.push_back(d_b);
  }
  return result;
}

void pixel(benchmark::State& state, Matrix2<double>* covariance) {
  const FrameOrientation frame = paper_frame();
  const auto targets = directions(frame);
  Vector2<double> u;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(frame.pixel(targets[i++ % kQueries], &u, covariance));
    benchmark::DoNotOptimize(u);
  }
}

void BM_Pixel(benchmark::State& state) { pixel(state, nullptr); }
void BM_PixelWithCovariance(benchmark::State& state) {
  Matrix2<double> covariance;
  pixel(state, &covariance);
}

void BM_PlainPixel(benchmark::State& state) {
  const FrameOrientation frame = paper_frame();
  const auto targets = directions(frame);
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(plain_pixel(frame, targets[i++ % kQueries]));
  }
}

double p99(const std::vector<double>& values) {
  std::vector<double> sorted = values;
  std::sort(sorted.begin(), sorted.end());
  return sorted[static_cast<std::size_t>(0.99 * static_cast<double>(sorted.size() - 1))];
}

void repeat(benchmark::internal::Benchmark* benchmark) {
  benchmark->Repetitions(100)->MinTime(0.01)->ReportAggregatesOnly()->ComputeStatistics("p99", p99);
}

BENCHMARK(BM_Orientation)->Apply(repeat);
BENCHMARK(BM_PlainOrientation)->Apply(repeat);
BENCHMARK(BM_OrientationOfAnyAge)->Apply(repeat);
BENCHMARK(BM_OrientationOfAnyAgeIn4096)->Apply(repeat);
BENCHMARK(BM_TelemetryQuery)->Apply(repeat);
BENCHMARK(BM_TelemetryPush)->Apply(repeat);
BENCHMARK(BM_Direction)->Apply(repeat);
BENCHMARK(BM_PlainDirection)->Apply(repeat);
BENCHMARK(BM_DirectionWithCovariance)->Apply(repeat);
BENCHMARK(BM_Pixel)->Apply(repeat);
BENCHMARK(BM_PlainPixel)->Apply(repeat);
BENCHMARK(BM_PixelWithCovariance)->Apply(repeat);

}  // namespace
}  // namespace alidade::benchmarks

BENCHMARK_MAIN();
