#include "test/accuracy/map_pictures.h"

#include <sys/resource.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <cmath>
#include <ctime>
#include <map>
#include <numeric>
#include <ostream>
#include <random>

#include "core/mapping/localization.h"
#include "core/mapping/map_building.h"
#include "test/accuracy/disturbed_picture.h"
#include "test/accuracy/rendered_stills.h"
#include "test/accuracy/statistics.h"
#include "test/accuracy/table.h"

namespace alidade::test {
namespace {

double cpu_seconds() {
  return static_cast<double>(std::clock()) / static_cast<double>(CLOCKS_PER_SEC);
}

// Of the process so far, MiB.
double peak_memory() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

Eigen::Vector3d rotation_vector(const Eigen::Matrix3d& R) {
  const Eigen::AngleAxisd turn(R);
  return turn.angle() * turn.axis();
}

// What a data sheet says that the lens has at a view's focal length: wrong, but smooth.
double sheet_log_f(const StillView& view, double sheet_error) {
  const double log_f = std::log(view.focal_length);
  return log_f + sheet_error * std::sin(1.3 * log_f);
}

struct PixelErrors {
  double direction_px = 0;  // rms over the image of the directions of pixels, in base
  double rotation_px = 0;   // of what the orientation alone moves pixels by
};

// common: R_map_from_truth.
PixelErrors pixel_errors(const Eigen::Matrix3d& R_true, const simulator::Lens& lens,
                         const Eigen::Matrix3d& R_found, const Camera<double>& camera,
                         const Eigen::Matrix3d& common) {
  PixelErrors out;
  const Eigen::Vector3d xi = rotation_vector(R_true.transpose() * common.transpose() * R_found);
  int count = 0;
  for (int row = 0; row < 5; ++row) {
    for (int column = 0; column < 7; ++column) {
      const Eigen::Vector2d u(camera.width * (column + 0.5) / 7, camera.height * (row + 0.5) / 5);
      const Eigen::Vector3d d = lens.slope(u.x(), u.y()).homogeneous().normalized();
      Vector3<double> d_found;
      ++count;
      if (unproject(camera, u, &d_found) != ProjectionStatus::kOk) {
        out.direction_px = HUGE_VAL;
        continue;
      }
      out.direction_px += (common.transpose() * R_found * d_found - R_true * d).squaredNorm();
      out.rotation_px += xi.cross(d).squaredNorm();
    }
  }
  out.direction_px = lens.focal_length * std::sqrt(out.direction_px / count);
  out.rotation_px = lens.focal_length * std::sqrt(out.rotation_px / count);
  return out;
}

// The turn that all keyframes have in common, each weighted by how finely it sees; pictures: of each keyframe.
Eigen::Matrix3d common_turn(const RenderedStills& stills, const std::vector<int>& pictures,
                            const SceneMap& map) {
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  for (int step = 0; step < 5; ++step) {
    Eigen::Matrix3d N = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const simulator::Lens lens = stills.lens(pictures[i]);
      const double weight = lens.focal_length * lens.focal_length;
      for (const double share : {0.25, 0.75}) {
        const Eigen::Vector2d u(share * map.lens.width(), (1 - share) * map.lens.height());
        const Eigen::Vector3d d = R * stills.base_from_camera(pictures[i]) *
                                  lens.slope(u.x(), u.y()).homogeneous().normalized();
        Vector3<double> d_found;
        if (unproject(map.camera_of(map.keyframes[i]), u, &d_found) != ProjectionStatus::kOk) {
          continue;
        }
        const Eigen::Matrix3d J = -skew(Vector3<double>(d));
        N += weight * J.transpose() * J;
        b += weight * J.transpose() *
             (map.keyframes[i].R_base_from_camera.toRotationMatrix() * d_found - d);
      }
    }
    R = exp_so3(Vector3<double>(N.ldlt().solve(b))) * R;
  }
  return R;
}

MapBuilder add_stills(const RenderedStills& stills, const std::vector<int>& pictures,
                      const MapPicturesOptions& options, double* feature_s, std::ostream& out) {
  MapBuildOptions build;
  build.width = stills.config().image.width;
  build.height = stills.config().image.height;
  build.mechanics = Mechanics<double>();
  MapBuilder builder(build);
  std::mt19937_64 random(options.seed + 100);
  std::normal_distribution<double> normal;
  FeatureOptions of_features;
  of_features.max_features = options.features;
  const FeatureDetector detector(of_features);
  for (const int i : pictures) {
    const StillView& still = stills.view(i);
    MapView view;
    view.recording = "stills";
    view.frame = i;
    view.zoom = stills.zoom_reading(i);
    view.log_f = sheet_log_f(still, options.sheet_error);
    if (options.telemetry) {
      const auto noise = [&] {
        return options.angle_noise * normal(random) +
               (random() % 2 == 0 ? options.backlash : -options.backlash) / 2;
      };
      view.telemetry = PanTilt<double>{still.pan + noise(), still.tilt + noise()};
      view.angle_sigma = std::hypot(options.angle_noise, options.backlash / 2);
    }
    const cv::Mat image = stills.image(i);
    const double begin = cpu_seconds();
    FeatureSet features =
        detector.find(image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step));
    *feature_s += cpu_seconds() - begin;
    builder.add(view, std::move(features));
  }
  out << pictures.size() << " pictures, features " << number(*feature_s, 3) << " s CPU"
      << std::endl;
  return builder;
}

