#include "test/accuracy/tag_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>

#include "edge_app/storage/calibration_file.h"
#include "platform/storage/csv_reader.h"
#include "test/accuracy/statistics.h"

namespace alidade::test {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kLeastFrames = 10;  // fewer say little about a standard deviation

// Direction of the tag's centre, not of unit length; empty if a corner has none.
std::optional<Vector3d> centre_of(const TagCorners& corners, const RecordedOrientation& seen) {
  std::array<Vector3d, 4> d;
  for (std::size_t i = 0; i < 4; ++i) {
    if (rolling_shutter_unproject(seen.camera, seen.mechanics, seen.line_delay, seen.motion,
                                  corners.at(i), &d.at(i)) != ProjectionStatus::kOk) {
      return std::nullopt;
    }
  }
  const Vector3d centre = d[0].cross(d[2]).cross(d[1].cross(d[3]));
  return centre.dot(d[0]) < 0 ? Vector3d(-centre) : centre;
}

const RecordedOrientation* nearest(const std::vector<RecordedOrientation>& orientations,
                                   double time_s, double tolerance_s) {
  const auto next =
      std::lower_bound(orientations.begin(), orientations.end(), time_s,
                       [](const RecordedOrientation& at, double time) { return at.time_s < time; });
  const RecordedOrientation* best = nullptr;
  for (auto at : {next, next == orientations.begin() ? next : std::prev(next)}) {
    if (at == orientations.end()) continue;
    const double distance = std::abs(at->time_s - time_s);
    if (distance <= tolerance_s) {
      best = &*at;
      tolerance_s = distance;
    }
  }
  return best;
}

// The time between two frames, most of which are neighbours.
double period_of(const std::vector<RecordedOrientation>& orientations) {
  std::vector<double> steps;
  for (std::size_t i = 1; i < orientations.size(); ++i) {
    steps.push_back(orientations[i].time_s - orientations[i - 1].time_s);
  }
  return steps.empty() ? 0 : median(steps);
}

void summarize(TagRowResult* row) {
  const auto count = static_cast<double>(row->places.size());
  const auto component = [&](int axis) {
    std::vector<double> values;
    for (const Vector2d& place : row->places) values.push_back(place[axis]);
    return values;
  };
  Vector2d middle;
  for (int axis = 0; axis < 2; ++axis) {
    const std::vector<double> values = component(axis);
    const double average = mean(values);
    double squares = 0;
    for (const double value : values) squares += (value - average) * (value - average);
    row->deviation[axis] = std::sqrt(squares / (count - 1));
    middle[axis] = median(values);
  }
  row->total = row->deviation.norm();
  std::vector<double> distances;
  for (const Vector2d& place : row->places) distances.push_back((place - middle).norm());
  row->median_distance = median(distances);
}

}  // namespace

double TagScatter::beyond(const TagRowResult& row, const TagRowResult& noise) {
  return std::sqrt(std::max(0.0, row.total * row.total - noise.total * noise.total));
}

