#pragma once
// The HTTP endpoints of `alidade run`, described by openapi.yaml. They give the data of LiveState
// and pipeline as JSON, Server-Sent Events and Prometheus text, and take detections, held frames,
// plane fits and requests for a calibration or a recording. Handlers run on the server's threads.
// Nothing here touches the real-time thread.

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/ground/plane_estimate.h"
#include "core/model/pupil.h"
#include "edge_app/output/http/http_server.h"
#include "edge_app/output/live_state.h"
#include "edge_app/output/mqtt_publisher.h"
#include "edge_app/output/recording_verification.h"
#include "edge_app/output/target_lines.h"
#include "edge_app/pipeline/pipeline.h"
#include "edge_app/step/scene_report.h"
#include "edge_app/taps/live_recorder.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct HttpApiSources {
  LiveState* live = nullptr;
  std::function<PipelineSummary()> summary;
  std::function<FrameSourceCounters()> video_losses;
  // Starts a fresh calibration. False: this program does not calibrate, as that needs mode OE, live
  // video and calibration.auto.
  std::function<bool()> ask_for_calibration;
  // The zoom curve in use; returns null if there is none. May be an empty function.
  std::function<std::shared_ptr<const ZoomCurve>()> zoom_curve;
  // The errors by which the telemetry is corrected; may return null, and may be an empty function.
  std::function<std::shared_ptr<const TelemetryError>()> telemetry_error;
  // How far a first or fresh calibration is; may return null, and may be an empty function.
  std::function<std::shared_ptr<const CalibrationProgress>()> calibration_progress;
  std::shared_ptr<const PlaneEstimate> plane;  // null: none is configured
  // For directions of things at a distance (pixel_query.h): the lens's pupil, and scene_nearness()
  // of the scene from which the calibration is made; 0: no scene is configured.
  Pupil pupil;
  double scene_nearness = 0;
  // Fits the ground plane. body and *answer are JSON; false with one line in *error.
  std::function<bool(const std::string& body, std::string* answer, std::string* error)> fit_plane;
  // Both null if nothing is tracked. Both must live as long as `live`.
  TargetFeed* targets = nullptr;
  TargetLines* target_lines = nullptr;
  std::function<DetectorsReport()> detectors;  // empty: no built-in detector
  const MqttPublisher* mqtt = nullptr;         // null: no broker
  LiveRecorder* recorder = nullptr;            // null: nothing is stored on request
  // Both set if recorder is. verify_recording: begins to verify a recording; false: another
  // verification is under way.
  std::function<bool(const std::string& recording)> verify_recording;
  std::function<RecordingVerification()> verification;
  std::function<SceneReport()> scene;  // empty: no scene map is in use
  // What the scene map's keyframes show; null: no scene map is in use.
  const std::vector<SceneOutline>* scene_outlines = nullptr;
  std::string version;
  std::string camera;            // name of the video source, without a password
  bool latency_measured = true;  // false for a recording
};

// The zoom curve in use. Null: there is none.
[[nodiscard]] std::shared_ptr<const ZoomCurve> zoom_curve_of(const HttpApiSources& sources);

// `live` must not be null. `live` and the functions are used on the server's threads, several at a
// time, until the server has stopped. Functions must be set unless they "may be empty". Every
// record wakes the server, and so does every line of target_lines, whose on_news is replaced. So
// call this before the first record and the first line. The server must exist as long as records or
// lines come, even after it has stopped.
void add_api_routes(HttpServer* server, const HttpApiSources& sources);

}  // namespace alidade
