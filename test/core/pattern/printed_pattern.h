#pragma once
// A printed pattern before the virtual camera, and how well a detector finds it.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/pattern/known_pattern.h"
#include "core/pattern/pattern_detector.h"
#include "test/simulator/pattern_renderer.h"
#include "test/simulator/pattern_scene.h"

namespace alidade::test {

inline KnownPattern pattern_of(const std::string& text) {
  std::string error;
  return parse_pattern(text, &error).value();
}

// The same pattern as a person names it and as the virtual camera has it, and what its detector reaches, px.
struct Printed {
  const char* text;
  simulator::PatternConfig::Kind kind;
  int columns, rows;
  double size_m;
  double rms_at_rest, rms_moving;
};

inline simulator::Config scene_of(const Printed& printed) {
  return simulator::pattern_scene(printed.kind, printed.columns, printed.rows, printed.size_m);
}

inline std::vector<PatternObservation> found_in(const std::vector<std::uint8_t>& image,
                                                const simulator::Config& config,
                                                PatternDetector* detector) {
  return detector->find(image.data(), config.image.width, config.image.height, config.image.width);
}

// What is found of a frame against its truth. Patterns may be named from either end.
struct DetectedErrors {
  double squares = 0;
  int count = 0, wrong = 0;
  int frames = 0;  // in which something was found

  void add(const simulator::PatternRenderer& renderer, double time_s, const KnownPattern& pattern,
           const std::vector<PatternObservation>& found) {
    const auto& places = renderer.board().points();
    const auto error = [&](const PatternObservation& o, bool turned) {
      const auto point = static_cast<std::size_t>(o.point);
      const Eigen::Vector2d place = places[turned ? places.size() - 1 - point : point];
      return Eigen::Vector2d(o.u - renderer.camera().project_rolling(place, time_s).value());
    };
    if (found.empty()) return;
    ++frames;
    const bool turned = pattern.is_symmetric() &&
                        error(found.front(), true).norm() < error(found.front(), false).norm();
    for (const PatternObservation& o : found) {
      const double square = error(o, turned).squaredNorm();
      if (square > 0.25) {
        ++wrong;
        continue;
      }
      squares += square;
      ++count;
    }
  }
  [[nodiscard]] double rms() const { return std::sqrt(squares / (2 * count)); }
};

// Of frames this far apart, from 0 on.
inline DetectedErrors errors_of(const simulator::Config& config, const char* text, int frames,
                                double interval_s) {
  const KnownPattern pattern = pattern_of(text);
  const simulator::PatternRenderer renderer(config);
  PatternDetector detector(pattern);
  DetectedErrors errors;
  for (int f = 0; f < frames; ++f) {
    const double time_s = interval_s * f;
    errors.add(renderer, time_s, pattern, found_in(renderer.render(time_s, f), config, &detector));
  }
  return errors;
}

}  // namespace alidade::test
