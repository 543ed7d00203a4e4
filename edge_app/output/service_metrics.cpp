#include "edge_app/output/service_metrics.h"

#include <unistd.h>

#include <array>
#include <cmath>
#include <fstream>

#include "edge_app/output/metrics.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

// Bytes; 0 if the kernel does not say.
std::int64_t resident_memory() {
  std::ifstream file("/proc/self/statm");
  std::int64_t all = 0;
  std::int64_t resident = 0;
  file >> all >> resident;
  return resident * ::sysconf(_SC_PAGESIZE);
}

void add_calibration_metrics(const OrientationRecord& newest, double age_s, MetricsText* out) {
  const Calibration calibration = unpack(newest.camera);
  const auto sigma = [&calibration](Parameter parameter) {
    return parameter_sigma(calibration, parameter);
  };
  out->gauge("alidade_calibrated", "1: a calibration is in use; 0: the data sheet");
  out->add(std::int64_t{newest.calibrated});
  out->gauge("alidade_calibration_activity", "1 for what the calibration thread does");
  for (const CalibrationActivity activity :
       {CalibrationActivity::kOff, CalibrationActivity::kCollecting,
        CalibrationActivity::kAdjusting, CalibrationActivity::kWatching,
        CalibrationActivity::kDoubtful}) {
    out->add(std::int64_t{newest.calibration.activity == activity},
             {{"activity", to_string(activity)}});
  }
  out->gauge("alidade_calibration_age_seconds", "Since the calibration in use was taken into use");
  out->add(age_s);
  out->gauge("alidade_calibration_focal_length_pixels", "Focal length in use");
  out->add(calibration.camera.focal_length);
  out->gauge("alidade_calibration_focal_length_sigma_pixels", "Its standard deviation");
  out->add(sigma(Parameter::kFocalLength));
  out->gauge("alidade_calibration_aspect_sigma_ratio", "Standard deviation of the aspect");
  out->add(sigma(Parameter::kAspect));
  static_assert(kDistortionCount == 1, "a gauge for each term");
  out->gauge("alidade_calibration_radial_distortion_sigma_ratio",
             "Standard deviation of the radial distortion");
  out->add(sigma(Parameter::kRadialDistortion));
  out->gauge("alidade_calibration_line_delay_seconds", "Line delay in use, of one row");
  out->add(calibration.line_delay);
  out->gauge("alidade_calibration_line_delay_sigma_seconds", "Its standard deviation");
  out->add(sigma(Parameter::kLineDelay));
  out->gauge("alidade_calibration_clock_offset_seconds", "Telemetry clock minus image clock");
  out->add(calibration.clock_offset);
  out->gauge("alidade_calibration_clock_offset_sigma_seconds", "Its standard deviation");
  out->add(sigma(Parameter::kClockOffset));
  out->gauge("alidade_calibration_axis_sigma_radians",
             "Standard deviation of an axis, in its tangent basis");
  out->add(sigma(Parameter::kPanAxis0), {{"axis", "pan"}, {"component", "0"}});
  out->add(sigma(Parameter::kPanAxis1), {{"axis", "pan"}, {"component", "1"}});
  out->add(sigma(Parameter::kTiltAxis0), {{"axis", "tilt"}, {"component", "0"}});
  out->add(sigma(Parameter::kTiltAxis1), {{"axis", "tilt"}, {"component", "1"}});
  out->gauge("alidade_calibration_scale_sigma_ratio",
             "Standard deviation of an axis's scale, measured angle over true angle");
  out->add(sigma(Parameter::kPanScale), {{"axis", "pan"}});
  out->add(sigma(Parameter::kTiltScale), {{"axis", "tilt"}});
}

// curve: null if there is none.
void add_zoom_metrics(const OrientationRecord& newest,
                      const std::shared_ptr<const ZoomCurve>& curve, MetricsText* out) {
  if (newest.camera.zoom) {
    out->gauge("alidade_calibration_zoom_reading",
               "Zoom reading that the calibration in use is for, in the device's own scale");
    out->add(*newest.camera.zoom);
  }
  out->gauge("alidade_zoom_curve_nodes", "Calibrated visits of zoom readings; 0: no zoom curve");
  out->add(std::int64_t{curve ? curve->visits() : 0});
  if (!curve) return;
  out->gauge("alidade_zoom_curve_reading", "First and last zoom reading of the curve");
  out->add(curve->first_reading(), {{"end", "first"}});
  out->add(curve->last_reading(), {{"end", "last"}});
}

