#include "edge_app/output/http_api.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>

#include "edge_app/output/calibration_json.h"
#include "edge_app/output/detection_query.h"
#include "edge_app/output/json_query.h"
#include "edge_app/output/openapi.h"
#include "edge_app/output/or_null.h"
#include "edge_app/output/pixel_query.h"
#include "edge_app/output/plane_json.h"
#include "edge_app/output/record_events.h"
#include "edge_app/output/scene_json.h"
#include "edge_app/output/scene_views_json.h"
#include "edge_app/output/service_metrics.h"
#include "edge_app/output/service_status.h"
#include "edge_app/output/targets_json.h"
#include "edge_app/record/record_format.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

ServerResponse json_response(const Json& body) {
  ServerResponse response;
  response.body = body.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  return response;
}

// 202: it was begun.
ServerResponse accepted_response(const Json& body) {
  ServerResponse response = json_response(body);
  response.status = 202;
  return response;
}

ServerResponse text_response(const char* type, std::string body) {
  ServerResponse response;
  response.type = type;
  response.body = std::move(body);
  return response;
}

ServerResponse orientation(const HttpApiSources& sources) {
  const auto newest = sources.live->newest();
  if (!newest) return http_error(404, "no record yet");
  return text_response("application/json", json_line(*newest));
}

ServerResponse history(const HttpApiSources& sources, const ServerRequest& request) {
  using Sample = const HistorySample&;
  struct Column {
    const char* name;
    Json (*value)(Sample);
  };
  static constexpr std::array<Column, 12> kColumns = {
      {{"time_s", [](Sample s) { return Json(s.time_s); }},
       {"mode", [](Sample s) { return Json(to_string(s.mode)); }},
       {"pan_rad", [](Sample s) { return or_null(s.pan_rad); }},
       {"tilt_rad", [](Sample s) { return or_null(s.tilt_rad); }},
       {"landmarks", [](Sample s) { return Json(s.landmarks); }},
       {"residual_px", [](Sample s) { return or_null(s.residual_px); }},
       {"latency_s", [](Sample s) { return or_null(s.latency_s); }},
       {"sigma_rad", [](Sample s) { return or_null(s.sigma_rad); }},
       {"clock_offset_s", [](Sample s) { return or_null(s.clock_offset_s); }},
       {"clock_offset_sigma_s", [](Sample s) { return or_null(s.clock_offset_sigma_s); }},
       {"pan_error_rad",
        [](Sample s) { return s.telemetry_error ? Json(s.telemetry_error->pan) : Json(); }},
       {"tilt_error_rad",
        [](Sample s) { return s.telemetry_error ? Json(s.telemetry_error->tilt) : Json(); }}}};
  const std::string span = request.parameter("span").value_or("minute");
  if (span != "minute" && span != "hour") return http_error(400, "span must be minute or hour");
  const auto samples = span == "hour" ? sources.live->hour() : sources.live->history();
  Json columns;
  for (const Column& column : kColumns) {
    Json values = Json::array();
    for (const HistorySample& sample : samples) values.push_back(column.value(sample));
    columns[column.name] = std::move(values);
  }
  return json_response(columns);
}

ServerResponse calibration(const HttpApiSources& sources) {
  const auto newest = sources.live->newest();
  if (!newest || !newest->calibrated)
    return http_error(
        404,
        "no calibration is in use for this camera at this zoom: there is none yet, or "
        "it was withdrawn; calibration.activity of /api/v1/status says which");
  const Calibration in_use = unpack(newest->camera);
  Json json = calibration_json(in_use);
  const double beyond_m = holds_beyond_m(sources.pupil, relative_focal_length_sigma(in_use));
  if (beyond_m > 0 && std::isfinite(beyond_m)) json["holds_beyond_m"] = beyond_m;
  if (const auto curve = zoom_curve_of(sources)) json["zoom_curve"] = zoom_curve_json(*curve);
  if (const auto error = sources.telemetry_error ? sources.telemetry_error() : nullptr) {
    json.update(telemetry_error_json(*error));
  }
  return json_response(json);
}

ServerResponse ground_plane(const HttpApiSources& sources) {
  if (!sources.plane)
    return http_error(
        404, "no plane is configured: set tracking.plane to a plane.yaml of alidade plane fit");
  return json_response(plane_json(*sources.plane));
}

ServerResponse plane_fit(const HttpApiSources& sources, const std::string& body) {
  std::string answer;
  std::string error;
  if (!sources.fit_plane(body, &answer, &error)) return http_error(400, error);
  return text_response("application/json", std::move(answer));
}

constexpr const char* kNoSceneMap =
    "no scene map is in use: set scene_map.file to one of alidade map build";

