#pragma once
// Recordings of cameras that depart from the model, one departure at a time and all at once: the
// rows of alidade_reality.
//
// The configuration of the virtual camera (docs/simulator.md) describes a film. It is drawn from
// row and seed. Lens, mount, clocks, path and the photo's place depend on the seed alone, so that
// rows differ by their departures only. The departure's size (0.5 to 1.5 times the row's), signs,
// phases and periods are drawn, too. A film has 640x360 px, 25 Hz, 12 s and f 10,670 px unless the
// row changes them, and MJPEG of quality 90 unless the row is about a codec. noise.yaml states the
// noise that the estimator is told. It may be wrong: the row of a head with steps tests that.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace alidade::test {

struct FilmText;
class RealityDraw;

struct RealityRow {
  std::string name;
  std::string departure;  // in words
  std::optional<double>
      most_relative;  // px, mark: RMS error in OE mode with one common rotation taken out
  void (*depart)(RealityDraw* draw, FilmText* film);
};

[[nodiscard]] const std::vector<RealityRow>& reality_rows();

struct RealityFilm {
  std::string configuration;                 // text of the virtual camera's file
  std::optional<double> stated_angle_sigma;  // rad, in place of what noise.yaml would tell
};

// photos: the folder of the scenes' photos.
[[nodiscard]] RealityFilm reality_film(const RealityRow& row, std::uint64_t seed,
                                       const std::filesystem::path& photos);

// The folder of the recording: recording/ holds the virtual camera's files, film.yaml the
// configuration. It is made unless the cache has one with the same text. Several programs may ask
// at once. Throws std::runtime_error.
[[nodiscard]] std::filesystem::path kept_film(const RealityFilm& film, const std::string& name,
                                              const std::filesystem::path& cache);

}  // namespace alidade::test
