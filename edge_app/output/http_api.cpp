#include "edge_app/output/http_api.h"

#include <fmt/format.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "edge_app/output/calibration_json.h"
#include "edge_app/output/metrics.h"
#include "edge_app/output/openapi.h"
#include "edge_app/output/pixel_query.h"
#include "edge_app/output/record_format.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kClockEvery = 5;      // s, between two `clock` events
constexpr double kKeepAliveEvery = 3;  // s without anything else to say

ServerResponse json_response(const Json& body) {
  ServerResponse response;
  response.body = body.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  return response;
}

ServerResponse text_response(const char* type, std::string body) {
  ServerResponse response;
  response.type = type;
  response.body = std::move(body);
  return response;
}

template <typename T>
Json or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

// Wall clock and host clock at one instant, as near as their reads lie together.
struct ClockPair {
  double monotonic_s = 0;
  double wall_s = 0;
  double bracket_s = std::numeric_limits<double>::infinity();
};

ClockPair read_clocks() {
  constexpr int kTries = 5;
  ClockPair best;
  for (int i = 0; i < kTries; ++i) {
    const double before_s = monotonic_now_s();
    timespec wall{};
    ::clock_gettime(CLOCK_REALTIME, &wall);
    const double after_s = monotonic_now_s();
    if (after_s - before_s >= best.bracket_s) continue;
    best = {(before_s + after_s) / 2,
            static_cast<double>(wall.tv_sec) + 1e-9 * static_cast<double>(wall.tv_nsec),
            after_s - before_s};
  }
  return best;
}

void add_clocks(Json* object) {
  const ClockPair clocks = read_clocks();
  (*object)["monotonic_s"] = clocks.monotonic_s;
  (*object)["wall_s"] = clocks.wall_s;
  (*object)["bracket_s"] = clocks.bracket_s;
}

std::string event(const char* name, const std::string& data) {
  return std::string("event: ") + name + "\ndata: " + data + "\n\n";
}

// One client of the stream, until it is gone or the server stops.
void follow(const HttpApiSources& sources, HttpStream& out) {
  LiveState::Reader reader(sources.live);
  Json hello{{"alidade", sources.version}, {"start", sources.live->start_id()}};
  add_clocks(&hello);
  if (!out.write(event("hello", hello.dump()))) return;
  double clock_due_s = 0;  // the first at once
  while (true) {
    if (monotonic_now_s() >= clock_due_s) {
      Json clock;
      add_clocks(&clock);
      if (!out.write(event("clock", clock.dump()))) return;
      clock_due_s = monotonic_now_s() + kClockEvery;
    }
    const LiveState::News news = reader.wait(kKeepAliveEvery);
    if (news.closed) return;
    std::string text;
    if (news.lost > 0) text += event("lost", Json{{"records", news.lost}}.dump());
    for (const LiveState::News::Line& line : news.lines)
      text += "id: " + std::to_string(line.id) + "\n" + event("orientation", *line.json);
    if (text.empty()) text = ": keep-alive\n\n";
    if (!out.write(text)) return;
  }
}

ServerResponse orientation(const HttpApiSources& sources) {
  const auto newest = sources.live->newest();
  if (!newest) return http_error(404, "no record yet");
  return text_response("application/json", json_line(*newest));
}

ServerResponse history(const HttpApiSources& sources) {
  Json columns;
  for (const char* name :
       {"time_s", "mode", "pan_rad", "tilt_rad", "landmarks", "residual_px", "latency_s"})
    columns[name] = Json::array();
  for (const HistorySample& sample : sources.live->history()) {
    columns["time_s"].push_back(sample.time_s);
    columns["mode"].push_back(to_string(sample.mode));
    columns["pan_rad"].push_back(or_null(sample.pan_rad));
    columns["tilt_rad"].push_back(or_null(sample.tilt_rad));
    columns["landmarks"].push_back(sample.landmarks);
    columns["residual_px"].push_back(or_null(sample.residual_px));
    columns["latency_s"].push_back(or_null(sample.latency_s));
  }
  return json_response(columns);
}

ServerResponse calibration(const HttpApiSources& sources) {
  const auto newest = sources.live->newest();
  if (!newest || !newest->calibrated)
    return http_error(404, "there is no calibration for this camera at this zoom yet");
  return json_response(calibration_json(unpack(newest->camera)));
}

