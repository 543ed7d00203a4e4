#include "test/accuracy/pattern_paper.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

double deviation(const std::vector<double>& values) {
  const double middle = mean(values);
  double sum = 0;
  for (const double value : values) sum += (value - middle) * (value - middle);
  return values.size() < 2 ? 0 : std::sqrt(sum / static_cast<double>(values.size() - 1));
}

// Meingast, Geyer, Sastry: a light that flashes at a known rate before the sensor makes stripes; the highest peak of the rows'
// spectrum counts them. To the nearest line of the spectrum.
double line_delay_by_light(double line_delay_s, int rows, std::mt19937_64* random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> noise(0, 0.05);
  const double rate_hz = 400 + 600 * uniform(*random);
  const double phase = uniform(*random);
  const double exposed = 0.25;  // of the light's period
  std::vector<double> brightness;
  for (int row = 0; row < rows; ++row) {
    const double begin = row * line_delay_s * rate_hz + phase;
    // The part of the exposure in which the light is on: the first half of each period.
    const auto lit = [](double t) {
      return 0.5 * std::floor(t) + std::min(t - std::floor(t), 0.5);
    };
    brightness.push_back((lit(begin + exposed) - lit(begin)) / exposed + noise(*random));
  }
  const double average = mean(brightness);
  int best = 1;
  double highest = 0;
  for (int k = 1; k <= rows / 2; ++k) {
    double cosine = 0;
    double sine = 0;
    for (int row = 0; row < rows; ++row) {
      const double angle = 2 * M_PI * k * row / rows;
      cosine += (brightness[static_cast<std::size_t>(row)] - average) * std::cos(angle);
      sine += (brightness[static_cast<std::size_t>(row)] - average) * std::sin(angle);
    }
    if (cosine * cosine + sine * sine > highest) {
      highest = cosine * cosine + sine * sine;
      best = k;
    }
  }
  return best / (rows * rate_hz);
}

struct Line {
  double slope = 0;
  double slope_sigma = 0;
  double intercept = 0;
  double residual = 0;  // root mean square
};

Line line_through(const std::vector<double>& x, const std::vector<double>& y) {
  const double x_mean = mean(x);
  const double y_mean = mean(y);
  double xx = 0;
  double xy = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - x_mean) * (x[i] - x_mean);
    xy += (x[i] - x_mean) * (y[i] - y_mean);
  }
  Line line;
  line.slope = xy / xx;
  line.intercept = y_mean - line.slope * x_mean;
  std::vector<double> residuals;
  for (std::size_t i = 0; i < x.size(); ++i)
    residuals.push_back(y[i] - line.intercept - line.slope * x[i]);
  line.residual = root_mean_square(residuals);
  line.slope_sigma = line.residual / std::sqrt(xx);
  return line;
}

}  // namespace

