#include "test/accuracy/reality_film.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <random>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "test/simulator/recording_writer.h"

namespace alidade::test {

namespace fs = std::filesystem;

// What goes into the sections of the file, each key with a comma before it.
struct FilmText {
  double focal_length = 10670;    // px
  double telemetry_sigma = 2e-5;  // rad
  std::string camera, photo, scene, sensor, telemetry, recording;
  std::optional<double> stated_angle_sigma;
};

class RealityDraw {
 public:
  explicit RealityDraw(std::uint64_t seed) : generator_(seed) {}

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  double normal(double sigma) { return std::normal_distribution<double>(0, sigma)(generator_); }
  bool either() { return std::bernoulli_distribution()(generator_); }
  double sign() { return either() ? 1 : -1; }
  double strength() { return between(0.5, 1.5); }
  double phase_deg() { return between(0, 360); }

 private:
  std::mt19937_64 generator_;
};

namespace {

constexpr double kWidth = 640;
constexpr double kHeight = 360;
constexpr double kDuration_s = 12;
constexpr double kDegreesPerRadian = 57.29577951308232;

// std::hash may differ from build to build.
std::uint64_t mixed(const std::string& name, std::uint64_t seed) {
  std::uint64_t hash = 14695981039346656037U ^ seed;
  for (const char c : name) {
    hash ^= static_cast<unsigned char>(c);
    hash *= 1099511628211U;
  }
  return hash;
}

double corner_slope(const FilmText& film) {
  return std::hypot(kWidth, kHeight) / 2 / film.focal_length;
}

void gear(double amplitude_mrad, RealityDraw* d, FilmText* film) {
  const auto harmonic = [&] {
    const double amplitude = amplitude_mrad * d->strength();
    const double period = 6 * d->between(0.7, 1.4);
    return fmt::format("[{{amplitude_mrad: {:.4f}, period_deg: {:.3f}, phase_deg: {:.1f}}}]",
                       amplitude, period, d->phase_deg());
  };
  const std::string pan = harmonic();
  film->telemetry += fmt::format(", gear: {{pan: {}, tilt: {}}}", pan, harmonic());
}

void play(double width_mrad, RealityDraw* d, FilmText* film) {
  const double pan = width_mrad * d->strength();
  const double tilt = width_mrad * d->strength();
  film->telemetry += fmt::format(", play: {{pan_mrad: {:.4f}, tilt_mrad: {:.4f}, encoder: {}}}",
                                 pan, tilt, d->either() ? "motor" : "output");
}

// Noise is stated as the sensor's, without the steps.
void steps(double step_deg, RealityDraw* d, FilmText* film) {
  film->telemetry += fmt::format(", quantum_deg: {:.5f}", step_deg * d->strength());
  film->telemetry_sigma = 1e-5;
  film->stated_angle_sigma = film->telemetry_sigma;
}

void pupil(double nearest_m, double farthest_m, double below_cm, RealityDraw* d, FilmText* film) {
  const double strength = d->strength();
  const double below = below_cm * strength * d->sign();
  film->camera += fmt::format(", pupil_cm: [0, {:.2f}, {:.2f}]", below, 5 * strength);
  const double length_deg = film->focal_length > 5000 ? 2 : 6;
  film->photo +=
      fmt::format(", distance_m: {{nearest: {:.0f}, farthest: {:.0f}, layers: {}, length_deg: {}}}",
                  nearest_m, farthest_m, d->either() ? 6 : 0, length_deg);
}

void fifth_order(double corner_px, RealityDraw* d, FilmText* film) {
  const double slope = corner_slope(*film);
  const double k2 =
      corner_px * d->strength() * d->sign() / (std::pow(slope, 5) * film->focal_length);
  film->camera += fmt::format(", radial_distortion_2: {:.5g}", k2);
}

void centre(RealityDraw* d, FilmText* film) {
  const double u = 10 * d->strength() * d->sign();
  const double v = 8 * d->strength() * d->sign();
  film->camera += fmt::format(", centre_px: [{:.2f}, {:.2f}]", u, v);
}

void clouds(double rate_px_s, RealityDraw* d, FilmText* film) {
  const double rate = rate_px_s * d->strength();
  film->scene += fmt::format(", clouds: {{fraction: 0.6, rate_px_s: {:.3f}, heading_deg: {:.1f}}}",
                             rate, d->phase_deg());
}

void haze(double rms_px, RealityDraw* d, FilmText* film) {
  const double rms = rms_px * d->strength();
  film->sensor += fmt::format(", boil_px: {:.3f}, boil_length_px: {:.1f}, boil_time_s: {:.3f}", rms,
                              d->between(20, 60), d->between(0.05, 0.2));
}

void mast(double amplitude_mrad, double frequency_hz, RealityDraw* d, FilmText* film) {
  std::string swings;
  for (const char* axis : {"right", "down"}) {
    const double amplitude = amplitude_mrad * d->strength();
    const double frequency = frequency_hz * d->between(0.8, 1.25);
    swings += fmt::format(
        "{}{{axis: {}, amplitude_mrad: {:.4f}, frequency_hz: {:.3f}, phase_deg: {:.1f}}}",
        swings.empty() ? "" : ", ", axis, amplitude, frequency, d->phase_deg());
  }
  film->camera += ", sway: [" + swings + "]";
}

void reduction(double part, FilmText* film) {
  film->sensor += fmt::format(", noise_reduction: {}", part);
}

void h264(int kbit_s, FilmText* film) {
  film->recording += fmt::format(", codec: h264, kbit_s: {}, gop: 50", kbit_s);
}

// All of a camera of 300 euros at once.
void dome(double nearest_m, double farthest_m, RealityDraw* d, FilmText* film) {
  gear(0.3, d, film);
  play(0.5, d, film);
  steps(0.01, d, film);
  pupil(nearest_m, farthest_m, 1, d, film);
  fifth_order(0.7, d, film);
  centre(d, film);
  const double part = 3e-4 * d->strength();
  film->camera += fmt::format(", breathing: {{type: sine, part: {:.3g}, period_s: {:.1f}}}", part,
                              d->between(10, 40));
  haze(0.3, d, film);
  h264(1500, film);
}

}  // namespace

const std::vector<RealityRow>& reality_rows() {
  using D = RealityDraw;
  using F = FilmText;
  static const std::vector<RealityRow> rows = {
      {"none", "none (two scenes)", {}, [](D*, F*) {}},
      {"gear", "gear: reading off by 0.2 mrad sin(60 true)", 0.10,
       [](D* d, F* f) { gear(0.2, d, f); }},
      {"play", "play of 0.3 mrad in the telemetry", 0.10, [](D* d, F* f) { play(0.3, d, f); }},
      {"step", "steps of 0.01 degrees, stated noise 1e-5 rad", 0.10,
       [](D* d, F* f) { steps(0.01, d, f); }},
      {"pupil-far",
       "pupil 5 cm before the axes, 3 cm off; scene at 100 to 400 m",
       {},
       [](D* d, F* f) { pupil(100, 400, 3, d, f); }},
      {"pupil-near", "the same, scene at 20 to 60 m", 0.12,
       [](D* d, F* f) { pupil(20, 60, 3, d, f); }},
      {"k5", "a fifth-order term, 0.7 px in the corner", 0.07,
       [](D* d, F* f) { fifth_order(0.7, d, f); }},
      {"centre", "optical centre 10, 8 px off", 0.07, [](D* d, F* f) { centre(d, f); }},
      {"breathing",
       "f breathes by 1e-3 over 12 s",
       {},
       [](D* d, F* f) {
         f->camera += fmt::format(", breathing: {{type: linear, part: {:.3g}, period_s: 12}}",
                                  1e-3 * d->strength() * d->sign());
       }},
      {"clouds", "60 % of each picture is clouds that drift 6 px/s", 0.12,
       [](D* d, F* f) { clouds(6, d, f); }},
      {"clouds-slow", "the same, 1 px/s", 0.12, [](D* d, F* f) { clouds(1, d, f); }},
      {"water",
       "lower half moves like water, 20 px/s",
       {},
       [](D* d, F* f) {
         f->scene +=
             fmt::format(", water: {{below_deg: 0, rate_px_s: {:.2f}}}", 20 * d->strength());
       }},
      {"haze", "heat haze of 0.5 px", 0.30, [](D* d, F* f) { haze(0.5, d, f); }},
      {"haze-strong", "heat haze of 1.5 px", {}, [](D* d, F* f) { haze(1.5, d, f); }},
      {"mast-fast", "mast sways 0.1 mrad at 3 Hz", {}, [](D* d, F* f) { mast(0.1, 3, d, f); }},
      {"mast-slow", "mast sways 0.3 mrad at 1 Hz", {}, [](D* d, F* f) { mast(0.3, 1, d, f); }},
      {"reduction", "noise reduction: half of the picture before", 0.15,
       [](D*, F* f) { reduction(0.5, f); }},
      {"reduction-strong",
       "noise reduction: 0.7 of the picture before",
       {},
       [](D*, F* f) { reduction(0.7, f); }},
      {"h264-800", "H.264 at 800 kbit/s", {}, [](D*, F* f) { h264(800, f); }},
      {"h264-250", "H.264 at 250 kbit/s", {}, [](D*, F* f) { h264(250, f); }},
      {"picture",
       "sharpening, exposure steps, vignetting",
       {},
       [](D* d, F* f) {
         f->sensor += fmt::format(
             ", vignetting: 0.3, sharpening: {{amount: 0.5, radius_px: 1}}, brightness_steps: "
             "[{{time_s: {:.2f}, factor: {:.2f}}}, {{time_s: {:.2f}, factor: {:.2f}}}]",
             d->between(2, 5), d->between(0.6, 0.8), d->between(6, 10), d->between(0.9, 1.2));
       }},
      {"dome",
       "a cheap dome, all at once, f 3000, scene at 60 to 800 m",
       {},
       [](D* d, F* f) {
         f->focal_length = 3000;
         dome(60, 800, d, f);
       }},
      {"dome-tele", "the same, f 10,670, scene at 200 to 3000 m", {}, [](D* d, F* f) {
         dome(200, 3000, d, f);
       }}};
  return rows;
}

RealityFilm reality_film(const RealityRow& row, std::uint64_t seed, const fs::path& photos) {
  FilmText film;
  RealityDraw departure(mixed(row.name, seed));
  row.depart(&departure, &film);

  // The same for every row.
  RealityDraw d(mixed("camera", seed));
  const double field_deg = 2 * std::atan(kWidth / 2 / film.focal_length) * kDegreesPerRadian;
  const double slope = corner_slope(film);
  const double k = d.between(-0.005, 0.015) / (slope * slope);
  const double line_delay_us = d.between(25, 60);
  double axes[4];
  for (double& axis : axes) axis = d.normal(3);
  const double offset_ms = d.between(-150, 50);
  const double amplitude = d.between(0.8, 1.05);
  const double side = d.sign();
  const double period = d.between(11.5, 14);
  const double azimuth = side * d.between(-0.3, 0.3) * field_deg;
  const double elevation = d.between(-0.3, 0.3) * field_deg;

  std::string text;
  text += fmt::format("seed: {}\nduration_s: {}\n", seed, kDuration_s);
  text += "image: {width: 640, height: 360, rate_hz: 25}\n";
  text += fmt::format(
      "camera: {{focal_length_px: {}, radial_distortion: {:.5g}, line_delay_us: {:.3f}, "
      "pan_axis_mrad: [{:.3f}, {:.3f}], tilt_axis_mrad: [{:.3f}, {:.3f}], clock_offset_ms: "
      "{:.2f}{}}}\n",
      film.focal_length, k, line_delay_us, axes[0], axes[1], axes[2], axes[3], offset_ms,
      film.camera);
  text += fmt::format("path: {{type: triple_cosine, amplitude: {:.4f}, period_s: {:.3f}}}\n",
                      amplitude, period);
  text += fmt::format(
      "scene: {{background: 0.6, detail: 0.5, photos: [{{file: {}, width_deg: {:.2f}, "
      "azimuth_deg: {:.3f}, elevation_deg: {:.3f}{}}}]{}}}\n",
      (photos /
       (seed % 2 == 0 ? "picosdeeuropa_by_Aitzol_Berasategi.jpg" : "life_by_Aitzol_Berasategi.jpg"))
          .string(),
      5 * field_deg, azimuth, elevation, film.photo, film.scene);
  text += "sensor: {exposure_ms: 2, shot_noise: 0.02, read_noise: 1.5" + film.sensor + "}\n";
  text += fmt::format("telemetry: {{rate_hz: 20, sigma_rad: {:.3g}{}}}\n", film.telemetry_sigma,
                      film.telemetry);
  text += "timing: {image_jitter: {exponential_ms: 2}, telemetry_jitter: {exponential_ms: 1}}\n";
  text += "recording: {images: video" + film.recording + "}\n";
  return {text, film.stated_angle_sigma};
}

namespace {

std::string text_of(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file).rdbuf();
  return text.str();
}

void write_text(const fs::path& file, const std::string& text) {
  std::ofstream out(file);
  out << text;
  if (!out.flush()) throw std::runtime_error(file.string() + ": cannot be written");
}

void state_angle_sigma(const fs::path& file, double sigma) {
  std::istringstream lines(text_of(file));
  std::string kept;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("pan_tilt_sigma_rad:", 0) != 0) kept += line + "\n";
  }
  write_text(file, kept + fmt::format("pan_tilt_sigma_rad: {}\n", sigma));
}

}  // namespace

fs::path kept_film(const RealityFilm& film, const std::string& name, const fs::path& cache) {
  const fs::path folder = cache / name;
  if (text_of(folder / "film.yaml") == film.configuration) return folder;
  const fs::path made = cache / fmt::format("{}.{}", name, ::getpid());
  fs::create_directories(made);
  write_text(made / "film.yaml", film.configuration);
  simulator::write_recording(simulator::load_config(made / "film.yaml"), made / "recording");
  if (film.stated_angle_sigma) {
    state_angle_sigma(made / "recording" / "noise.yaml", *film.stated_angle_sigma);
  }
  std::error_code taken;
  fs::rename(made, folder, taken);
  if (!taken) return folder;
  if (text_of(folder / "film.yaml") == film.configuration) {  // another program was faster
    fs::remove_all(made);
    return folder;
  }
  fs::remove_all(folder);
  fs::rename(made, folder);
  return folder;
}

}  // namespace alidade::test