void add_record_metrics(const OrientationRecord& newest, MetricsText* out) {
  out->gauge("alidade_mode", "1 for the mode of the newest record");
  for (const RecordMode mode : {RecordMode::kOe, RecordMode::kPt, RecordMode::kNone})
    out->add(std::int64_t{newest.mode == mode}, {{"mode", to_string(mode)}});
  out->gauge("alidade_landmarks", "Landmarks that held the newest record");
  out->add(std::int64_t{newest.landmarks});
  if (newest.residual_px) {
    out->gauge("alidade_residual_pixels", "Root mean square of their residuals' lengths");
    out->add(*newest.residual_px);
  }
  if (newest.orientation) {
    constexpr std::array<const char*, 3> kAxes = {"right", "down", "forward"};
    out->gauge("alidade_orientation_sigma_radians",
               "Standard deviation of the newest orientation about the camera's axes");
    for (std::size_t i = 0; i < kAxes.size(); ++i)
      out->add(newest.orientation->sigma_rad[i], {{"axis", kAxes[i]}});
  }
  if (newest.telemetry_age_s) {
    out->gauge("alidade_telemetry_age_seconds",
               "How far the newest frame lies beyond the newest trusted angle of telemetry");
    out->add(*newest.telemetry_age_s);
  }
  out->gauge("alidade_video_clock_locked", "1: the video's clock filter knows its line");
  out->add(std::int64_t{newest.clock_locked});
  if (newest.time_s) {
    out->gauge("alidade_video_clock_sigma_seconds",
               "Standard deviation of the newest frame's time");
    out->add(newest.time_sigma_s);
  }
}

void add_upkeep_metrics(const UpkeepReport& upkeep, MetricsText* out) {
  out->counter("alidade_scene_map_updates_total",
               "Updates of the scene map on disk, one transaction each");
  out->add(upkeep.updates);
  out->gauge("alidade_scene_map_upkeep_stopped", "1: the scene map's file took nothing more");
  out->add(std::int64_t{upkeep.stopped});
  out->counter("alidade_scene_map_upkeep_landmarks_total",
               "Landmarks by what keeping the map up did with them");
  out->add(upkeep.expected, {{"what", "expected"}});
  out->add(upkeep.updated, {{"what", "updated"}});
  out->add(upkeep.beyond_gate, {{"what", "beyond_gate"}});
  out->add(upkeep.born, {{"what", "born"}});
  out->add(upkeep.died, {{"what", "died"}});
  out->add(upkeep.not_close, {{"what", "not_close"}});
  out->counter("alidade_scene_map_upkeep_pictures_total",
               "Pictures that the map was kept up by, and those in which too little was found to "
               "blame a landmark");
  out->add(upkeep.pictures - upkeep.hidden, {{"what", "seen"}});
  out->add(upkeep.hidden, {{"what", "hidden"}});
}

void add_scene_metrics(const SceneReport& report, double now_s, MetricsText* out) {
  out->gauge("alidade_scene_map_landmarks", "Landmarks of the scene map in use");
  out->add(report.landmarks);
  out->counter("alidade_scene_map_pictures_total",
               "Pictures that were looked for in the scene map, by what came of it");
  out->add(report.found_by_hint, {{"result", "found_by_hint"}});
  out->add(report.found - report.found_by_hint, {{"result", "found_in_all"}});
  out->add(report.not_in_map, {{"result", "not_in_map"}});
  out->add(report.ambiguous, {{"result", "ambiguous"}});
  out->add(report.unusable, {{"result", "unusable"}});
  out->counter("alidade_scene_map_movements_total",
               "Movements of the base or of telemetry's zero that were found");
  out->add(report.movements);
  out->gauge("alidade_scene_map_uncorrected", "1: such a movement is reported only, and lasts");
  out->add(std::int64_t{report.uncorrected});
  if (report.last) {
    out->gauge("alidade_scene_map_last_age_seconds", "Since the last picture was looked for");
    out->add(now_s - report.last->finished_s);
  }
  if (report.upkeep) add_upkeep_metrics(*report.upkeep, out);
  if (!report.offset) return;
  out->gauge("alidade_scene_map_telemetry_offset_radians",
             "What telemetry's true angles lack in the map's base");
  out->add(report.offset->zero.pan, {{"axis", "pan"}});
  out->add(report.offset->zero.tilt, {{"axis", "tilt"}});
}

void add_link_metrics(const PipelineSummary& summary, MetricsText* out) {
  const std::array<std::pair<const char*, const LinkHealth*>, 2> links = {
      {{"video", &summary.video_link}, {"pan_tilt", &summary.pan_tilt_link}}};
  out->gauge("alidade_link_connected", "1: the link stands; 0: lost, refused or not there yet");
  for (const auto& [name, link] : links) out->add(std::int64_t{link->connected}, {{"link", name}});
  out->counter("alidade_link_reconnections_total", "Times that a lost link came back");
  for (const auto& [name, link] : links) out->add(link->reconnections, {{"link", name}});
  out->gauge("alidade_link_last_sample_age_seconds", "Since a link's last frame or sample came");
  for (const auto& [name, link] : links) {
    if (link->age_s) out->add(*link->age_s, {{"link", name}});
  }
  out->gauge("alidade_link_rate_hertz", "Frames or samples a second that come over a link");
  for (const auto& [name, link] : links) {
    if (link->rate_hz) out->add(*link->rate_hz, {{"link", name}});
  }
}

