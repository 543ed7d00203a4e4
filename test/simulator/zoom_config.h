#pragma once
// Configuration of the zoom: how the lens answers to its reading, how well it repeats, how it is
// moved and what is told of it. See zoom_curve.h, zoom_path.h and zoom.h for what the values do;
// docs/simulator.md lists the keys of the file.

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <vector>

namespace alidade::simulator {

class Section;

struct ZoomPathConfig {
  enum class Type { kStill, kDwell, kSweep, kCreep, kCsv };
  struct Stop {
    std::optional<double> reading;       // one of the two
    std::optional<double> focal_length;  // px
    double rest = 1;                     // s
  };
  Type type = Type::kStill;
  std::optional<double> reading;  // where still, sweep and creep begin; the wide end if not given
  std::vector<Stop> stops;        // of dwell
  double round = 0;               // s, of dwell; 0: as long as stops and movements take
  double factor = 10;          // of the focal length, of sweep and creep; below 1 to a shorter one
  double duration = 5;         // s, of one sweep
  double stop = 1;             // s of rest after each sweep or creep
  double rate = 0.01;          // of creep, d log f / dt, 1/s
  std::filesystem::path file;  // of csv
};

struct ZoomConfig {
  struct Ends {
    double wide = 0, tele = 0;
  };
  struct Interval {
    double from = 0, to = 0;  // s
  };
  Ends focal_length{1200, 24000};  // px
  double shape = 2;                // of log f over the reading: its slope at the tele end
  double ripple = 0.05;            // part of it that swings about that
  Ends distortion;                 // k r^2 in the middle of the left and right border
  Eigen::Vector2d centre{
      Eigen::Vector2d::Zero()};  // px, of the optical centre off the image's, at the wide end
  double centre_wander = 0;      // px, how far from there it goes
  Ends reading{1, 9999};         // may fall
  double step = 1;               // of the reading that is told
  double sigma_rep = 0;          // of log f, drawn anew by each movement
  double backlash = 0;           // of log f, arrived from wide less arrived from tele
  double speed = 0.75;           // most d log f / dt, 1/s
  double acceleration = 3;       // most d^2 log f / dt^2, 1/s^2
  double late = 0;               // s by which the zoom that is told is older than the angles
  std::vector<Interval> stuck;   // when it does not change
  ZoomPathConfig path;
};

// Throws ConfigError, also if the motor cannot follow the path.
void read_zoom(Section& section, ZoomConfig* zoom);

}  // namespace alidade::simulator