ServerResponse scene_views(const HttpApiSources& sources) {
  if (sources.scene_outlines == nullptr) return http_error(404, kNoSceneMap);
  return json_response(scene_views_json(*sources.scene_outlines));
}

ServerResponse scene_map(const HttpApiSources& sources) {
  if (!sources.scene) return http_error(404, kNoSceneMap);
  return json_response(scene_json(sources.scene(), monotonic_now_s()));
}

// A fresh calibration discards what the one before has gathered. So it may not be started more
// often than a calibration takes.
struct CalibrationPause {
  static constexpr double kPauseS = 120;
  std::mutex mutex;
  std::optional<double> began_s;
};

ServerResponse calibrate(const HttpApiSources& sources, CalibrationPause* pause) {
  const std::lock_guard<std::mutex> lock(pause->mutex);
  const double now_s = monotonic_now_s();
  const double since_s = now_s - pause->began_s.value_or(now_s);
  if (pause->began_s && since_s < CalibrationPause::kPauseS) {
    const double left_s = std::ceil(CalibrationPause::kPauseS - since_s);
    ServerResponse refusal = http_error(
        429, fmt::format("a fresh calibration was begun {:.0f} s ago; the next may be in {:.0f} s",
                         since_s, left_s));
    refusal.headers.emplace_back("Retry-After", fmt::format("{:.0f}", left_s));
    return refusal;
  }
  if (!sources.ask_for_calibration())
    return http_error(409,
                      "nothing is calibrated here: that needs mode OE, live video and "
                      "calibration.auto: true");
  pause->began_s = now_s;
  return accepted_response(
      {{"accepted", true},
       {"note", "move the camera; status says what it needs, and when it is done"}});
}

constexpr const char* kNothingStored =
    "nothing is stored here: set output.recordings to a directory";

ServerResponse begin_recording(const HttpApiSources& sources, const std::string& body) {
  constexpr int kDeepest = 1;  // {"duration_s": S}
  if (sources.recorder == nullptr) return http_error(409, kNothingStored);
  Json object;
  std::string error;
  if (!parse_json_object(body, kDeepest, {"duration_s"}, &object, &error))
    return http_error(400, error);
  const auto duration = object.find("duration_s");
  if (duration == object.end() || !duration->is_number())
    return http_error(400, "duration_s must be given as a number, s");
  switch (sources.recorder->begin(duration->get<double>(), &error)) {
    case LiveRecorder::Begin::kBegun:
      break;
    case LiveRecorder::Begin::kBadDuration:
      return http_error(400, error);
    case LiveRecorder::Begin::kUnderWay:
      return http_error(409, error);
    case LiveRecorder::Begin::kFailed:
      return http_error(507, error);
  }
  return accepted_response(recording_json(sources));
}

ServerResponse end_recording(const HttpApiSources& sources) {
  if (sources.recorder == nullptr) return http_error(409, kNothingStored);
  if (!sources.recorder->end()) return http_error(409, "no recording is under way");
  return json_response(recording_json(sources));
}

ServerResponse verify_recording(const HttpApiSources& sources) {
  if (sources.recorder == nullptr) return http_error(409, kNothingStored);
  const LiveRecording recording = sources.recorder->state();
  if (recording.under_way) return http_error(409, "a recording is under way; end it first");
  if (recording.frames == 0) return http_error(409, "there is no recording yet");
  if (!sources.verify_recording(recording.directory))
    return http_error(409, "a verification is under way");
  return accepted_response(recording_json(sources));
}

ServerResponse stream_ticket(HttpTickets* tickets) {
  return json_response(
      {{"ticket", tickets->issue(monotonic_now_s())}, {"valid_s", HttpTickets::kValidS}});
}

// Finds the record that a request asks for. False: *error says why there is none.
bool choose_record(const HttpApiSources& sources, const FrameChoice& which,
                   OrientationRecord* record, ServerResponse* error) {
  FrameSearch found = FrameSearch::kFound;
  if (which.frame) {
    found = sources.live->find(*which.frame, record);
  } else if (which.time_s) {
    found = sources.live->find_at(*which.time_s, record);
  } else if (const auto newest = sources.live->newest_oriented()) {
    *record = *newest;
  } else {
    found = FrameSearch::kNoneYet;
  }
  if (found != FrameSearch::kFound) {
    *error = http_error(404, found == FrameSearch::kNoneYet
                                 ? "no frame yet"
                                 : "no such frame among those of the last seconds, and "
                                   "those that are held");
    return false;
  }
  if (record->orientation) return true;
  *error = http_error(409, fmt::format("frame {} has no orientation: {}", *record->frame,
                                       to_string(record->status)));
  return false;
}