bool scatter_of(const std::vector<TagSighting>& sightings, const std::vector<TagRow>& rows,
                std::size_t reference, TagScatter* scatter, std::string* error) {
  const std::vector<RecordedOrientation>& frames = rows.at(reference).orientations;
  // Nearer to a frame than to its neighbours, with room for what two frame clocks disagree by.
  const double tolerance_s = 0.4 * period_of(frames);
  *scatter = {};
  for (const TagRow& row : rows) {
    TagRowResult result;
    result.name = row.name;
    scatter->rows.push_back(std::move(result));
  }

  struct Common {
    const RecordedOrientation* orientation;
    double distance;
  };
  Common common{nullptr, std::numeric_limits<double>::infinity()};
  std::vector<std::vector<Vector3d>> centres;    // of each frame, each row
  std::vector<std::vector<Vector2d>> variances;  // told, px^2
  for (const TagSighting& sighting : sightings) {
    const auto frame =
        std::find_if(frames.begin(), frames.end(),
                     [&](const RecordedOrientation& at) { return at.frame == sighting.frame; });
    if (frame == frames.end()) continue;
    std::vector<Vector3d> of_rows;
    std::vector<Vector2d> told;
    for (const TagRow& row : rows) {
      const RecordedOrientation* seen = nearest(row.orientations, frame->time_s, tolerance_s);
      const auto centre = seen != nullptr ? centre_of(sighting.corners, *seen) : std::nullopt;
      if (!centre) break;
      of_rows.push_back(*centre);
      // A turn about the camera's x axis moves the image along v, one about y along u.
      const double f = frame->camera.focal_length;
      told.push_back(
          Vector2d(f * seen->sigma_rad.y(), f * frame->camera.aspect * seen->sigma_rad.x())
              .cwiseAbs2());
    }
    if (of_rows.size() < rows.size()) continue;
    Vector2d middle = Vector2d::Zero();
    for (const Vector2d& corner : sighting.corners) middle += corner / 4;
    const double distance =
        (middle - 0.5 * Vector2d(frame->camera.width, frame->camera.height)).norm();
    if (distance < common.distance) common = {&*frame, distance};
    scatter->frames.push_back(sighting.frame);
    centres.push_back(std::move(of_rows));
    variances.push_back(std::move(told));
  }
  if (scatter->frames.size() < kLeastFrames) {
    *error = "the tag was found in " + std::to_string(sightings.size()) + " frames, " +
             std::to_string(scatter->frames.size()) +
             " of which have an orientation in every row; " + std::to_string(kLeastFrames) +
             " are needed";
    return false;
  }

  const RecordedOrientation& into = *common.orientation;
  scatter->common_frame = into.frame;
  for (std::size_t r = 0; r < rows.size(); ++r) {
    TagRowResult& result = scatter->rows[r];
    Vector2d variance = Vector2d::Zero();
    for (std::size_t i = 0; i < centres.size(); ++i) {
      Vector2d place;
      const ProjectionStatus status = rolling_shutter_project(
          into.camera, into.mechanics, into.line_delay, into.motion, centres[i][r], &place);
      if (status != ProjectionStatus::kOk) {
        *error = result.name + ": the tag of frame " + std::to_string(scatter->frames[i]) +
                 " has no place in frame " + std::to_string(into.frame) + ": " + to_string(status);
        return false;
      }
      result.places.push_back(place);
      variance += variances[i][r] / static_cast<double>(centres.size());
    }
    result.told = variance.cwiseSqrt();
    summarize(&result);
  }
  return true;
}

bool read_orientations(const std::string& file, const std::string& mode,
                       const Calibration& calibration,
                       std::vector<RecordedOrientation>* orientations, std::string* error) {
  std::ifstream stream(file);
  if (!stream) {
    *error = file + ": cannot be read";
    return false;
  }
  orientations->clear();
  std::string line;
  for (int number = 1; std::getline(stream, line); ++number) {
    try {
      const nlohmann::json record = nlohmann::json::parse(line);
      if (record.at("mode") != mode) continue;
      const auto value = [&](const char* name) { return record.at(name).get<double>(); };
      RecordedOrientation at;
      at.frame = record.at("frame").get<std::int64_t>();
      at.time_s = value("time_s");
      at.camera = calibration.camera;
      at.camera.focal_length = value("focal_length_px");
      at.camera.aspect = value("aspect");
      at.camera.distortion.radial = value("radial_distortion");
      at.mechanics = calibration.mechanics;
      at.line_delay = value("line_delay_s");
      at.motion.angle = {value("pan_rad"), value("tilt_rad")};
      at.motion.rate = {value("pan_rate_rad_s"), value("tilt_rate_rad_s")};
      at.motion.acceleration = {value("pan_acceleration_rad_s2"),
                                value("tilt_acceleration_rad_s2")};
      const nlohmann::json& sigma = record.at("orientation_sigma_rad");
      at.sigma_rad = {sigma.at(0).get<double>(), sigma.at(1).get<double>()};
      // A frame clock that began anew may step back by a little.
      if (!orientations->empty() && at.time_s <= orientations->back().time_s) continue;
      orientations->push_back(at);
    } catch (const nlohmann::json::exception& flaw) {
      *error = file + ":" + std::to_string(number) + ": not a record of alidade: " + flaw.what();
      return false;
    }
  }
  return true;
}

