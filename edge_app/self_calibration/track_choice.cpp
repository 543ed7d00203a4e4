#include "edge_app/self_calibration/track_choice.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <tuple>
#include <unordered_set>
#include <utility>

namespace alidade {
namespace {

struct Track {
  std::int64_t landmark = 0;
  std::vector<std::size_t> frames;  // places in the order of all frames
  double left = std::numeric_limits<double>::infinity();
  double top = std::numeric_limits<double>::infinity();
  double right = -std::numeric_limits<double>::infinity();
  double bottom = -std::numeric_limits<double>::infinity();
  [[nodiscard]] double extent() const { return std::hypot(right - left, bottom - top); }
};

using Names = std::unordered_set<std::int64_t>;

// The place of each frame in the order of all.
std::unordered_map<std::int64_t, std::size_t> places_of(
    const std::vector<CalibrationObservation>& observations) {
  std::vector<std::int64_t> names;
  names.reserve(observations.size());
  for (const CalibrationObservation& seen : observations) names.push_back(seen.frame);
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  std::unordered_map<std::int64_t, std::size_t> places;
  for (const std::int64_t name : names) places.emplace(name, places.size());
  return places;
}

// Tracks over every stride-th frame, long enough; those that moved farthest first.
std::vector<Track> tracks_in(const std::vector<CalibrationObservation>& observations,
                             const std::unordered_map<std::int64_t, std::size_t>& places,
                             std::size_t stride) {
  std::unordered_map<std::int64_t, Track> all;
  for (const CalibrationObservation& seen : observations) {
    const std::size_t place = places.at(seen.frame);
    if (place % stride != 0) continue;
    Track& track = all[seen.landmark];
    track.landmark = seen.landmark;
    track.frames.push_back(place);
    track.left = std::min(track.left, seen.u_px);
    track.right = std::max(track.right, seen.u_px);
    track.top = std::min(track.top, seen.v_px);
    track.bottom = std::max(track.bottom, seen.v_px);
  }
  std::vector<Track> tracks;
  for (auto& [landmark, track] : all) {
    if (track.frames.size() >= kMinSightings) tracks.push_back(std::move(track));
  }
  // The second criterion makes the order deterministic.
  std::sort(tracks.begin(), tracks.end(), [](const Track& a, const Track& b) {
    return a.extent() != b.extent() ? a.extent() > b.extent() : a.landmark < b.landmark;
  });
  return tracks;
}

std::size_t size_of(const std::vector<Track>& tracks) {
  std::size_t size = 0;
  for (const Track& track : tracks) size += track.frames.size();
  return size;
}

// Chooses each track of which at least half of the frames still have fewer than in_each. Returns
// the number of observations.
std::size_t take_in_each_frame(const std::vector<Track>& tracks, std::size_t frames,
                               std::size_t in_each, Names* chosen) {
  chosen->clear();
  std::vector<std::size_t> in_frame(frames, 0);
  std::size_t size = 0;
  for (const Track& track : tracks) {
    const auto needy = static_cast<std::size_t>(
        std::count_if(track.frames.begin(), track.frames.end(),
                      [&](std::size_t frame) { return in_frame[frame] < in_each; }));
    if (2 * needy < track.frames.size()) continue;
    for (const std::size_t frame : track.frames) ++in_frame[frame];
    size += track.frames.size();
    chosen->insert(track.landmark);
  }
  return size;
}

// Chooses as many tracks in each frame as fit, then whatever else fits. Returns the number in each
// frame.
std::size_t take_evenly(const std::vector<Track>& tracks, std::size_t frames,
                        std::size_t max_observations, Names* chosen) {
  std::size_t enough = 0;
  std::size_t too_many = tracks.size() + 1;
  while (too_many - enough > 1) {
    const std::size_t middle = enough + (too_many - enough) / 2;
    const bool fits = take_in_each_frame(tracks, frames, middle, chosen) <= max_observations;
    (fits ? enough : too_many) = middle;
  }
  std::size_t size = 0;
  if (enough > 0) {
    size = take_in_each_frame(tracks, frames, enough, chosen);
  } else {
    chosen->clear();
  }
  for (const Track& track : tracks) {
    if (size + track.frames.size() > max_observations) continue;
    if (chosen->insert(track.landmark).second) size += track.frames.size();
  }
  return enough;
}

}  // namespace

std::vector<CalibrationObservation> without_shared_pixels(
    std::vector<CalibrationObservation> observations) {
  std::unordered_map<std::int64_t, double> information;  // of each landmark, 1/px^2
  for (const CalibrationObservation& seen : observations)
    information[seen.landmark] += 1 / (seen.sigma_px * seen.sigma_px);
  const auto rank = [&information](const CalibrationObservation& seen) {
    return std::make_tuple(seen.frame, -information.at(seen.landmark), seen.landmark);
  };
  std::sort(observations.begin(), observations.end(),
            [&rank](const CalibrationObservation& a, const CalibrationObservation& b) {
              return rank(a) < rank(b);
            });
  // In place: there may be 100,000 of them.
  auto kept = observations.begin();
  auto of_frame = kept;
  for (const CalibrationObservation& seen : observations) {
    if (kept != observations.begin() && std::prev(kept)->frame != seen.frame) of_frame = kept;
    if (std::none_of(of_frame, kept, [&seen](const CalibrationObservation& better) {
          return std::hypot(seen.u_px - better.u_px, seen.v_px - better.v_px) < kSharedPixels_px;
        })) {
      *kept++ = seen;
    }
  }
  observations.erase(kept, observations.end());
  return observations;
}

std::vector<CalibrationObservation> choose_tracks(std::vector<CalibrationObservation> observations,
                                                  std::size_t max_observations,
                                                  UntrackedFrames* untracked) {
  observations = without_shared_pixels(std::move(observations));
  const auto places = places_of(observations);
  std::size_t stride = 1;
  std::vector<Track> tracks = tracks_in(observations, places, stride);
  if (untracked != nullptr) {
    for (const auto& [name, place] : places) (*untracked)[name] = Untracked::kTooShort;
    std::vector<bool> is_seen(places.size());
    for (const Track& track : tracks) {
      for (const std::size_t place : track.frames) is_seen[place] = true;
    }
    for (const auto& [name, place] : places) {
      if (is_seen[place]) (*untracked)[name] = Untracked::kBeyondLimit;
    }
  }
  Names chosen;
  if (size_of(tracks) <= max_observations) {
    for (const Track& track : tracks) chosen.insert(track.landmark);
  } else {
    while (take_evenly(tracks, places.size(), max_observations, &chosen) < kLeastInAFrame) {
      std::vector<Track> fewer = tracks_in(observations, places, stride + 1);
      if (fewer.size() < kLeastInAFrame) break;
      ++stride;
      tracks = std::move(fewer);
    }
  }
  const auto is_left_out = [&](const CalibrationObservation& seen) {
    return chosen.count(seen.landmark) == 0 || places.at(seen.frame) % stride != 0;
  };
  observations.erase(std::remove_if(observations.begin(), observations.end(), is_left_out),
                     observations.end());
  observations.shrink_to_fit();
  if (untracked != nullptr) {
    for (const CalibrationObservation& seen : observations) untracked->erase(seen.frame);
  }
  return observations;
}

}  // namespace alidade