ServerResponse hold(const HttpApiSources& sources, const std::string& body) {
  constexpr int kDeepest = 1;  // {"frame": N}
  Json object;
  FrameChoice which;
  std::string error;
  if (!parse_json_object(body, kDeepest, {"frame", "time_s"}, &object, &error) ||
      !parse_frame_choice(object, &which, &error))
    return http_error(400, error);
  OrientationRecord record;
  ServerResponse refusal;
  if (!choose_record(sources, which, &record, &refusal)) return refusal;
  sources.live->hold(record);
  return text_response("application/json", json_line(record));
}

ServerResponse directions(const HttpApiSources& sources, const std::string& body) {
  DirectionQuery query;
  std::string error;
  if (!parse_direction_query(body, &query, &error)) return http_error(400, error);
  OrientationRecord record;
  ServerResponse refusal;
  if (!choose_record(sources, query.which, &record, &refusal)) return refusal;
  return text_response("application/json", direction_answer(record, query, sources.plane.get(),
                                                            sources.pupil, sources.scene_nearness));
}

ServerResponse pixels(const HttpApiSources& sources, const std::string& body) {
  PixelQuery query;
  std::string error;
  if (!parse_pixel_query(body, &query, &error)) return http_error(400, error);
  OrientationRecord record;
  ServerResponse refusal;
  if (!choose_record(sources, query.which, &record, &refusal)) return refusal;
  return text_response("application/json", pixel_answer(record, query));
}

constexpr const char* kNothingTracked =
    "nothing is tracked: add section tracking to the configuration";

int http_status_of(DetectionStatus status) {
  switch (status) {
    case DetectionStatus::kUnknownFrame:
    case DetectionStatus::kFrameNotYet:
      return 404;
    case DetectionStatus::kTooLate:
      return 410;
    case DetectionStatus::kNoOrientation:
    case DetectionStatus::kRepeated:
    case DetectionStatus::kNoGeometry:
      return 409;
    case DetectionStatus::kQueueFull:
      return 503;
    default:
      return 400;
  }
}

// Finds the record of the frame to which detections belong.
DetectionStatus find_detected(const LiveState& live, const FrameChoice& which,
                              OrientationRecord* record) {
  const auto newest = live.newest_oriented();
  const bool later = !newest || (which.frame ? *which.frame > newest->frame.value_or(-1)
                                             : *which.time_s > newest->time_s.value_or(0));
  const FrameSearch found =
      which.frame ? live.find(*which.frame, record) : live.find_at(*which.time_s, record);
  if (found != FrameSearch::kFound)
    return later ? DetectionStatus::kFrameNotYet : DetectionStatus::kUnknownFrame;
  return record->orientation ? DetectionStatus::kTaken : DetectionStatus::kNoOrientation;
}

ServerResponse detections(const HttpApiSources& sources, const std::string& body) {
  if (sources.targets == nullptr) return http_error(409, kNothingTracked);
  TargetFeed& feed = *sources.targets;
  DetectionQuery query;
  std::string error;
  if (!parse_detections(body, &query, &error)) {
    feed.count_refused(DetectionStatus::kMalformed);
    return http_error(400, error);
  }
  DetectedFrame frame;
  frame.boxes = std::move(query.boxes);
  const DetectionStatus found = find_detected(*sources.live, query.which, &frame.record);
  if (found != DetectionStatus::kTaken) {
    feed.count_refused(found);
    return http_error(http_status_of(found), to_string(found));
  }
  Json accepted{
      {"accepted", true}, {"frame", *frame.record.frame}, {"time_s", *frame.record.time_s}};
  const std::size_t boxes = frame.boxes.size();
  const DetectionAnswer answer = feed.offer(std::move(frame));
  accepted["boxes"] = boxes - answer.left_out.size();
  accepted["left_out"] = Json::array();
  for (const DetectionAnswer::LeftOut& one : answer.left_out)
    accepted["left_out"].push_back({{"box", one.box}, {"reason", to_string(one.fault)}});
  if (is_taken(answer.status)) return accepted_response(accepted);
  ServerResponse refusal = http_error(http_status_of(answer.status), to_string(answer.status));
  if (answer.status == DetectionStatus::kQueueFull)
    refusal.headers.emplace_back("Retry-After", "1");
  return refusal;
}

ServerResponse targets(const HttpApiSources& sources, const ServerRequest& request) {
  if (sources.targets == nullptr) return http_error(404, kNothingTracked);
  const TargetFeed::Snapshot snapshot = sources.targets->snapshot();
  const auto& state = snapshot.newest;
  TargetList list;
  list.space = sources.targets->options().tracker.space;
  const auto wanted = request.parameter("frame");
  OrientationRecord record;
  if (wanted) {
    const std::optional<std::int64_t> number = frame_number(*wanted);
    if (!number) return http_error(400, kFrameNumberRange);
    FrameChoice which;
    which.frame = number;
    ServerResponse refusal;
    if (!choose_record(sources, which, &record, &refusal)) return refusal;
  } else if (state) {
    record = state->record;
  }
  if (state) list = list_targets(*state, record);
  Json out = targets_json(list);
  out["detections"] = target_counters_json(snapshot.counters);
  out["detections"]["waiting"] = snapshot.waiting;
  return json_response(out);
}

}  // namespace

