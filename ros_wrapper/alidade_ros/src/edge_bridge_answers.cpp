// What the bridge answers: diagnostics and services.

#include "alidade_ros/edge_bridge_ports.h"
#include "alidade_ros/services.h"

namespace alidade_ros {

void EdgeBridge::diagnose_connection(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const EventStream::Counters counters = stream_.counters();
  const std::lock_guard<std::mutex> lock(mutex_);
  if (connected_) {
    status.summary(Level::OK, "connected");
  } else {
    status.summary(Level::ERROR, error_);
  }
  status.add("url", client_.address().url);
  status.add("edge version", hello_.version);
  status.add("records", counters.records);
  status.add("lost records", counters.lost);
  status.add("repeated records", counters.repeated);
  status.add("not understood", counters.misunderstood);
  status.add("connections", counters.connections);
  status.add("detections taken", detections_taken_);
  status.add("detections refused", detections_refused_);
  status.add("boxes left out", boxes_left_out_);
  if (!detections_error_.empty()) status.add("why, last", detections_error_);
  status.add("steps of the wall clock", clock_.steps());
  if (const auto uncertainty = clock_.uncertainty_s()) {
    status.add("wall clock known to (s)", *uncertainty);
  }
}

void EdgeBridge::diagnose_orientation(diagnostic_updater::DiagnosticStatusWrapper& status) {
  using Level = diagnostic_msgs::DiagnosticStatus;
  const std::uint64_t records = stream_.counters().records;
  const std::lock_guard<std::mutex> lock(mutex_);
  const double elapsed_s = (ros::WallTime::now() - diagnosed_at_).toSec();
  const double rate_hz = static_cast<double>(records - diagnosed_records_) / elapsed_s;
  diagnosed_records_ = records;
  if (!connected_ || !newest_) {
    status.summary(Level::STALE, "no records");
    return;
  }
  if (newest_->mode == "none") {
    status.summary(Level::ERROR, newest_->status);
  } else if (newest_->status != "ok") {
    status.summary(Level::WARN, newest_->mode + " mode: " + newest_->status);
  } else if (!newest_->calibrated) {
    status.summary(Level::WARN, "not calibrated: " + newest_->calibration +
                                    (newest_->needs.empty() ? "" : "; " + newest_->needs));
  } else {
    status.summary(Level::OK, newest_->mode + " mode");
  }
  status.add("mode", newest_->mode);
  status.add("calibrated", newest_->calibrated);
  status.add("calibration", newest_->calibration);
  status.add("needs", newest_->needs);
  status.add("landmarks", newest_->landmarks);
  status.add("records a second", rate_hz);
  if (newest_->latency_s) status.add("latency (s)", *newest_->latency_s);
  if (newest_->telemetry_age_s) status.add("telemetry age (s)", *newest_->telemetry_age_s);
  if (newest_->zoom_rate_per_s) status.add("zoom rate (1/s)", *newest_->zoom_rate_per_s);
  if (newest_->residual_px) status.add("residual (px)", *newest_->residual_px);
}

bool EdgeBridge::pixel_to_direction(alidade_msgs::PixelToDirection::Request& request,
                                    alidade_msgs::PixelToDirection::Response& response) {
  std::string question;
  if (!direction_question(request, clock(), &question, &response.error)) return true;
  const HttpClient::Answer answer = client_.post("/api/v1/direction", question);
  response.error = answer.error;
  response.success =
      answer.ok() && direction_answer(answer.body, clock(), &response, &response.error);
  return true;
}

bool EdgeBridge::direction_to_pixel(alidade_msgs::DirectionToPixel::Request& request,
                                    alidade_msgs::DirectionToPixel::Response& response) {
  std::string question;
  if (!pixel_question(request, clock(), &question, &response.error)) return true;
  const HttpClient::Answer answer = client_.post("/api/v1/pixel", question);
  response.error = answer.error;
  response.success = answer.ok() && pixel_answer(answer.body, clock(), &response, &response.error);
  return true;
}

bool EdgeBridge::calibrate(alidade_msgs::Calibrate::Request& /*request*/,
                           alidade_msgs::Calibrate::Response& response) {
  const HttpClient::Answer answer = client_.post("/api/v1/calibrate", "{}");
  response.success = answer.ok();
  response.message = answer.ok() ? answer.body : answer.error;
  return true;
}

}  // namespace alidade_ros