ServerResponse calibrate(const HttpApiSources& sources) {
  if (!sources.ask_for_calibration())
    return http_error(409,
                      "nothing is calibrated here: that needs mode OE, live video and "
                      "calibration.auto: true");
  ServerResponse response =
      json_response({{"accepted", true},
                     {"note", "move the camera; status says what it needs, and when it is done"}});
  response.status = 202;
  return response;
}

// The record that a request is about. False: *error says why there is none.
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
                                 : "no such frame among those of the last seconds");
    return false;
  }
  if (record->orientation) return true;
  *error = http_error(409, fmt::format("frame {} has no orientation: {}", *record->frame,
                                       to_string(record->status)));
  return false;
}

ServerResponse directions(const HttpApiSources& sources, const std::string& body) {
  DirectionQuery query;
  std::string error;
  if (!parse_direction_query(body, &query, &error)) return http_error(400, error);
  OrientationRecord record;
  ServerResponse refusal;
  if (!choose_record(sources, query.which, &record, &refusal)) return refusal;
  return text_response("application/json", direction_answer(record, query));
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

Json quantiles(const LatencyHistogram& histogram) {
  if (histogram.total() == 0) return nullptr;
  return {{"p50", histogram.quantile(0.5)},
          {"p90", histogram.quantile(0.9)},
          {"p99", histogram.quantile(0.99)},
          {"max", histogram.longest_s()}};
}

ServerResponse status(const HttpApiSources& sources, const HttpServer& server) {
  const PipelineSummary summary = sources.summary();
  const FrameSourceCounters losses = sources.video_losses();
  const HttpCounters http = server.counters();
  const auto newest = sources.live->newest();
  const double now_s = monotonic_now_s();
  Json out{{"alidade", sources.version},
           {"start", sources.live->start_id()},
           {"uptime_s", now_s - sources.live->started_s()},
           {"camera", sources.camera}};
  add_clocks(&out["clock"]);
  const auto of_newest = [&newest](auto get) { return newest ? Json(get(*newest)) : Json(); };
  using Record = OrientationRecord;
  out["mode"] = of_newest([](const Record& r) { return to_string(r.mode); });
  out["status"] = of_newest([](const Record& r) { return to_string(r.status); });
  out["telemetry_age_s"] = of_newest([](const Record& r) { return or_null(r.telemetry_age_s); });
  out["landmarks"] = of_newest([](const Record& r) { return r.landmarks; });
  out["image"] = {{"width", of_newest([](const Record& r) { return r.camera.width; })},
                  {"height", of_newest([](const Record& r) { return r.camera.height; })}};
  const auto since_s = sources.live->calibration_since_s();
  out["calibration"] = {
      {"calibrated", newest && newest->calibrated},
      {"activity", of_newest([](const Record& r) { return to_string(r.calibration.activity); })},
      {"needs", newest && newest->calibration.need != CalibrationNeed::kNothing
                    ? Json(to_string(newest->calibration.need))
                    : Json()},
      {"age_s", since_s ? Json(now_s - *since_s) : Json()}};
  out["frames"] = {{"received", summary.frames},
                   {"records", summary.records},
                   {"oe", summary.with_landmarks},
                   {"pt", summary.with_orientation - summary.with_landmarks},
                   {"none", summary.records - summary.with_orientation},
                   {"damaged", losses.damaged},
                   {"not_fetched", losses.dropped}};
  out["dropped"] = {{"frames", summary.drops.frames},
                    {"telemetry", summary.drops.telemetry},
                    {"records", summary.drops.records},
                    {"unheard", summary.drops.unheard},
                    {"late_pictures", summary.drops.late_pictures}};
  out["video_clock"] = {{"locked", newest && newest->clock_locked},
                        {"sigma_s", newest && newest->time_s ? Json(newest->time_sigma_s) : Json()},
                        {"restarts", summary.clock_restarts},
                        {"floor_shifts", summary.floor_shifts}};
  out["latency_s"] = sources.latency_measured ? quantiles(summary.latency) : Json();
  if (sources.latency_measured) {
    out["stages_s"] = {{"decoding", quantiles(summary.decoding)},
                       {"waiting", quantiles(summary.waiting)},
                       {"computing", quantiles(summary.computing)},
                       {"writing", quantiles(summary.writing)}};
  } else {
    out["stages_s"] = nullptr;
  }
  out["page_faults"] = {{"minor", summary.page_faults.minor}, {"major", summary.page_faults.major}};
  Json clients = Json::array();
  for (const ReaderCounters& reader : sources.live->readers())
    clients.push_back({{"records", reader.records}, {"lost", reader.lost}});
  out["streams"] = {{"clients", std::move(clients)},
                    {"lost_records", sources.live->lost_by_readers()}};
  out["http"] = {{"requests", http.requests},
                 {"refused", http.refused},
                 {"unauthorized", http.unauthorized},
                 {"stalled", http.stalled},
                 {"connections", http.connections}};
  return json_response(out);
}

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
    return std::sqrt(calibration.covariance(index(parameter), index(parameter)));
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
               "How far the newest frame lies beyond the newest telemetry sample");
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