std::shared_ptr<const ZoomCurve> zoom_curve_of(const HttpApiSources& sources) {
  const auto curve = sources.zoom_curve ? sources.zoom_curve() : nullptr;
  return curve && !curve->empty() ? curve : nullptr;
}

void add_api_routes(HttpServer* server, const HttpApiSources& sources) {
  sources.live->add_on_news([server] { server->wake(); });
  if (sources.target_lines != nullptr)
    sources.target_lines->set_on_news([server] { server->wake(); });
  server->get("/healthz", HttpAccess::kOpen,
              [](const ServerRequest&) { return text_response("text/plain", "ok\n"); });
  server->get("/metrics", HttpAccess::kToken, [sources, server](const ServerRequest&) {
    return text_response("text/plain; version=0.0.4; charset=utf-8",
                         service_metrics(sources, server->counters()));
  });
  server->get("/api/v1/openapi.yaml", HttpAccess::kOpen, [](const ServerRequest&) {
    return text_response("application/yaml", openapi_text());
  });
  server->get("/api/v1/orientation", HttpAccess::kToken,
              [sources](const ServerRequest&) { return orientation(sources); });
  server->post("/api/v1/stream/ticket", HttpAccess::kToken, kMaxQueryBytes,
               [server](const ServerRequest&) { return stream_ticket(&server->tickets()); });
  server->get("/api/v1/stream", HttpAccess::kStream, [sources](const ServerRequest&) {
    ServerResponse response;
    response.type = "text/event-stream";
    response.headers.emplace_back("Cache-Control", "no-cache");
    response.stream =
        std::make_unique<RecordEvents>(sources.live, sources.target_lines, sources.version);
    return response;
  });
  server->get("/api/v1/status", HttpAccess::kToken, [sources, server](const ServerRequest&) {
    return json_response(service_status(sources, server->counters()));
  });
  server->get("/api/v1/history", HttpAccess::kToken,
              [sources](const ServerRequest& request) { return history(sources, request); });
  server->get("/api/v1/calibration", HttpAccess::kToken,
              [sources](const ServerRequest&) { return calibration(sources); });
  server->get("/api/v1/plane", HttpAccess::kToken,
              [sources](const ServerRequest&) { return ground_plane(sources); });
  server->post(
      "/api/v1/plane/fit", HttpAccess::kToken, kMaxQueryBytes,
      [sources](const ServerRequest& request) { return plane_fit(sources, request.body); });
  server->get("/api/v1/targets", HttpAccess::kToken,
              [sources](const ServerRequest& request) { return targets(sources, request); });
  server->post(
      "/api/v1/detections", HttpAccess::kControl, kMaxDetectionBytes,
      [sources](const ServerRequest& request) { return detections(sources, request.body); });
  server->get("/api/v1/map", HttpAccess::kToken,
              [sources](const ServerRequest&) { return scene_map(sources); });
  server->get("/api/v1/map/views", HttpAccess::kToken,
              [sources](const ServerRequest&) { return scene_views(sources); });
  server->post("/api/v1/calibrate", HttpAccess::kControl, kMaxQueryBytes,
               [sources, pause = std::make_shared<CalibrationPause>()](const ServerRequest&) {
                 return calibrate(sources, pause.get());
               });
  server->post(
      "/api/v1/recording", HttpAccess::kControl, kMaxQueryBytes,
      [sources](const ServerRequest& request) { return begin_recording(sources, request.body); });
  server->post("/api/v1/recording/end", HttpAccess::kControl, kMaxQueryBytes,
               [sources](const ServerRequest&) { return end_recording(sources); });
  server->post("/api/v1/recording/verify", HttpAccess::kControl, kMaxQueryBytes,
               [sources](const ServerRequest&) { return verify_recording(sources); });
  server->post("/api/v1/hold", HttpAccess::kToken, kMaxQueryBytes,
               [sources](const ServerRequest& request) { return hold(sources, request.body); });
  server->post(
      "/api/v1/direction", HttpAccess::kToken, kMaxQueryBytes,
      [sources](const ServerRequest& request) { return directions(sources, request.body); });
  server->post("/api/v1/pixel", HttpAccess::kToken, kMaxQueryBytes,
               [sources](const ServerRequest& request) { return pixels(sources, request.body); });
}

}  // namespace alidade