void add_target_metrics(const TargetFeed& feed, MetricsText* out) {
  const TargetFeed::Snapshot snapshot = feed.snapshot();
  const auto& newest = snapshot.newest;
  const TargetCounters& counters = snapshot.counters;
  out->gauge("alidade_targets", "Targets that are tracked, in view or not");
  out->add(static_cast<std::int64_t>(newest ? newest->targets.size() : 0));
  out->counter("alidade_detection_frames_total", "Frames of detections, by what became of them");
  for (int i = 0; i < kDetectionStatusCount; ++i) {
    const auto status = static_cast<DetectionStatus>(i);
    out->add(counters.of(status), {{"outcome", label_of(status)}});
  }
  out->gauge("alidade_detection_frames_waiting", "Frames of detections in the queue");
  out->add(static_cast<std::int64_t>(snapshot.waiting));
  out->counter("alidade_detection_boxes_total",
               "Boxes of frames that were taken, by what became of them");
  for (const auto& outcome : counters.boxes())
    out->add(outcome.boxes, {{"outcome", outcome.label}});
  out->counter("alidade_target_births_refused_total",
               "Targets not begun, as tracking.max_targets were there");
  out->add(counters.births_refused);
}

void add_link_delay_metrics(const PipelineSummary& summary, double now_s, MetricsText* out) {
  out->gauge("alidade_link_delay_seconds",
             "By how much telemetry comes later against the pictures than when the camera was "
             "calibrated; 0 if it was through this connection");
  out->add(summary.link_delay->delay_s);
  out->gauge("alidade_link_delay_sigma_seconds", "Its standard deviation");
  out->add(summary.link_delay->sigma_s);
  out->gauge("alidade_link_delay_age_seconds", "Since it was told, or began to be open");
  out->add(now_s - summary.link_delay_since_s);
  out->gauge("alidade_link_delay_open", "1: no movement has told it yet");
  out->add(std::int64_t{summary.link_delay->state == LinkDelayState::kOpen});
}

void add_detector_metrics(const DetectorsReport& report, MetricsText* out) {
  out->counter("alidade_detector_pictures_replaced_total",
               "Pictures that no detector looked at, as a newer one came");
  out->add(report.replaced);
  out->counter("alidade_detector_pictures_total",
               "Pictures that a detector looked at, by whether it could judge them");
  for (const DetectorKindRow& row : kDetectorKinds) {
    const std::optional<DetectorCounters>& counters = report.counters[row.kind];
    if (!counters) continue;
    out->add(counters->pictures - counters->unjudged,
             {{"detector", row.name}, {"result", "judged"}});
    out->add(counters->unjudged, {{"detector", row.name}, {"result", "unjudged"}});
  }
  out->counter("alidade_detector_boxes_total", "Boxes that a detector found");
  for (const DetectorKindRow& row : kDetectorKinds) {
    if (const auto& counters = report.counters[row.kind])
      out->add(counters->boxes, {{"detector", row.name}});
  }
}

void add_mqtt_metrics(const MqttCounters& mqtt, MetricsText* out) {
  out->gauge("alidade_mqtt_connected", "1: the MQTT broker has taken the connection");
  out->add(std::int64_t{mqtt.connected});
  out->counter("alidade_mqtt_connections_total", "Times that it has taken one");
  out->add(mqtt.connections);
  out->counter("alidade_mqtt_published_total", "Messages that it has taken");
  out->add(mqtt.published);
  out->counter("alidade_mqtt_replaced_total", "States not sent, as newer ones took their place");
  out->add(mqtt.replaced);
}

}  // namespace