ServerResponse metrics(const HttpApiSources& sources, const HttpServer& server) {
  const PipelineSummary summary = sources.summary();
  const FrameSourceCounters losses = sources.video_losses();
  const HttpCounters http = server.counters();
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
  out.counter("alidade_frames_lost_total", "Frames lost before they were read, by reason");
  out.add(losses.damaged, {{"reason", "damaged"}});
  out.add(losses.dropped, {{"reason", "not_fetched"}});
  out.counter("alidade_queue_dropped_total",
              "Messages lost to full queues; those to the calibration cost no record");
  out.add(summary.drops.frames, {{"queue", "frames"}});
  out.add(summary.drops.telemetry, {{"queue", "telemetry"}});
  out.add(summary.drops.records, {{"queue", "records"}});
  out.add(summary.drops.unheard, {{"queue", "calibration"}});
  out.counter("alidade_late_pictures_total",
              "Pictures not looked at, so that the frames behind them need not wait");
  out.add(summary.drops.late_pictures);
  out.counter("alidade_video_clock_restarts_total", "Starts of the video's clock filter anew");
  out.add(summary.clock_restarts);
  out.counter("alidade_video_clock_floor_shifts_total", "Steps of the video's least delay");
  out.add(summary.floor_shifts);
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
  }
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
  return text_response("text/plain; version=0.0.4; charset=utf-8", out.text());
}

}  // namespace

void add_api_routes(HttpServer* server, const HttpApiSources& sources) {
  server->get("/healthz", HttpAccess::kOpen,
              [](const ServerRequest&) { return text_response("text/plain", "ok\n"); });
  server->get("/metrics", HttpAccess::kToken,
              [sources, server](const ServerRequest&) { return metrics(sources, *server); });
  server->get("/api/v1/openapi.yaml", HttpAccess::kOpen,
              [](const ServerRequest&) { return text_response("application/yaml", kOpenApi); });
  server->get("/api/v1/orientation", HttpAccess::kToken,
              [sources](const ServerRequest&) { return orientation(sources); });
  server->get("/api/v1/stream", HttpAccess::kToken, [sources](const ServerRequest&) {
    ServerResponse response;
    response.type = "text/event-stream";
    response.headers.emplace_back("Cache-Control", "no-cache");
    response.stream = [sources](HttpStream& out) { follow(sources, out); };
    return response;
  });
  server->get("/api/v1/status", HttpAccess::kToken,
              [sources, server](const ServerRequest&) { return status(sources, *server); });
  server->get("/api/v1/history", HttpAccess::kToken,
              [sources](const ServerRequest&) { return history(sources); });
  server->get("/api/v1/calibration", HttpAccess::kToken,
              [sources](const ServerRequest&) { return calibration(sources); });
  server->post("/api/v1/calibrate", HttpAccess::kToken, kMaxQueryBytes,
               [sources](const ServerRequest&) { return calibrate(sources); });
  server->post(
      "/api/v1/direction", HttpAccess::kToken, kMaxQueryBytes,
      [sources](const ServerRequest& request) { return directions(sources, request.body); });
  server->post("/api/v1/pixel", HttpAccess::kToken, kMaxQueryBytes,
               [sources](const ServerRequest& request) { return pixels(sources, request.body); });
}

}  // namespace alidade
