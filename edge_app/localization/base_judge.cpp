#include "edge_app/localization/base_judge.h"

#include "core/model/nearest_angles.h"
#include "core/realtime/oe_mode/covariance.h"

namespace alidade {
namespace {

constexpr double kBelieved = 25;  // chi-square, 2 degrees of freedom: larger once in 3e5

// Covariance of (pan, tilt), from that of xi.
Matrix2<double> angle_covariance(const Matrix<double, 3, 2>& J_xi_angle,
                                 const Matrix3<double>& covariance) {
  const Matrix<double, 2, 3> to_angle = J_angle_xi(J_xi_angle);
  const Matrix2<double> out = to_angle * covariance * to_angle.transpose();
  return symmetric(out);
}

bool is_beyond(const Vector2<double>& change, const Matrix2<double>& covariance) {
  return !(change.dot(inverse_of(covariance) * change) < kBelieved);
}

}  // namespace

BaseJudge::Verdict BaseJudge::judge(const OrientationRecord& record, const Localization& found,
                                    double reference_row, ToldBase* told, BaseOffset* offset) {
  const FrameOrientation frame = unpack(record.orientation->geometry, record.camera);
  const Mechanics<double>& mechanics = frame.calibration.mechanics;
  const Matrix3<double>& R_localized = found.pose.R_base_from_camera;
  const PanTilt<double> localized = nearest_angles(mechanics, R_localized).angle;
  const PanTilt<double> answered =
      angle_at_row(frame.motion(), frame.calibration.line_delay, reference_row);
  const Vector2<double> change = minus(localized, answered);

  Matrix<double, 3, 2> J_xi_angle;
  const Matrix3<double> R_by_angles = R_base_from_camera(mechanics, localized, &J_xi_angle);
  const Matrix2<double> of_map =
      angle_covariance(J_xi_angle, found.pose.covariance.topLeftCorner<3, 3>());
  const Matrix2<double> of_record = angle_covariance(
      J_xi_angle, Eigen::Map<const Matrix3<double>>(record.orientation->covariance_rad2.data()));
  const Matrix2<double> of_change = of_map + of_record;
  PanTilt<double> before;
  Matrix2<double> of_before = Matrix2<double>::Zero();
  if (record.localized) {
    before = record.localized->telemetry_zero;
    of_before = unpack_symmetric(record.localized->zero_covariance);
  }
  offset->covariance = of_change + of_before;
  offset->zero = {before.pan + change.x(), before.tilt + change.y()};
  offset->roll = log_so3<double>(R_by_angles.transpose() * R_localized).z();
  told->change_rad = {change.x(), change.y()};
  told->covariance = pack_symmetric(of_map);
  told->moved = false;

  Matrix2<double> of_zero = offset->covariance + told_.covariance;
  of_zero.diagonal().array() += options_.zero_sigma * options_.zero_sigma;
  const bool is_zero_beyond = is_beyond(minus(offset->zero, told_.zero), of_zero);
  if (!is_zero_beyond && !(record.localized && is_beyond(change, of_change))) {
    suspected_.reset();
    return is_vague(record, of_change) ? Verdict::kVague : Verdict::kExpected;
  }
  // What both have in common, such as the zero known before, confirms nothing.
  const BaseOffset suspected = {offset->zero, of_change, offset->roll};
  const bool confirmed = suspected_ && !is_beyond(minus(suspected.zero, suspected_->zero),
                                                  suspected.covariance + suspected_->covariance);
  suspected_ = suspected;
  if (!confirmed) return Verdict::kSuspected;
  if (!options_.correct) return Verdict::kReported;
  suspected_.reset();
  told_ = *offset;
  told->moved = true;
  return Verdict::kMoved;
}

// A record that is tied follows the zero wherever it has gone. Where movements are not to be
// corrected, a first tie therefore waits until the record could show one, but not for ever.
bool BaseJudge::is_vague(const OrientationRecord& record, const Matrix2<double>& covariance) {
  constexpr double kLongest_s = 60;
  const double most = options_.zero_sigma * options_.zero_sigma;
  if (options_.correct || record.localized || covariance.diagonal().maxCoeff() < most) {
    vague_since_s_.reset();
    return false;
  }
  if (!vague_since_s_) vague_since_s_ = *record.time_s;
  return *record.time_s - *vague_since_s_ < kLongest_s;
}

}  // namespace alidade
