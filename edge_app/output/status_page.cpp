#include "edge_app/output/status_page.h"

#include <chrono>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "edge_app/output/json_query.h"
#include "edge_app/taps/small_image.h"

namespace alidade {
namespace {

using Json = nlohmann::ordered_json;

// Long enough for the next frame of a slow camera.
constexpr double kPatienceS = 1;
constexpr std::chrono::milliseconds kWithoutWaiting{0};

ServerResponse no_image() {
  return http_error(503, "no picture: the video is away, or none is decoded (realtime.mode: PT)");
}

ServerResponse page() {
  return http_page("text/html; charset=utf-8", status_page_text(), kStatusPagePolicy);
}

std::optional<ServerResponse> image(ImageTap* tap, const ServerRequest& request) {
  const auto image = tap->ask(kWithoutWaiting);
  if (image == nullptr && request.waited_s < kPatienceS) return std::nullopt;
  if (image == nullptr || image->jpeg.empty()) return no_image();
  ServerResponse response;
  response.type = "image/jpeg";
  response.body = image->jpeg;
  response.headers = {{"X-Alidade-Frame", std::to_string(image->frame)},
                      {"Cache-Control", "no-store"}};
  return response;
}

std::optional<ServerResponse> overlay(ImageTap* tap, const ServerRequest& request) {
  std::shared_ptr<const LiveImage> image;
  if (const auto wanted = request.parameter("frame")) {
    const std::optional<std::int64_t> number = frame_number(*wanted);
    if (!number) return http_error(400, kFrameNumberRange);
    image = tap->of_frame(*number);
    if (image == nullptr)
      return http_error(404, "that frame is not among the last that were shown");
  } else {
    image = tap->ask(kWithoutWaiting);
    if (image == nullptr && request.waited_s < kPatienceS) return std::nullopt;
    if (image == nullptr) return no_image();
  }
  ServerResponse response;
  response.body = overlay_json(*image);
  response.headers = {{"Cache-Control", "no-store"}};
  return response;
}

// Rounds to a thousandth of a pixel.
double rounded(float px) { return std::round(1000.0 * px) / 1000; }

}  // namespace

std::string overlay_json(const LiveImage& image) {
  Json landmarks = Json::array();
  Json points = Json::array();
  for (int i = 0; i < image.landmarks.count; ++i) {
    const FramePoint& found = image.landmarks.found[static_cast<std::size_t>(i)];
    if (image.landmarks.kind == FrameLandmarks::Kind::kPoints) {
      points.push_back({rounded(found.u_px), rounded(found.v_px)});
    } else {
      landmarks.push_back({{"u", rounded(found.u_px)},
                           {"v", rounded(found.v_px)},
                           {"du", rounded(found.du_px)},
                           {"dv", rounded(found.dv_px)},
                           {"used", found.inlier}});
    }
  }
  const Json object{{"frame", image.frame},
                    {"width", image.width},
                    {"height", image.height},
                    {"scale", shrinking_factor(image.width, ImageTap::kMaxWidth)},
                    {"landmarks", std::move(landmarks)},
                    {"points", std::move(points)}};
  return object.dump() + "\n";
}

void add_status_page(HttpServer* server, ImageTap* tap) {
  server->get("/", HttpAccess::kOpen, [](const ServerRequest&) { return page(); });
  server->get("/api/v1/picture", HttpAccess::kToken,
              [tap](const ServerRequest& request) { return image(tap, request); });
  server->get("/api/v1/overlay", HttpAccess::kToken,
              [tap](const ServerRequest& request) { return overlay(tap, request); });
}

}  // namespace alidade
