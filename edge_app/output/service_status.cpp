#include "edge_app/output/service_status.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "edge_app/output/clock_pair.h"
#include "edge_app/output/or_null.h"
#include "edge_app/output/scene_json.h"
#include "edge_app/record/record_values.h"
#include "platform/system/clock.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

Json quantiles(const LatencyHistogram& histogram) {
  if (histogram.total() == 0) return nullptr;
  return {{"p50", histogram.quantile(0.5)},
          {"p90", histogram.quantile(0.9)},
          {"p99", histogram.quantile(0.99)},
          {"max", histogram.longest_s()}};
}

Json link_json(const LinkHealth& link) {
  return {{"connected", link.connected},
          {"reason", link.reason.empty() ? Json() : Json(link.reason)},
          {"reconnections", link.reconnections},
          {"age_s", or_null(link.age_s)},
          {"rate_hz", or_null(link.rate_hz)}};
}

Json link_delay_json(const PipelineSummary& summary, double now_s) {
  if (!summary.link_delay) return nullptr;
  return {{"state", to_string(summary.link_delay->state)},
          {"delay_s", summary.link_delay->delay_s},
          {"sigma_s", summary.link_delay->sigma_s},
          {"age_s", now_s - summary.link_delay_since_s}};
}

Json detectors_json(const DetectorsReport& report) {
  Json out{{"replaced", report.replaced}};
  for (const DetectorKindRow& row : kDetectorKinds) {
    const std::optional<DetectorCounters>& counters = report.counters[row.kind];
    out[row.name] = nullptr;
    if (counters) {
      out[row.name] = {{"pictures", counters->pictures},
                       {"unjudged", counters->unjudged},
                       {"boxes", counters->boxes}};
    }
  }
  return out;
}

Json coverage_json(const ViewCoverage& coverage) {
  Json pan;
  Json tilt;
  if (const auto& range = coverage.range) {
    pan = {range->least.pan, range->largest.pan};
    tilt = {range->least.tilt, range->largest.tilt};
  }
  Json path = Json::array();
  for (const PanTilt<double>& angle : coverage.path) path.push_back({angle.pan, angle.tilt});
  return {{"columns", ViewCoverage::kColumns},
          {"rows", ViewCoverage::kRows},
          {"points", coverage.points},
          {"pan_rad", std::move(pan)},
          {"tilt_rad", std::move(tilt)},
          {"path_rad", std::move(path)},
          {"largest_rate_rad_s", coverage.largest_rate}};
}

Json progress_json(const HttpApiSources& sources) {
  const auto progress = sources.calibration_progress ? sources.calibration_progress() : nullptr;
  if (!progress) return nullptr;
  Json parameters = Json::array();
  for (const ParameterGoal& goal : progress->goals) {
    parameters.push_back({{"name", to_string(goal.parameter)},
                          {"unit", goal.unit},
                          {"sigma", or_null(goal.sigma)},
                          {"wanted", goal.wanted},
                          {"reached", goal.reached},
                          {"helps", to_string(goal.helps)}});
  }
  return {{"attempts", progress->attempts},
          {"refusal", progress->refusal.empty() ? Json() : Json(progress->refusal)},
          {"parameters", std::move(parameters)},
          {"span_s", progress->span_s},
          {"least_range_rad", progress->travel.least},
          {"asked_range_rad", progress->travel.asked},
          {"coverage", coverage_json(progress->coverage)}};
}

}  // namespace

