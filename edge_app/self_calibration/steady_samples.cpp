#include "edge_app/self_calibration/steady_samples.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>

#include "core/model/median.h"
#include "core/model/steady_zoom.h"

namespace alidade {
namespace {

bool has_zoom(const PanTiltSample& sample) { return sample.zoom && std::isfinite(*sample.zoom); }

// Replaces a movement from one level to another by the nearest sequence that never turns back.
// Leaves it as it is if it turns back by more than jitter.
void steady_movement(double from, double to, double most,
                     const std::vector<PanTiltSample*>& moving) {
  const double sign = to > from ? 1 : -1;
  struct Block {
    double mean;
    std::size_t size;
  };
  std::vector<Block> blocks;
  for (const PanTiltSample* sample : moving) {
    blocks.push_back({sign * *sample->zoom, 1});
    while (blocks.size() > 1 && blocks[blocks.size() - 2].mean > blocks.back().mean) {
      const Block last = blocks.back();
      blocks.pop_back();
      Block& into = blocks.back();
      const auto size = static_cast<double>(into.size + last.size);
      into.mean += (last.mean - into.mean) * static_cast<double>(last.size) / size;
      into.size += last.size;
    }
  }
  std::vector<double> steady;
  for (const Block& block : blocks)
    steady.insert(steady.end(), block.size,
                  std::clamp(sign * block.mean, std::min(from, to), std::max(from, to)));
  for (std::size_t i = 0; i < moving.size(); ++i) {
    if (std::abs(*moving[i]->zoom - steady[i]) > most) return;
  }
  for (std::size_t i = 0; i < moving.size(); ++i) moving[i]->zoom = steady[i];
}

}  // namespace

ZoomJitter steady_zoom(std::optional<double> tolerance, std::vector<PanTiltSample>* samples) {
  SteadyZoom first(tolerance);
  for (const PanTiltSample& sample : *samples) {
    if (has_zoom(sample)) first.add(sample.latest_time_s, *sample.zoom);
  }
  if (!first.has_jitter()) return {0, first.tolerance()};
  // A second pass, with the jitter known.
  SteadyZoom second;
  second.know(first.sigma());
  struct Rest {
    std::vector<double> readings;
    std::vector<PanTiltSample*> samples;
  };
  std::map<std::size_t, Rest> rests;
  std::map<std::size_t, std::vector<PanTiltSample*>> movements;  // by the number of rests before
  for (PanTiltSample& sample : *samples) {
    if (!has_zoom(sample)) continue;
    const double reading = *sample.zoom;
    sample.zoom = second.add(sample.latest_time_s, reading);
    if (!second.rest()) {
      movements[rests.size()].push_back(&sample);
      continue;
    }
    Rest& rest = rests[*second.rest()];
    rest.readings.push_back(reading);
    rest.samples.push_back(&sample);
  }
  for (auto& [number, rest] : rests) {
    // A rest that creeps has no level.
    const double level = second.rounded(median(rest.readings));
    for (PanTiltSample* sample : rest.samples) {
      if (std::abs(*sample->zoom - level) <= second.tolerance()) sample->zoom = level;
    }
  }
  double before = 0;
  std::size_t count = 0;
  for (const auto& [number, rest] : rests) {
    const auto movement = movements.find(count);
    // Glitches in the rest before lie far from it.
    if (count > 0 && movement != movements.end())
      steady_movement(before, *rest.samples.front()->zoom, SteadyZoom::kFar * second.sigma(),
                      movement->second);
    before = *rest.samples.back()->zoom;
    ++count;
  }
  return {second.sigma(), second.tolerance()};
}

}  // namespace alidade