// Normalised square of each keyframe's errors; the common turn is not known to the map.
double normalised_square(const Eigen::Matrix3d& R_true, double f_true, const SceneKeyframe& k,
                         double f_found, const Eigen::Matrix3d& common) {
  Eigen::Vector4d error;
  error << rotation_vector(R_true.transpose() * common.transpose() *
                           k.R_base_from_camera.toRotationMatrix()),
      std::log(f_found / f_true);
  return error.dot(k.covariance.ldlt().solve(error));
}

struct Level {
  std::vector<double> log_f, direction, rotation;
};

// pictures: of each keyframe.
void judge_map(const RenderedStills& stills, const std::vector<int>& pictures,
               const MapBuild& build, const Eigen::Matrix3d& common, std::ostream& out,
               std::vector<std::string>* missed) {
  std::map<int, Level> levels;
  std::vector<double> squares;
  std::vector<double> all_f;
  for (std::size_t i = 0; i < build.map.keyframes.size(); ++i) {
    const SceneKeyframe& k = build.map.keyframes[i];
    const int still = pictures[i];
    const Eigen::Matrix3d R = stills.base_from_camera(still);
    const simulator::Lens lens = stills.lens(still);
    const Camera<double> camera = build.map.camera_of(k);
    const PixelErrors errors =
        pixel_errors(R, lens, k.R_base_from_camera.toRotationMatrix(), camera, common);
    Level& level = levels[static_cast<int>(
        std::lround(std::log2(stills.view(still).focal_length / kWidestFocalLength_px)))];
    level.log_f.push_back(std::abs(std::log(camera.focal_length / lens.focal_length)));
    level.direction.push_back(errors.direction_px);
    level.rotation.push_back(errors.rotation_px);
    all_f.push_back(level.log_f.back());
    squares.push_back(normalised_square(R, lens.focal_length, k, camera.focal_length, common));
  }
  Table table;
  table.title = "map (median / largest)";
  table.header = {"level", "keyframes", "f, relative", "pixels in base, px", "rotation, px"};
  const auto both = [](const std::vector<double>& x) {
    return number(median(x), 2) + " / " + number(largest(x), 2);
  };
  const auto expect = [missed](const std::string& what, double value, double most) {
    if (!(value <= most)) {
      missed->push_back(what + " " + number(value, 3) + " > " + number(most, 3));
    }
  };
  for (const auto& [level, at] : levels) {
    const std::string name = "level " + std::to_string(level + 1);
    table.rows.push_back({name, std::to_string(at.log_f.size()), both(at.log_f), both(at.direction),
                          both(at.rotation)});
    expect(name + ": largest relative error of f", largest(at.log_f), 1e-4);
    expect(name + ": median relative error of f", median(at.log_f), 2e-5);
    expect(name + ": largest error of pixels' directions, px", largest(at.direction), 0.1);
    expect(name + ": largest error of rotation, px", largest(at.rotation),
           level + 1 == kStillLevels ? 0.3 : 0.15);
  }
  const Interval interval = mean_square_interval(4 * static_cast<int>(squares.size()), 0.95);
  table.notes.push_back("f of all: " + both(all_f));
  table.notes.push_back("the lens's hold " + number(build.map.lens.hold(), 3) + ", its sigma " +
                        number(build.hold_sigma, 2));
  table.notes.push_back("NEES per number, mean " + number(mean(squares) / 4, 3) + ", median " +
                        number(median(squares) / 4, 3) + " (of independent ones 95 %: " +
                        number(interval.low, 3) + " to " + number(interval.high, 3) + ")");
  table.print(out);
}

