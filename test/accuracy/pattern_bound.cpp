#include "test/accuracy/pattern_bound.h"

#include <Eigen/SparseCholesky>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace alidade::test {
namespace {

constexpr int kPose = 6;  // shift (m) and turn (rad) of the board in the camera's frame
constexpr int kUnknowns = kPose + kLensParameterCount;
using Change = Eigen::Matrix<double, kUnknowns, 1>;

// Steps that move a pixel by some hundredths.
Change steps() {
  Change h;
  h << Vector3<double>::Constant(2e-5), Vector3<double>::Constant(5e-5), 0.05, 0.05, 0.05, 0.05,
      1e-3, 1e-3, 1e-4, 1e-4, 1e-7;
  return h;
}

SimulatedLens changed(SimulatedLens lens, const Change& x) {
  const std::array<double*, kLensParameterCount> fields = {
      &lens.f_u, &lens.f_v, &lens.c_u, &lens.c_v,         &lens.k1,
      &lens.k2,  &lens.p1,  &lens.p2,  &lens.line_delay_s};
  for (std::size_t i = 0; i < fields.size(); ++i)
    *fields[i] += x[kPose + static_cast<Eigen::Index>(i)];
  return lens;
}

// Where one point is while the rows near its own are exposed: the motion's parabola there. A change of pose or lens moves a
// point by hundredths of a row.
class NearRow {
 public:
  NearRow(const HandMotion& motion, const Eigen::Vector3d& point, const Eigen::Vector3d& centre,
          double time_s)
      : time_s_(time_s), now_(motion.in_camera(point, centre, time_s)) {
    const Eigen::Vector3d after = motion.in_camera(point, centre, time_s + kStep_s);
    const Eigen::Vector3d before = motion.in_camera(point, centre, time_s - kStep_s);
    rate_ = (after - before) / (2 * kStep_s);
    half_acceleration_ = (after + before - 2 * now_) / (2 * kStep_s * kStep_s);
  }

  [[nodiscard]] Eigen::Vector3d in_camera(double time_s) const {
    const double dt = time_s - time_s_;
    return now_ + dt * (rate_ + dt * half_acceleration_);
  }

 private:
  static constexpr double kStep_s = 1e-4;
  double time_s_;
  Eigen::Vector3d now_;
  Eigen::Vector3d rate_;
  Eigen::Vector3d half_acceleration_;
};

// Where the point is seen with all that changed.
Eigen::Vector2d changed_pixel(const SimulatedLens& of_truth, const NearRow& point,
                              double frame_time_s, double row, const Change& x) {
  const SimulatedLens lens = changed(of_truth, x);
  const Eigen::Vector3d turn = x.segment<3>(3);
  const double angle = turn.norm();
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();
  if (angle > 0) turned = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  return seen_pixel(lens, row, [&](double of_row) {
    return Eigen::Vector3d(turned * point.in_camera(frame_time_s + of_row * lens.line_delay_s) +
                           x.head<3>());
  });
}

// The four uniform cubic B-splines on a segment, x in [0, 1].
Eigen::Vector4d weights_at(double x) {
  const double y = 1 - x;
  return Eigen::Vector4d(y * y * y, 3 * x * x * x - 6 * x * x + 4, 3 * y * y * y - 6 * y * y + 4,
                         x * x * x) /
         6;
}

}  // namespace

LensMatrix pattern_bound(const PatternScene& scene, const PatternData& data, double knots_per_s) {
  const std::vector<Eigen::Vector3d> board = simulated_board(scene);
  const Eigen::Vector3d centre = centre_of(board);
  const HandMotion motion(scene.seed, scene.speed, scene.hand);
  const Change h = steps();
  const double first = data.frames.front().time_s - 0.1;
  const double length = data.frames.back().time_s + 0.2 - first;
  const int segments = static_cast<int>(std::ceil(length * knots_per_s));
  const int curve = kPose * (segments + 3);
  using Local =
      Eigen::Matrix<double, 4 * kPose + kLensParameterCount, 4 * kPose + kLensParameterCount>;
  std::vector<Local> of_segment(static_cast<std::size_t>(segments), Local::Zero());
  for (const PatternFrame& frame : data.frames) {
    for (const PatternObservation& observation : frame.observations) {
      const Eigen::Vector3d& p = board[static_cast<std::size_t>(observation.point)];
      const double row =
          seen_pixel(scene.lens, observation.u.y(), [&](double of_row) {
            return motion.in_camera(p, centre, frame.time_s + of_row * scene.lens.line_delay_s);
          }).y();
      const NearRow point(motion, p, centre, frame.time_s + row * scene.lens.line_delay_s);
      Eigen::Matrix<double, 2, kUnknowns> J;
      for (int i = 0; i < kUnknowns; ++i) {
        Change x = Change::Zero();
        x[i] = h[i];
        J.col(i) = (changed_pixel(scene.lens, point, frame.time_s, row, x) -
                    changed_pixel(scene.lens, point, frame.time_s, row, -x)) /
                   (2 * h[i]);
      }
      const double place =
          (frame.time_s + row * scene.lens.line_delay_s - first) / length * segments;
      const int segment = std::min(std::max(static_cast<int>(place), 0), segments - 1);
      const Eigen::Vector4d weights = weights_at(place - segment);
      Eigen::Matrix<double, 2, Local::RowsAtCompileTime> row_of_J;
      for (int k = 0; k < 4; ++k)
        row_of_J.middleCols<kPose>(kPose * k) = weights[k] * J.leftCols<kPose>();
      row_of_J.rightCols<kLensParameterCount>() = J.rightCols<kLensParameterCount>();
      of_segment[static_cast<std::size_t>(segment)] +=
          row_of_J.transpose() * row_of_J / (scene.noise_px * scene.noise_px);
    }
  }
  const int size = curve + kLensParameterCount;
  std::vector<Eigen::Triplet<double>> entries;
  const auto place_of = [curve](int segment, int i) {
    return i < 4 * kPose ? kPose * segment + i : curve + i - 4 * kPose;
  };
  Eigen::VectorXd diagonal = Eigen::VectorXd::Zero(size);
  for (int s = 0; s < segments; ++s) {
    for (int i = 0; i < Local::RowsAtCompileTime; ++i) {
      diagonal[place_of(s, i)] += of_segment[static_cast<std::size_t>(s)](i, i);
      for (int j = 0; j < Local::ColsAtCompileTime; ++j)
        entries.emplace_back(place_of(s, i), place_of(s, j),
                             of_segment[static_cast<std::size_t>(s)](i, j));
    }
  }
  // Units of one size, and a trace of knowledge where there are no detections: it decouples what they do not reach.
  const Eigen::VectorXd scale =
      diagonal.cwiseMax(1e-6 * diagonal.head(curve).maxCoeff()).cwiseSqrt().cwiseInverse();
  for (auto& entry : entries)
    entry = {entry.row(), entry.col(), entry.value() * scale[entry.row()] * scale[entry.col()]};
  for (int i = 0; i < curve; ++i) entries.emplace_back(i, i, 1e-9);
  Eigen::SparseMatrix<double> information(size, size);
  information.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>, Eigen::Lower,
                              Eigen::NaturalOrdering<int>>
      ldlt(information);
  LensMatrix bound;
  for (int k = 0; k < kLensParameterCount; ++k) {
    Eigen::VectorXd unit = Eigen::VectorXd::Zero(size);
    unit[curve + k] = scale[curve + k];
    bound.col(k) =
        scale.cwiseProduct(Eigen::VectorXd(ldlt.solve(unit))).tail<kLensParameterCount>();
  }
  return bound;
}

}  // namespace alidade::test