nlohmann::ordered_json service_status(const HttpApiSources& sources, const HttpCounters& http) {
  const PipelineSummary summary = sources.summary();
  const FrameSourceCounters losses = sources.video_losses();
  const auto newest = sources.live->newest();
  const double now_s = monotonic_now_s();
  Json out{{"alidade", sources.version},
           {"start", sources.live->start_id()},
           {"uptime_s", now_s - sources.live->started_s()},
           {"camera", sources.camera}};
  out["clock"] = clock_pair_json();
  const auto of_newest = [&newest](auto get) { return newest ? Json(get(*newest)) : Json(); };
  using Record = OrientationRecord;
  out["mode"] = of_newest([](const Record& r) { return to_string(r.mode); });
  out["status"] = of_newest([](const Record& r) { return to_string(r.status); });
  out["telemetry_age_s"] = of_newest([](const Record& r) { return or_null(r.telemetry_age_s); });
  out["zoom"] = of_newest([](const Record& r) { return or_null(r.zoom); });
  out["landmarks"] = of_newest([](const Record& r) { return r.landmarks; });
  out["image"] = {{"width", of_newest([](const Record& r) { return r.camera.width; })},
                  {"height", of_newest([](const Record& r) { return r.camera.height; })}};
  const auto since_s = sources.live->calibration_since_s();
  out["calibration"] = {
      {"calibrated", newest && newest->calibrated},
      {"activity", of_newest([](const Record& r) { return to_string(r.calibration.activity); })},
      {"needs", of_newest([](const Record& r) { return or_null(need_of(r)); })},
      {"age_s", since_s ? Json(now_s - *since_s) : Json()},
      {"progress", progress_json(sources)}};
  out["frames"] = {{"received", summary.frames},
                   {"records", summary.records},
                   {"oe", summary.with_landmarks},
                   {"pt", summary.with_orientation - summary.with_landmarks},
                   {"none", summary.records - summary.with_orientation},
                   {"repeated", summary.repeated},
                   {"damaged", losses.damaged},
                   {"not_fetched", losses.dropped}};
  out["video_faults"] = {{"unstamped", losses.unstamped},
                         {"foreign_packets", losses.foreign_packets},
                         {"garbage_bytes", losses.garbage_bytes}};
  out["reasons"] = Json::object();
  for (const RecordStatus status : kRecordStatuses) {
    if (summary.reasons.of(status) > 0)
      out["reasons"][to_string(status)] = summary.reasons.of(status);
  }
  out["links"] = {{"video", link_json(summary.video_link)},
                  {"pan_tilt", link_json(summary.pan_tilt_link)}};
  out["dropped"] = {{"frames", summary.drops.frames},
                    {"telemetry", summary.drops.telemetry},
                    {"records", summary.drops.records},
                    {"unheard", summary.drops.unheard},
                    {"late_pictures", summary.drops.late_images}};
  out["video_clock"] = {{"locked", newest && newest->clock_locked},
                        {"sigma_s", newest && newest->time_s ? Json(newest->time_sigma_s) : Json()},
                        {"restarts", summary.clock_restarts},
                        {"floor_shifts", summary.delay_steps},
                        {"wander_s", summary.delay_wander_s},
                        {"left_out_rate_error", or_null(summary.stamps_left_out)}};
  out["link_delay"] = link_delay_json(summary, now_s);
  out["latency_s"] = sources.latency_measured ? quantiles(summary.latency) : Json();
  if (sources.latency_measured) {
    out["stages_s"] = {{"decoding", quantiles(summary.decoding)},
                       {"waiting", quantiles(summary.waiting)},
                       {"computing", quantiles(summary.computing)},
                       {"writing", quantiles(summary.writing)}};
  } else {
    out["stages_s"] = nullptr;
  }
  out["detectors"] = sources.detectors ? detectors_json(sources.detectors()) : Json();
  out["scene_map"] = sources.scene ? scene_json(sources.scene(), now_s) : Json();
  out["recording"] = sources.recorder ? recording_json(sources) : Json();
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
  return out;
}

nlohmann::ordered_json recording_json(const HttpApiSources& sources) {
  const LiveRecording recording = sources.recorder->state();
  const RecordingVerification verification = sources.verification();
  return {{"under_way", recording.under_way},
          {"directory", or_null(recording.directory)},
          {"asked_s", recording.directory.empty() ? Json() : Json(recording.asked_s)},
          {"length_s", recording.length_s},
          {"frames", recording.frames},
          {"samples", recording.samples},
          {"left_out", recording.left_out},
          {"error", or_null(recording.error)},
          {"verification",
           {{"state", to_string(verification.state)},
            {"recording", or_null(verification.recording)},
            {"verdict", or_null(verification.verdict)},
            {"sentence", or_null(verification.sentence)},
            {"report", or_null(verification.report)},
            {"error", or_null(verification.error)}}}};
}

}  // namespace alidade