struct Localizations {
  std::vector<double> error_px, f, feature_s, find_s, squares, matches;
  int asked = 0;
  int right = 0;
  int wrong = 0;  // and believed
};

// Right is what is off by less than this, px.
constexpr double kRight_px = 5;

void print_localizations(const std::string& name, const Localizations& l, double most_ms,
                         std::ostream& out, std::vector<std::string>* missed) {
  std::vector<double> total;
  for (std::size_t i = 0; i < l.find_s.size(); ++i) {
    total.push_back(1e3 * (l.find_s[i] + l.feature_s[i]));
  }
  out << name << ": " << l.right << " of " << l.asked << " right, " << l.wrong
      << " wrong believed; error " << number(median(l.error_px), 3) << " px median, "
      << number(largest(l.error_px), 3) << " largest; f " << number(median(l.f), 2) << " median, "
      << number(largest(l.f), 2) << " largest; NEES per number " << number(median(l.squares) / 4, 3)
      << " median, " << number(mean(l.squares) / 4, 3) << " mean; matches "
      << number(median(l.matches), 3) << " median; " << number(median(total), 3)
      << " ms median CPU, " << number(largest(total), 3) << " largest, of which features "
      << number(1e3 * median(l.feature_s), 3) << std::endl;
  if (l.right < 0.99 * l.asked) missed->push_back(name + ": right " + std::to_string(l.right));
  if (l.wrong > 0) missed->push_back(name + ": wrong believed " + std::to_string(l.wrong));
  if (!(median(l.error_px) <= 0.3)) missed->push_back(name + ": error");
  if (!(median(total) <= most_ms)) {
    missed->push_back(name + ": " + number(median(total), 3) + " ms > " + number(most_ms, 3));
  }
}

void localize_views(const RenderedStills& stills, int first, const MapPicturesOptions& options,
                    const SceneMap& map, const Eigen::Matrix3d& common, std::ostream& out,
                    std::vector<std::string>* missed) {
  const double begin = cpu_seconds();
  const Localizer localizer(map);
  out << "localizer made in " << number(cpu_seconds() - begin, 3) << " s\n";
  struct Way {
    const char* name;
    bool hint;
    FeatureOptions features;
    double most_ms;
  };
  const std::vector<Way> ways = {{"without telemetry", false, localization_features(false), 150},
                                 {"with telemetry", true, localization_features(true), 60}};
  for (const Way& way : ways) {
    const FeatureDetector detector(way.features);
    std::mt19937_64 random(options.seed + 7);
    std::normal_distribution<double> normal;
    Localizations result;
    int believed_elsewhere = 0;
    for (int n = 0; n < options.views; ++n) {
      const int i = first + n * (stills.size() - first) / options.views;
      const cv::Mat image = disturbed(stills.image(i), &random);
      LocalizationHint hint;
      const StillView& view = stills.view(i);
      if (way.hint) {
        const double sigma = 1e-3;
        hint.R_base_from_camera = R_base_from_camera(
            Mechanics<double>(),
            PanTilt<double>{view.pan + sigma * normal(random), view.tilt + sigma * normal(random)});
        hint.R_sigma = sigma;
        hint.focal_length = FocalLengthPrior{sheet_log_f(view, options.sheet_error), 0.01};
      }
      double before = cpu_seconds();
      const FeatureSet features = detector.find(image.data, image.cols, image.rows,
                                                static_cast<std::ptrdiff_t>(image.step));
      const double feature_s = cpu_seconds() - before;
      before = cpu_seconds();
      const Localization found = localizer.find(features, hint);
      result.find_s.push_back(cpu_seconds() - before);
      result.feature_s.push_back(feature_s);
      ++result.asked;
      if (found.status == LocalizationStatus::kOk) {
        const simulator::Lens lens = stills.lens(i);
        const Eigen::Matrix3d R = stills.base_from_camera(i);
        const PixelErrors errors =
            pixel_errors(R, lens, found.pose.R_base_from_camera, found.pose.camera, common);
        (errors.direction_px < kRight_px ? result.right : result.wrong) += 1;
        result.error_px.push_back(errors.direction_px);
        result.f.push_back(std::abs(std::log(found.pose.camera.focal_length / lens.focal_length)));
        result.matches.push_back(found.matches);
        Eigen::Vector4d error;
        error << rotation_vector(R.transpose() * common.transpose() *
                                 found.pose.R_base_from_camera),
            std::log(found.pose.camera.focal_length / lens.focal_length);
        result.squares.push_back(error.dot(found.pose.covariance.ldlt().solve(error)));
      } else {
        out << "  " << way.name << ": view " << i << " of f " << number(view.focal_length, 4)
            << " px: " << to_string(found.status) << ", " << to_string(found.pose.status) << ", "
            << features.size() << " features\n";
      }
      const cv::Mat other = elsewhere(stills.image(i), n % 3, &random);
      const FeatureSet none = detector.find(other.data, other.cols, other.rows,
                                            static_cast<std::ptrdiff_t>(other.step));
      if (localizer.find(none, hint).status == LocalizationStatus::kOk) ++believed_elsewhere;
    }
    if (result.error_px.empty()) {
      missed->push_back(std::string(way.name) + ": nothing localized");
      continue;
    }
    print_localizations(way.name, result, way.most_ms, out, missed);
    out << "  of as many mirrored, in fog and at night " << believed_elsewhere << " believed\n";
    if (believed_elsewhere > 0) missed->push_back(std::string(way.name) + ": others believed");
  }
}

}  // namespace