bool read_true_orientations(const std::string& directory,
                            std::vector<RecordedOrientation>* orientations, std::string* error) {
  Calibration calibration;
  if (!load_calibration(directory + "/truth.yaml", &calibration, error)) return false;
  struct Angles {
    double time_s;
    Vector2d angle;
  };
  std::vector<Angles> path;
  const std::vector<CsvColumn> columns{
      {"time_s", true, false}, {"pan_rad", true, false}, {"tilt_rad", true, false}};
  const auto add_row = [&](const CsvCells& cells) {
    path.push_back({*cells[0], {*cells[1], *cells[2]}});
    return std::string();
  };
  if (!read_csv(directory + "/truth.csv", columns, add_row, error)) return false;

  orientations->clear();
  for (std::size_t i = 2; i + 2 < path.size(); ++i) {
    const double h = (path[i + 2].time_s - path[i - 2].time_s) / 4;
    std::array<Vector2d, 5> a;
    bool even = true;  // a lost frame leaves no even neighbourhood
    for (std::size_t n = 0; n < 5; ++n) {
      const Angles& at = path[i - 2 + n];
      a.at(n) = minus(PanTilt<double>{at.angle.x(), at.angle.y()},
                      PanTilt<double>{path[i].angle.x(), path[i].angle.y()});
      even = even &&
             std::abs(at.time_s - path[i].time_s - (static_cast<double>(n) - 2) * h) < 0.01 * h;
    }
    if (!even) continue;
    const Vector2d rate = (a[0] - 8 * a[1] + 8 * a[3] - a[4]) / (12 * h);
    const Vector2d acceleration = (-a[0] + 16 * a[1] - 30 * a[2] + 16 * a[3] - a[4]) / (12 * h * h);
    RecordedOrientation at;
    at.frame = static_cast<std::int64_t>(i);
    at.time_s = path[i].time_s - calibration.clock_offset;
    at.camera = calibration.camera;
    at.mechanics = calibration.mechanics;
    at.line_delay = calibration.line_delay;
    at.motion.angle = {path[i].angle.x(), path[i].angle.y()};
    at.motion.rate = {rate.x(), rate.y()};
    at.motion.acceleration = {acceleration.x(), acceleration.y()};
    orientations->push_back(at);
  }
  return true;
}

Table tag_table(const TagScatter& scatter, const TagRowResult* noise) {
  Table table;
  table.title = "The tag of " + std::to_string(scatter.frames.size()) +
                " frames in one common frame (" + std::to_string(scatter.common_frame) + "), px";
  table.header = {
      "", "std u", "std v", "total", "median distance", "beyond detector", "told by sigma"};
  for (const TagRowResult& row : scatter.rows) {
    const bool is_noise = &row == noise;
    table.rows.push_back(
        {row.name, number(row.deviation.x()), number(row.deviation.y()), number(row.total),
         number(row.median_distance),
         noise != nullptr && !is_noise ? number(TagScatter::beyond(row, *noise)) : "",
         is_noise ? "" : number(row.told.norm())});
  }
  table.notes = {
      "total: root of the sum of both variances; beyond detector: root of total^2 less the "
      "detector's."};
  return table;
}

nlohmann::json to_json(const TagScatter& scatter, const TagRowResult* noise) {
  nlohmann::json rows = nlohmann::json::array();
  for (const TagRowResult& row : scatter.rows) {
    nlohmann::json places = nlohmann::json::array();
    for (const Vector2d& place : row.places) places.push_back({place.x(), place.y()});
    nlohmann::json object{{"name", row.name},
                          {"frames", row.places.size()},
                          {"std_u_px", row.deviation.x()},
                          {"std_v_px", row.deviation.y()},
                          {"total_px", row.total},
                          {"median_distance_px", row.median_distance},
                          {"told_u_px", row.told.x()},
                          {"told_v_px", row.told.y()},
                          {"places", places}};
    if (noise != nullptr && &row != noise) {
      object["beyond_detector_px"] = TagScatter::beyond(row, *noise);
    }
    rows.push_back(std::move(object));
  }
  return {{"common_frame", scatter.common_frame}, {"frames", scatter.frames}, {"rows", rows}};
}

}  // namespace alidade::test
