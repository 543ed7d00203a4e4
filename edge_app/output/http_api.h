#pragma once
// The endpoints of `alidade run`, as openapi.yaml describes them: what the LiveState and the pipeline know, as
// JSON, Server-Sent Events and Prometheus text. Handlers run on the server's threads; nothing here reaches the
// real-time thread.

#include <functional>
#include <memory>
#include <string>

#include "core/ground/plane_estimate.h"
#include "edge_app/output/http/http_server.h"
#include "edge_app/output/live_state.h"
#include "edge_app/output/mqtt_publisher.h"
#include "edge_app/output/target_lines.h"
#include "edge_app/pipeline/pipeline.h"
#include "edge_app/step/scene_report.h"
#include "edge_app/tracking/built_in_detectors.h"
#include "edge_app/tracking/target_feed.h"
#include "platform/video/frame_source.h"

namespace alidade {

struct HttpApiSources {
  LiveState* live = nullptr;
  std::function<PipelineSummary()> summary;
  std::function<FrameSourceCounters()> video_losses;
  // False: nothing is calibrated here.
  std::function<bool()> ask_for_calibration;
  // Empty without one. The zoom curve in use; null: there is none.
  std::function<std::shared_ptr<const ZoomCurve>()> zoom_curve;
  std::shared_ptr<const PlaneEstimate> plane;  // null: none is configured
  // What is known of the ground to a fit, both JSON; false with one line.
  std::function<bool(const std::string& body, std::string* answer, std::string* error)> fit_plane;
  // Both null where nothing is tracked. Borrowed as live is; where there are some, they wake the server, too.
  TargetFeed* targets = nullptr;
  TargetLines* target_lines = nullptr;
  std::function<DetectorsReport()> detectors;  // empty: none is built in
  const MqttPublisher* mqtt = nullptr;         // null: no broker is told
  std::function<SceneReport()> scene;          // empty: no scene map is in use
  std::string version;
  std::string camera;            // the video source's name, without a password
  bool latency_measured = true;  // false for a recording
};

// Null: there is none.
[[nodiscard]] std::shared_ptr<const ZoomCurve> zoom_curve_of(const HttpApiSources& sources);

// Borrows *sources.live, and calls the functions, until the server has stopped. Every record wakes the server: that must
// exist as long as there are records, stopped or not.
void add_api_routes(HttpServer* server, const HttpApiSources& sources);

}  // namespace alidade
