// Generated from edge_app/tracking/target_fields.yaml by scripts/generate-fields: change the list instead.

#include "alidade_ros/target_reader.h"

namespace alidade_ros {

void read_fields(const TargetReader& read, alidade_msgs::Target* message) {
  message->identity = read.integer("identity");
  message->label = read.word("class");
  message->score = read.number("score");
  message->born = read.stamp("born_s");
  message->seen = read.stamp("seen_s");
  message->in_view = read.number("in_view");
  message->direction = read.base_vector("direction");
  message->position = read.plane_point("position_m");
  message->velocity = read.plane_vector("velocity_m_s");
  message->latitude = read.number_or_nan("latitude_deg");
  message->longitude = read.number_or_nan("longitude_deg");
  message->azimuth = read.turned("azimuth_rad");
  message->elevation = read.number_or_nan("elevation_rad");
  message->azimuth_rate = read.turned("azimuth_rate_rad_s");
  message->elevation_rate = read.number_or_nan("elevation_rate_rad_s");
  message->covariance = read.state_covariance("covariance");
  message->in_picture = read.in_picture();
  message->pixel = read.pixel("pixel");
  message->pixel_covariance = read.pixel_covariance("covariance_px2");
  message->box = read.box("box");
}

}  // namespace alidade_ros