std::vector<std::string> run_map_pictures(const MapPicturesOptions& options, std::ostream& out) {
  std::vector<std::string> missed;
  std::vector<StillView> views = map_views(options.columns);
  const int in_map = static_cast<int>(views.size());
  const std::vector<StillView> others = random_views(500, options.seed + 6);
  views.insert(views.end(), others.begin(), others.end());
  const RenderedStills stills(views, options.seed, options.cache);

  double feature_s = 0;
  std::vector<int> added(static_cast<std::size_t>(in_map));
  std::iota(added.begin(), added.end(), 0);
  for (int n = 0; n < options.more; ++n) {
    added.push_back(in_map + n * static_cast<int>(others.size()) / options.more);
  }
  const MapBuilder builder = add_stills(stills, added, options, &feature_s, out);
  const double begin = cpu_seconds();
  double before = begin;
  std::string doing;
  const MapBuild build = builder.build([&](double, const char* what) {
    if (doing == what) return;
    if (!doing.empty()) out << "  " << doing << ": " << number(cpu_seconds() - before, 3) << " s\n";
    doing = what;
    before = cpu_seconds();
  });
  out << "map: " << to_string(build.status) << " (" << to_string(build.adjustment) << "), "
      << build.compared << " twos compared, " << build.linked << " linked, " << build.tracks
      << " tracks, " << build.observations << " observations, " << build.map.landmarks.size()
      << " landmarks, residual " << number(build.residual_px, 3) << " px, noise "
      << number(build.noise_scale, 3) << ", " << build.steps << " steps, "
      << number(cpu_seconds() - begin, 3) << " s CPU; at most " << number(peak_memory(), 3)
      << " MiB, which tells something where no picture had to be rendered\n";
  if (build.status != MapBuildStatus::kOk) {
    missed.push_back(std::string("the map: ") + to_string(build.status));
    return missed;
  }
  if (build.map.keyframes.size() != added.size()) {
    missed.push_back("keyframes: " + std::to_string(build.map.keyframes.size()));
  }
  std::vector<int> pictures;
  for (const int i : build.of_keyframe) pictures.push_back(added[static_cast<std::size_t>(i)]);
  const Eigen::Matrix3d common = common_turn(stills, pictures, build.map);
  out << "common turn " << number(rotation_vector(common).norm() * 1e3, 3) << " mrad\n";
  judge_map(stills, pictures, build, common, out, &missed);
  std::string flaw;
  if (!is_valid(build.map, &flaw)) missed.push_back("the map is not valid: " + flaw);
  if (options.views > 0) {
    localize_views(stills, in_map, options, build.map, common, out, &missed);
  }
  return missed;
}

}  // namespace alidade::test
