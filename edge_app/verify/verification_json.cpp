#include "edge_app/verify/verification_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "core/model/angle.h"
#include "edge_app/verify/verification_words.h"

namespace alidade {
namespace {

using nlohmann::ordered_json;

constexpr double kInDegrees = 180 / kPi;

ordered_json to_json(const ClaimComparison& comparison) {
  const ClaimResult& r = comparison.result;
  ordered_json json;
  json["returns"] = name_of(comparison.kind);
  json["mode"] = mode_of(comparison.from);
  json["verdict"] = to_string(comparison.verdict);
  json["pairs"] = r.pairs;
  json["frames"] = r.frames;
  json["independent_numbers"] = r.freedom;
  json["rms_px"] = r.rms_px;
  json["rms_deg"] = r.rms_deg;
  json["claimed_px"] = r.claimed_px;
  json["ratio"] = r.ratio;
  json["ratio_95"] = {r.low, r.high};
  json["chance"] = std::exp(r.log_chance);
  json["sentence"] = comparison.sentence;
  return json;
}

ordered_json to_json(const DepartureTest& test) {
  ordered_json json;
  json["departure"] = name_of(test.departure);
  json["chi_square"] = test.chi_square;
  json["freedom"] = test.freedom;
  json["chance"] = std::exp(test.log_chance);
  json["log_chance"] = test.log_chance;
  json["noise_scatter"] = test.scatter;
  json["size"] = test.size;
  json["sigma"] = test.sigma;
  if (!test.at.empty()) json["at"] = test.at;
  if (test.claimed_sigma > 0) json["claimed_sigma"] = test.claimed_sigma;
  return json;
}

ordered_json to_json(const KnownOffset& offset) {
  ordered_json json;
  json["frame"] = offset.known.frame;
  json["u_px"] = offset.known.pixel.x();
  json["v_px"] = offset.known.pixel.y();
  json["off_px"] = {offset.off_px.x(), offset.off_px.y()};
  json["claimed_px"] = offset.claimed_px;
  if (offset.known.azimuth) {
    json["right_deg"] = kInDegrees * offset.off.x();
    json["right_sigma_deg"] = kInDegrees * offset.sigma.x();
  }
  json["up_deg"] = kInDegrees * offset.off.y();
  json["up_sigma_deg"] = kInDegrees * offset.sigma.y();
  json["sigmas"] = offset.sigmas;
  return json;
}

// Axes that are taken as stated have a sigma of 0.
void add_turn(const KnownResult& result, ordered_json* json) {
  (*json)["turn_deg"] = ordered_json::array();
  (*json)["turn_sigma_deg"] = ordered_json::array();
  for (int axis = 0; axis < 3; ++axis) {
    (*json)["turn_deg"].push_back(kInDegrees * result.turn[axis]);
    (*json)["turn_sigma_deg"].push_back(kInDegrees * result.turn_sigma[axis]);
  }
}

ordered_json to_json(const KnownComparison& comparison) {
  const KnownResult& r = comparison.result;
  ordered_json json;
  json["mode"] = mode_of(comparison.from);
  json["verdict"] = to_string(comparison.verdict);
  json["directions"] = r.offsets.size();
  json["rms_px"] = r.rms_px;
  json["rms_deg"] = kInDegrees * r.rms;
  json["claimed_px"] = r.claimed_px;
  if (r.is_determined) {
    json["independent_numbers"] = r.freedom;
    json["ratio"] = r.ratio;
    json["chance"] = std::exp(r.log_chance);
    json["camera_share"] = r.share;
    add_turn(r, &json);
  }
  if (comparison.turned) {
    json["turned"]["ratio"] = comparison.turned->ratio;
    json["turned"]["chance"] = std::exp(comparison.turned->log_chance);
    add_turn(*comparison.turned, &json["turned"]);
  }
  json["sentence"] = comparison.sentence;
  json["offsets"] = ordered_json::array();
  for (const KnownOffset& each : r.offsets) json["offsets"].push_back(to_json(each));
  return json;
}

}  // namespace

std::string verification_json(const Verification& verification,
                              const std::vector<std::pair<std::string, std::string>>& files) {
  ordered_json json;
  json["verdict"] = to_string(verification.verdict);
  json["sentence"] = verification.sentence;
  json["advice"] = verification.advice;
  json["pairs"] = verification.pairs;
  json["places"] = verification.places;
  json["picture_noise_ratio"] = verification.noise_ratio;
  json["chance_limit"] = verification.chance_limit;
  if (const auto& link = verification.link)
    json["link"] = {{"delay_s", link->delay_s}, {"sigma_s", link->sigma_s}};
  if (const auto& zooms = verification.zooms) {
    json["zooms"] = {{"least_px", zooms->least_px},
                     {"most_px", zooms->most_px},
                     {"model_px", zooms->usual_px},
                     {"model_frames", zooms->usual_frames}};
  }
  json["returns"] = ordered_json::array();
  for (const ClaimComparison& claim : verification.claims)
    json["returns"].push_back(to_json(claim));
  json["model"] = ordered_json::array();
  for (const ModelComparison& comparison : verification.model) {
    ordered_json each = to_json(comparison.test);
    each["verdict"] = to_string(comparison.verdict);
    each["sentence"] = comparison.sentence;
    json["model"].push_back(std::move(each));
  }
  json["known"] = ordered_json::array();
  for (const KnownComparison& known : verification.known) json["known"].push_back(to_json(known));
  json["causes"] = ordered_json::array();
  for (const DepartureTest& found : verification.found) json["causes"].push_back(to_json(found));
  for (const auto& [kind, path] : files) json["files"][kind] = path;
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace alidade
