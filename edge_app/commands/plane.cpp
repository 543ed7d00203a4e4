// `alidade plane fit`: makes plane.yaml from what is known of the ground under a camera. If the
// plane is not determined, or a datum contradicts it, that is reported and nothing is written.

#include "edge_app/commands/plane.h"
#include "core/calibration/number_text.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "core/ground/plane_fit.h"
#include "core/model/trigonometry.h"
#include "edge_app/commands/command.h"
#include "edge_app/config/plane_data.h"
#include "edge_app/output/json_query.h"
#include "edge_app/output/plane_json.h"
#include "edge_app/storage/plane_file.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

bool is_angle(int value) { return value < 3; }

// Limits of the work for one request. Each picture adds three unknowns.
constexpr std::size_t kMostDataOfRequest = 100;
constexpr std::size_t kMostPicturesOfRequest = 8;
constexpr int kDeepestDatum = 5;  // {"lengths": [{"from": {"direction": [x]}}]}
constexpr const char* kNoHeading =
    "the base's forward direction points straight up or down: plane.yaml cannot say its heading";

bool has_heading(const PlaneFit& fit) {
  return fit.plane.R_world_from_base().col(0).head<2>().norm() > kLeastForward;
}

// Without a heading the values have no finite covariance.
bool has_values(const PlaneFit& fit) {
  return (fit.status == PlaneFitStatus::kOk || fit.status == PlaneFitStatus::kMisfit) &&
         has_heading(fit);
}

std::string values_text(const PlaneFit& fit) {
  const PlaneValues values = plane_values(fit.plane);
  std::string text;
  for (int i = 0; i < kPlaneParameterCount; ++i) {
    const double unit = is_angle(i) ? 180 / kPi : 1;
    const double sigma = std::sqrt(values.covariance(i, i));
    text += fmt::format("  {:<8}{:>12} ", kPlaneValueNames[static_cast<std::size_t>(i)],
                        value_text(values.value[i] * unit, sigma * unit));
    text += sigma > 0
                ? fmt::format("± {} {}\n", sigma_text(sigma * unit), is_angle(i) ? "deg" : "m")
                : std::string("by definition\n");
  }
  return text;
}

std::string data_text(const PlaneEvidence& evidence, const PlaneFit& fit) {
  std::string text;
  for (std::size_t i = 0; i < fit.data.size(); ++i) {
    const PlaneDatum& datum = evidence.data[i];
    const DatumFit& fits = fit.data[i];
    text += fmt::format("  {:<16}{:<20}", to_string(datum.kind), datum.name);
    text += fits.misfit ? fmt::format("{:>7.2f} sigmas, checked to {:.0f} %", *fits.misfit,
                                      100 * fits.checked)
                        : std::string("nothing else checks it");
    text += static_cast<int>(i) == fit.worst ? "  <- does not fit\n" : "\n";
  }
  return text;
}

std::string text_of(const PlaneEvidence& evidence, const PlaneFit& fit) {
  std::string text = values_text(fit);
  text += fmt::format("{} data, {} more equations than unknowns", evidence.data.size(),
                      fit.degrees_of_freedom);
  if (fit.degrees_of_freedom > 0)
    text += fmt::format("; residuals are {:.2f} times what their sigmas predict", fit.noise_scale);
  text += "; misfits:\n" + data_text(evidence, fit);
  if (fit.origin_below_camera)
    text += "the camera's place is not given: x and y are measured from the point below it\n";
  if (fit.heading_of_base)
    text += "the direction of north is not given: y points along the base's forward direction\n";
  return text;
}

void print_plane(const std::string& text) {
  std::fputs(text.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
}

// The result must not overwrite the data.
std::string output_path(const PlaneOptions& options) {
  namespace fs = std::filesystem;
  const fs::path path = options.output.empty() ? fs::path(options.data).parent_path() / "plane.yaml"
                                               : fs::path(options.output);
  std::error_code error;
  if (fs::equivalent(path, options.data, error)) {
    throw CommandError(kExitUsage,
                       path.string() + ": is the data file itself; give another file with -o");
  }
  return path.string();
}

}  // namespace

int fit_plane_command(const PlaneOptions& options) {
  PlaneData data;
  std::string error;
  if (!load_plane_data(options.data, &data, &error)) throw CommandError(kExitUsage, error);
  const std::string path = output_path(options);
  const PlaneFit fit = fit_plane(data.evidence);
  const bool fits = fit.status == PlaneFitStatus::kOk;
  if (fits && !has_heading(fit)) throw CommandError(kExitFailed, options.data + ": " + kNoHeading);
  if (has_values(fit))
    print_plane(options.json ? plane_fit_json(data.evidence, fit).dump() + "\n"
                             : text_of(data.evidence, fit));
  if (!fits) throw CommandError(kExitFailed, options.data + ": " + fit.message);
  if (!write_file_atomically(path, format_plane({fit.plane, data.origin}, fit), &error))
    throw CommandError(kExitFailed, error + "; give a file that can be written with -o");
  spdlog::info("plane: {}", path);
  return kExitOk;
}

bool answer_plane_fit(const std::string& body, std::string* answer, std::string* error) {
  using Json = nlohmann::ordered_json;
  static const std::set<std::string> kKeys = {
      "format",  "origin",   "height",    "level",   "heading",  "place", "points",
      "horizon", "bearings", "verticals", "lengths", "uprights", "image", "pictures"};
  Json object;
  // JSON is YAML, so the YAML reader takes it. The depth is limited before that.
  if (!parse_json_object(body, kDeepestDatum, kKeys, &object, error)) return false;
  PlaneData data;
  if (!parse_plane_data(object.dump(), "body", &data, error)) return false;
  if (data.evidence.data.size() > kMostDataOfRequest) {
    *error =
        fmt::format("{} data; expected at most {}", data.evidence.data.size(), kMostDataOfRequest);
    return false;
  }
  if (data.evidence.looks.size() > kMostPicturesOfRequest) {
    *error = fmt::format("pictures: {}; expected at most {}", data.evidence.looks.size(),
                         kMostPicturesOfRequest);
    return false;
  }
  const PlaneFit fit = fit_plane(data.evidence);
  const bool fits = fit.status == PlaneFitStatus::kOk;
  const bool has_file = fits && has_heading(fit);
  Json out;
  if (has_values(fit)) {
    out = plane_fit_json(data.evidence, fit);
  } else {
    out["status"] = fits ? "no heading" : to_string(fit.status);
  }
  out["message"] = fits && !has_file ? kNoHeading : fit.message;
  out["plane_yaml"] = nullptr;
  if (has_file) out["plane_yaml"] = format_plane({fit.plane, data.origin}, fit);
  *answer = out.dump(-1, ' ', false, Json::error_handler_t::replace) + "\n";
  return true;
}

}  // namespace alidade