void print_line_delays(const std::vector<PatternRuns>& all, std::uint64_t first_seed,
                       std::ostream& out, std::vector<std::string>* missed) {
  Table table;
  table.title = "Table 1: line delays, us (in brackets the paper's)";
  table.header = {"pixel clock", "runs", "nominal", "median", "by light", "deviation", "by light "};
  struct Paper {
    double clock_mhz;
    const char *ours, *light, *our_deviation, *light_deviation;
  };
  constexpr Paper kPaper[] = {{12, " (137.7)", " (136.86)", " (0.56)", " (3.12)"},
                              {20, " (82.55)", " (83.54)", " (0.15)", " (1.23)"},
                              {32, " (51.35)", " (51.48)", " (0.19)", " (1.70)"},
                              {40, " (41.14)", " (41.09)", " (0.21)", " (0.82)"}};
  std::vector<double> period_us;  // of a pixel, of each run
  std::vector<double> ours_us;
  std::vector<double> light_us;
  std::mt19937_64 random(first_seed);
  for (const auto& [setting, runs] : all) {
    for (const Paper& paper : kPaper) {
      if (setting.pixel_clock_mhz != paper.clock_mhz) continue;
      const double nominal_us = 1e6 * setting.scene.lens.line_delay_s;
      std::vector<double> ours;
      std::vector<double> light;
      for (const PatternRun& run : runs) {
        if (run.status != PatternStatus::kOk) continue;
        ours.push_back(1e6 * run.line_delay_s);
        light.push_back(1e6 * line_delay_by_light(setting.scene.lens.line_delay_s,
                                                  setting.scene.height, &random));
        period_us.push_back(1 / paper.clock_mhz);
      }
      ours_us.insert(ours_us.end(), ours.begin(), ours.end());
      light_us.insert(light_us.end(), light.begin(), light.end());
      table.rows.push_back({setting.name, std::to_string(ours.size()), number(nominal_us, 5),
                            number(median(ours), 5) + paper.ours,
                            number(median(light), 5) + paper.light,
                            number(deviation(ours), 2) + paper.our_deviation,
                            number(deviation(light), 2) + paper.light_deviation});
    }
  }
  if (table.rows.size() < 2) return;
  table.print(out);
  Table fit;
  fit.title = "Table 2: line delay through pixel period (in brackets the paper's)";
  fit.header = {"", "nominal", "here", "by light"};
  const Line ours = line_through(period_us, ours_us);
  const Line light = line_through(period_us, light_us);
  fit.rows = {{"slope, pixels", "1650.0", number(ours.slope, 6) + " (1650.02)",
               number(light.slope, 6) + " (1642.54)"},
              {"its sigma", "", number(ours.slope_sigma, 2), number(light.slope_sigma, 2)},
              {"intercept, us", "0", number(ours.intercept, 2) + " (-0.0016)",
               number(light.intercept, 2) + " (0.39)"},
              {"rms residual, us", "0", number(ours.residual, 2), number(light.residual, 2)}};
  fit.print(out);
  // Two sigmas of 40 runs at each clock; of fewer, as much more as chance gives.
  const double runs = static_cast<double>(ours_us.size()) / 4;
  if (!(std::abs(ours.slope - 1650) <= 0.5 * std::sqrt(std::max(1.0, 40 / runs))))
    missed->push_back("slope of line delay through pixel period: " + number(ours.slope, 6));
}

void print_telephones(double share, std::uint64_t first_seed, std::ostream& out) {
  struct Telephone {
    const char* name;
    int width, height;
    double focal_length_px, line_delay_us;
    int recordings;
    const char* paper;
  };
  constexpr Telephone kTelephones[] = {{"iPhone3GS", 640, 480, 620, 64.41, 5, "0.11"},
                                       {"iPhone4S", 1920, 1080, 1750, 24.12, 12, "0.52"},
                                       {"Galaxy S3", 1920, 1080, 1650, 30.25, 7, "0.68"}};
  Table table;
  table.title =
      "Table 3: cameras like three telephones', asymmetric circle grid 4x11, 50 s, 30 frames/s, "
      "noise 0.1 px";
  table.header = {"camera",    "resolution", "true d, us",        "mean d",
                  "deviation", "stated",     "paper's deviation", "N"};
  for (const Telephone& phone : kTelephones) {
    PatternScene scene;
    scene.width = phone.width;
    scene.height = phone.height;
    scene.lens = {phone.focal_length_px,
                  phone.focal_length_px,
                  0.5 * phone.width + 4,
                  0.5 * phone.height - 3,
                  0.12,
                  -0.25,
                  2e-4,
                  1e-4,
                  1e-6 * phone.line_delay_us};
    scene.columns = 4;
    scene.rows = 11;
    scene.square_m = 0.02;
    scene.staggered = true;
    scene.rate_hz = 30;
    scene.duration_s = 50;
    scene.noise_px = 0.1;
    std::vector<double> delays_us;
    std::vector<double> stated_us;
    const int recordings = std::max(2, static_cast<int>(std::ceil(share * phone.recordings)));
    for (int i = 0; i < recordings; ++i) {
      scene.seed = first_seed + static_cast<std::uint64_t>(i);
      const PatternRun run = run_pattern(scene, false);
      if (run.status != PatternStatus::kOk) {
        table.notes.push_back(std::string(phone.name) + ": " + run.message);
        continue;
      }
      delays_us.push_back(1e6 * run.line_delay_s);
      const int p = index(LensParameter::kLineDelay);
      stated_us.push_back(1e6 * std::sqrt(run.covariance(p, p)));
    }
    table.rows.push_back({phone.name,
                          std::to_string(phone.width) + "x" + std::to_string(phone.height),
                          number(phone.line_delay_us, 4), number(mean(delays_us), 5),
                          number(deviation(delays_us), 2), number(median(stated_us), 2),
                          phone.paper, std::to_string(delays_us.size())});
  }
  table.print(out);
}

}  // namespace alidade::test
