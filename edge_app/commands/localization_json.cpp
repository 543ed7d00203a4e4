#include "edge_app/commands/localization_json.h"

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/model/nearest_angles.h"

namespace alidade {

void add_localization(const Localization& found, const Mechanics<double>& mechanics,
                      nlohmann::ordered_json* json) {
  (*json)["status"] = to_string(found.status);
  (*json)["matches"] = found.matches;
  if (found.status != LocalizationStatus::kOk) return;
  const PicturePose& pose = found.pose;
  const PanTilt<double> angle = nearest_angles(mechanics, pose.R_base_from_camera).angle;
  const Eigen::Quaterniond q(pose.R_base_from_camera);
  (*json)["pan_rad"] = angle.pan;
  (*json)["tilt_rad"] = angle.tilt;
  (*json)["q_base_from_camera"] = {q.x(), q.y(), q.z(), q.w()};
  (*json)["orientation_sigma_rad"] = {std::sqrt(pose.covariance(0, 0)),
                                      std::sqrt(pose.covariance(1, 1)),
                                      std::sqrt(pose.covariance(2, 2))};
  // Angles and focal length are those at the exposure of this row. The changes below are from the
  // first row to the last.
  const PictureMotion motion = in_heights(pose.motion, pose.camera.height);
  (*json)["reference_row"] = motion.reference_row;
  (*json)["read_out_turn_rad"] = {motion.angular_velocity.x(), motion.angular_velocity.y(),
                                  motion.angular_velocity.z()};
  (*json)["read_out_log_f"] = motion.zoom_rate;
  (*json)["focal_length_px"] = pose.camera.focal_length;
  (*json)["focal_length_sigma_px"] = pose.camera.focal_length * std::sqrt(pose.covariance(3, 3));
  (*json)["aspect"] = pose.camera.aspect;
  (*json)["radial_distortion"] = pose.camera.distortion.only_term();
}

}  // namespace alidade