std::string service_metrics(const HttpApiSources& sources, const HttpCounters& http) {
  const PipelineSummary summary = sources.summary();
  const FrameSourceCounters losses = sources.video_losses();
  const double now_s = monotonic_now_s();
  MetricsText out;
  out.gauge("alidade_build_info", "1, with the version");
  out.add(std::int64_t{1}, {{"version", sources.version}});
  out.gauge("alidade_uptime_seconds", "Since the program began");
  out.add(now_s - sources.live->started_s());
  out.gauge("process_resident_memory_bytes", "Memory of the process that is in use");
  out.add(resident_memory());

  out.counter("alidade_frames_total", "Video frames");
  out.add(summary.frames);
  out.counter("alidade_records_total", "Records, by mode");
  out.add(summary.with_landmarks, {{"mode", "OE"}});
  out.add(summary.with_orientation - summary.with_landmarks, {{"mode", "PT"}});
  out.add(summary.records - summary.with_orientation, {{"mode", "none"}});
  out.counter(
      "alidade_records_withheld_total",
      "Records not in OE mode, or without orientation where that is not asked for, by status");
  for (const RecordStatus status : kRecordStatuses) {
    const std::int64_t count = summary.reasons.of(status);
    if (status != RecordStatus::kOk || count > 0) out.add(count, {{"status", to_string(status)}});
  }
  out.counter("alidade_frames_lost_total", "Frames lost before they were read, by reason");
  out.add(losses.damaged, {{"reason", "damaged"}});
  out.add(losses.dropped, {{"reason", "not_fetched"}});
  out.counter("alidade_frames_unstamped_total", "Frames whose time stamp cannot be true");
  out.add(losses.unstamped);
  out.counter("alidade_video_foreign_packets_total",
              "Packets that the video's session has not agreed upon, left out");
  out.add(losses.foreign_packets);
  out.counter("alidade_video_garbage_bytes_total",
              "Bytes of the video's connection that are of no packet, passed over");
  out.add(losses.garbage_bytes);
  add_link_metrics(summary, &out);
  out.counter("alidade_queue_dropped_total",
              "Messages lost to full queues; those to the calibration cost no record");
  out.add(summary.drops.frames, {{"queue", "frames"}});
  out.add(summary.drops.telemetry, {{"queue", "telemetry"}});
  out.add(summary.drops.records, {{"queue", "records"}});
  out.add(summary.drops.unheard, {{"queue", "calibration"}});
  out.counter("alidade_late_pictures_total",
              "Pictures not looked at, so that the frames behind them need not wait");
  out.add(summary.drops.late_images);
  out.counter("alidade_repeated_pictures_total",
              "Pictures that were the one before, sent again while the camera turned");
  out.add(summary.repeated);
  out.counter("alidade_video_clock_restarts_total", "Starts of the video's clock filter anew");
  out.add(summary.clock_restarts);
  out.counter("alidade_video_clock_floor_shifts_total",
              "Steps of the delay: the video's least delay or the sender's clock moved");
  out.add(summary.delay_steps);
  out.gauge("alidade_video_clock_wander_seconds",
            "By how much time stamps and arrivals wander against each other");
  out.add(summary.delay_wander_s);
  if (summary.link_delay) add_link_delay_metrics(summary, now_s, &out);
  out.gauge("alidade_video_stamps_left_out", "1: they run at another rate than the pictures come");
  out.add(std::int64_t{summary.stamps_left_out.has_value()});
  out.counter("alidade_realtime_page_faults_total",
              "Page faults of the real-time thread after its start-up");
  out.add(std::int64_t{summary.page_faults.minor}, {{"kind", "minor"}});
  out.add(std::int64_t{summary.page_faults.major}, {{"kind", "major"}});
  if (sources.latency_measured) {
    out.histogram("alidade_latency_seconds", "From a frame's arrival to its record");
    out.add(summary.latency);
    out.histogram("alidade_stage_duration_seconds", "Of a frame's way, by stage");
    out.add(summary.decoding, {{"stage", "decoding"}});
    out.add(summary.waiting, {{"stage", "waiting"}});
    out.add(summary.computing, {{"stage", "computing"}});
    out.add(summary.writing, {{"stage", "writing"}});
  }
  if (const auto newest = sources.live->newest()) {
    add_record_metrics(*newest, &out);
    add_calibration_metrics(*newest, now_s - sources.live->calibration_since_s().value_or(now_s),
                            &out);
    add_zoom_metrics(*newest, zoom_curve_of(sources), &out);
  }
  if (sources.targets != nullptr) add_target_metrics(*sources.targets, &out);
  if (sources.detectors) add_detector_metrics(sources.detectors(), &out);
  if (sources.mqtt != nullptr) add_mqtt_metrics(sources.mqtt->counters(), &out);
  if (sources.scene) add_scene_metrics(sources.scene(), now_s, &out);
  out.gauge("alidade_stream_clients", "Clients of the event stream");
  out.add(http.streams);
  out.counter("alidade_stream_lost_records_total", "Records that slow clients did not get");
  out.add(sources.live->lost_by_readers());
  out.gauge("alidade_http_connections", "Open connections");
  out.add(http.connections);
  out.counter("alidade_http_requests_total", "Requests whose head was read");
  out.add(http.requests);
  out.counter("alidade_http_refused_total", "Connections and requests beyond a limit");
  out.add(http.refused);
  out.counter("alidade_http_unauthorized_total", "Requests without the right token");
  out.add(http.unauthorized);
  out.counter("alidade_http_stalled_total", "Connections dropped as their client took nothing");
  out.add(http.stalled);
  return out.text();
}

}  // namespace alidade
