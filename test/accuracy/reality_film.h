#pragma once
// Recordings of cameras that depart from the model, one departure at a time and all at once: the rows of alidade_reality.
//
// A film is told by the text of a configuration of the virtual camera (docs/simulator.md), drawn from the row and the seed:
// lens, mount, clocks, path and where the photo lies by the seed alone, so that rows differ by their departures; and of the
// departure its size (0.5 to 1.5 times the row's), signs, phases and periods. 640x360, 25 Hz, 12 s, f 10,670 px unless the
// row says so; MJPEG of quality 90 unless the row is about a codec. What the camera is believed to be noisy by stands in
// noise.yaml, which may be wrong: that is the row of a head with steps.

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

// The folder of the recording: recording/ with the virtual camera's files, film.yaml with the configuration. Made unless the
// cache has it with the same text. Several programs may ask at once. Throws std::runtime_error.
[[nodiscard]] std::filesystem::path kept_film(const RealityFilm& film, const std::string& name,
                                              const std::filesystem::path& cache);

}  // namespace alidade::test
