#include "core/calibration/input_selection.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <unordered_map>

namespace alidade::internal {

namespace {

StageStatus select_frames(const CalibrationInput& input, SelectedInput* selected,
                          CalibrationExclusions* excluded) {
  auto& chosen = selected->frame_index;
  std::unordered_map<std::int64_t, std::size_t> seen;
  for (std::size_t i = 0; i < input.frames.size(); ++i) {
    const auto& frame = input.frames[i];
    if (!std::isfinite(frame.stamp_s)) {
      ++excluded->frames_not_finite;
    } else if (!seen.emplace(frame.frame, i).second) {
      ++excluded->frames_duplicate;
    } else {
      chosen.push_back(i);
    }
  }
  const auto& frames = input.frames;
  const bool counted = std::all_of(chosen.begin(), chosen.end(),
                                   [&](std::size_t i) { return frames[i].sequence.has_value(); });
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
    return counted ? *frames[a].sequence < *frames[b].sequence
                   : frames[a].stamp_s < frames[b].stamp_s;
  });
  if (chosen.size() < 3) {
    return {CalibrationStatus::kBadInput, "only " + std::to_string(chosen.size()) +
                                              " usable frames; some seconds of video are needed"};
  }
  return {};
}

StageStatus select_telemetry(const CalibrationInput& input, SelectedInput* selected,
                             CalibrationExclusions* excluded) {
  const auto& telemetry = input.telemetry;
  auto& chosen = selected->telemetry_index;
  for (std::size_t i = 0; i < telemetry.size(); ++i) {
    const auto& sample = telemetry[i];
    if (std::isfinite(sample.stamp_s) && std::isfinite(sample.pan_rad) &&
        std::isfinite(sample.tilt_rad)) {
      chosen.push_back(i);
    } else {
      ++excluded->telemetry_not_finite;
    }
  }
  const bool counted = std::all_of(chosen.begin(), chosen.end(), [&](std::size_t i) {
    return telemetry[i].sequence.has_value();
  });
  std::stable_sort(chosen.begin(), chosen.end(), [&](std::size_t a, std::size_t b) {
    return counted ? *telemetry[a].sequence < *telemetry[b].sequence
                   : telemetry[a].stamp_s < telemetry[b].stamp_s;
  });
  const auto same = [&](std::size_t a, std::size_t b) {
    return counted ? telemetry[a].sequence == telemetry[b].sequence
                   : telemetry[a].stamp_s == telemetry[b].stamp_s;
  };
  const auto unique_end = std::unique(chosen.begin(), chosen.end(), same);
  excluded->telemetry_duplicate = static_cast<int>(chosen.end() - unique_end);
  chosen.erase(unique_end, chosen.end());
  if (chosen.size() < 8) {
    return {CalibrationStatus::kBadInput,
            "only " + std::to_string(chosen.size()) +
                " usable telemetry samples; some seconds of telemetry are needed"};
  }
  for (const std::size_t i : chosen) {
    const double largest =
        std::max(std::abs(telemetry[i].pan_rad), std::abs(telemetry[i].tilt_rad));
    if (largest > 2.5 * kPi) {
      return {CalibrationStatus::kBadInput,
              "a telemetry angle of " + std::to_string(largest) +
                  " rad is more than a turn: are these degrees? Radians are needed"};
    }
  }
  return {};
}

StageStatus select_observations(const CalibrationInput& input, SelectedInput* selected,
                                CalibrationExclusions* excluded) {
  std::unordered_map<std::int64_t, int> frame_of;
  for (std::size_t i = 0; i < selected->frame_index.size(); ++i) {
    frame_of.emplace(input.frames[selected->frame_index[i]].frame, static_cast<int>(i));
  }
  auto& names = selected->landmark_name;
  struct Candidate {
    std::int64_t landmark;
    int frame;
    std::size_t index;
  };
  std::vector<Candidate> candidates;
  double largest = 0;
  for (std::size_t i = 0; i < input.observations.size(); ++i) {
    const auto& o = input.observations[i];
    const auto frame = frame_of.find(o.frame);
    if (!std::isfinite(o.u_px) || !std::isfinite(o.v_px)) {
      ++excluded->observations_not_finite;
    } else if (!std::isfinite(o.sigma_px) || o.sigma_px <= 0) {
      ++excluded->observations_bad_sigma;
    } else if (frame == frame_of.end()) {
      ++excluded->observations_unknown_frame;
    } else if (o.u_px < -1 || o.u_px > input.width + 1 || o.v_px < -1 ||
               o.v_px > input.height + 1) {
      ++excluded->observations_outside_image;
    } else {
      candidates.push_back({o.landmark, frame->second, i});
      largest = std::max({largest, std::abs(o.u_px), std::abs(o.v_px)});
    }
  }
  if (!candidates.empty() && largest < 2) {
    return {CalibrationStatus::kBadInput,
            "no observation lies beyond pixel 2: are these normalised coordinates? Pixels are "
            "needed"};
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) {
                     return a.landmark != b.landmark ? a.landmark < b.landmark : a.frame < b.frame;
                   });
  // A landmark seen twice in a frame: it is unknown which one is right, so both are left out.
  std::vector<Candidate> unique;
  for (std::size_t i = 0; i < candidates.size();) {
    std::size_t end = i + 1;
    while (end < candidates.size() && candidates[end].landmark == candidates[i].landmark &&
           candidates[end].frame == candidates[i].frame) {
      ++end;
    }
    if (end == i + 1) {
      unique.push_back(candidates[i]);
    } else {
      excluded->observations_duplicate += static_cast<int>(end - i);
    }
    i = end;
  }
  for (std::size_t i = 0; i < unique.size();) {
    std::size_t end = i + 1;
    while (end < unique.size() && unique[end].landmark == unique[i].landmark) ++end;
    if (end == i + 1) {
      ++excluded->observations_of_single_landmarks;
    } else {
      for (std::size_t j = i; j < end; ++j) {
        const auto& o = input.observations[unique[j].index];
        selected->data.observations.push_back({static_cast<int>(names.size()), unique[j].frame,
                                               Vector2<double>(o.u_px, o.v_px), o.sigma_px, true});
        selected->observation_index.push_back(unique[j].index);
      }
      names.push_back(unique[i].landmark);
    }
    i = end;
  }
  if (names.size() < kMinLandmarks) {
    return {CalibrationStatus::kTooFewLandmarks,
            "only " + std::to_string(names.size()) +
                " landmarks are seen in two frames or more; at least " +
                std::to_string(kMinLandmarks) +
                " are needed, some hundred are good: point the camera at a scene with texture"};
  }
  return {};
}

}  // namespace

StageStatus select_input(const CalibrationInput& input, SelectedInput* selected,
                         CalibrationExclusions* excluded) {
  if (input.width <= 0 || input.height <= 0) {
    return {CalibrationStatus::kBadInput, "the image's width and height must be positive"};
  }
  StageStatus status = select_frames(input, selected, excluded);
  if (status.ok()) status = select_telemetry(input, selected, excluded);
  if (status.ok()) status = select_observations(input, selected, excluded);
  return status;
}

}  // namespace alidade::internal
