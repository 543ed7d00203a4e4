// The virtual camera's pictures against an independent witness: AprilTags in the scene, found in
// rendered frames by the AprilTag library, must lie where the truth says.
//
// The truth's place is computed here by a route of its own: the formulas of the model written out
// once more (of a zoom's lens, what truth.csv would tell at the row's time), and for the rolling shutter a search through the rows for the one that is exposed while
// the point lies on it. As a tag's edges are curved by lens and motion, the place expected of a tag is
// made as the detector makes it: lines through the four projected edges, their corners, the crossing
// of the diagonals. The library's coordinates have the centre of the top-left pixel at (0.5, 0.5).

#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "test/simulator/renderer.h"
#include "test/support/temporary_directory.h"

namespace alidade::simulator {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr int kPhotoSize = 480;       // px of a tag's photo
constexpr double kHalfTag = 0.3;      // half a tag's black square, in widths of the photo
constexpr double kTagTurn = 0.4;      // rad: oblique edges average the detector's pixel rounding
constexpr double kPhotoPixels = 120;  // width of a tag's photo as rendered
constexpr int kTagsAcross = 3;
constexpr double kBorder = 60;  // px between a tag's centre and the image's border
// The detector rounds to whole pixels where it samples along an edge: on a picture as rendered that
// alone makes errors of 0.05 px rms. From four times enlarged on they stay at 0.006 px.
constexpr double kEnlarged = 4;

Matrix3d about(const Vector3d& axis, double angle) {
  Matrix3d cross;
  cross << 0, -axis.z(), axis.y(), axis.z(), 0, -axis.x(), -axis.y(), axis.x(), 0;
  return Matrix3d::Identity() + std::sin(angle) * cross + (1 - std::cos(angle)) * cross * cross;
}

struct Case {
  const char* name;
  double focal_length, aspect, k;
  double line_delay;  // s
  double amplitude;   // of the path; 0 = at rest
  double exposure;    // s
  // 0: no zoom; else the focal length is that at kMoment, of a zoom at rest (1) or of one that goes to so many times it in 2 s.
  double zoom_factor = 0;
};

constexpr double kMoment = 1;  // s, the middle of a sweep, when the path moves

Config config_of(const Case& test_case) {
  Config config;
  config.image = {640, 480, 25};
  config.duration = 4;
  config.camera.focal_length = test_case.focal_length;
  config.camera.aspect = test_case.aspect;
  config.camera.radial_distortion = test_case.k;
  config.camera.line_delay = test_case.line_delay;
  config.camera.pan_axis_offset = {-0.012, 0.004};
  config.camera.tilt_axis_offset = {0.006, 0.014};
  config.path.amplitude = test_case.amplitude;
  config.path.period = 6;
  config.path.pan = 0.5;
  config.path.tilt = -0.1;
  config.sensor.exposure = test_case.exposure;
  config.scene.background = 1;
  config.scene.detail = 0;
  if (test_case.zoom_factor == 0) return config;
  config.path.focal_length = test_case.focal_length;
  ZoomConfig& zoom = config.zoom.emplace();
  zoom.focal_length = {test_case.focal_length / 4, test_case.focal_length * 5};
  zoom.distortion = {-0.03, 0.02};
  zoom.centre = {5, -3};
  zoom.centre_wander = 10;
  zoom.sigma_rep = 2e-3;
  zoom.backlash = 1e-3;
  zoom.speed = 1.5;
  zoom.acceleration = 10;
  const ZoomCurve curve(zoom);
  const double start = test_case.focal_length / std::sqrt(test_case.zoom_factor);
  zoom.path.reading = curve.reading(curve.part_at(std::log(start)));
  if (test_case.zoom_factor == 1) return config;
  zoom.path.type = ZoomPathConfig::Type::kSweep;
  zoom.path.factor = test_case.zoom_factor;
  zoom.path.duration = 2 * kMoment;
  return config;
}

// The model once more, from its formulas.
class Truth {
 public:
  explicit Truth(const Config& config) : config_(config), zoom_(make_zoom(config)) {
    const CameraConfig& camera = config.camera;
    pan_axis_ = bent(Vector3d(0, 0, 1),
                     Vector3d(camera.pan_axis_offset.x(), camera.pan_axis_offset.y(), 0));
    tilt_axis_ = bent(Vector3d(0, 1, 0),
                      Vector3d(camera.tilt_axis_offset.x(), 0, camera.tilt_axis_offset.y()));
  }

  Matrix3d base_from_camera(double time) const {
    const double f = zoom_ ? config_.path.focal_length : config_.camera.focal_length;
    const double s = 2 * std::atan(config_.image.width / 2.0 / f);
    const double a = config_.path.amplitude * s / (2 * kPi);
    const double phase = 2 * kPi * time / config_.path.period;
    Matrix3d frd_from_rdf;
    frd_from_rdf << 0, 0, 1, 1, 0, 0, 0, 1, 0;
    return about(pan_axis_, config_.path.pan + 9 * a * std::sin(phase)) *
           about(tilt_axis_, config_.path.tilt - 3 * a * std::cos(3 * phase)) * frd_from_rdf;
  }

  Vector2d pixel_at(const Vector3d& d_base, double time) const {
    const Vector3d d = base_from_camera(time).transpose() * d_base;
    const double x = d.x() / d.z();
    const double y = d.y() / d.z();
    double f = config_.camera.focal_length;
    double k = config_.camera.radial_distortion;
    Vector2d centre(config_.image.width / 2.0, config_.image.height / 2.0);
    if (zoom_) {
      const Lens lens = zoom_->lens(time);
      f = lens.focal_length;
      k = lens.radial_distortion;
      centre = lens.centre;
    }
    const double radial = 1 + k * (x * x + y * y);
    return {f * x * radial + centre.x(), config_.camera.aspect * f * y * radial + centre.y()};
  }

  // Every row in turn: on which is the point while that row is exposed?
  Vector2d pixel(const Vector3d& d_base, double t0) const {
    const auto below = [&](double row) {
      return pixel_at(d_base, t0 + row * config_.camera.line_delay).y() - row;
    };
    for (int row = -20; row < config_.image.height + 20; ++row) {
      const double first = below(row);
      const double second = below(row + 1);
      if (first >= 0 && second < 0) {
        const double exact = row + first / (first - second);
        return pixel_at(d_base, t0 + exact * config_.camera.line_delay);
      }
    }
    return Vector2d::Constant(std::nan(""));
  }

 private:
  static Vector3d bent(const Vector3d& axis, const Vector3d& offset) {
    return axis * std::cos(offset.norm()) + offset / offset.norm() * std::sin(offset.norm());
  }

  Config config_;
  std::optional<Zoom> zoom_;
  Vector3d pan_axis_, tilt_axis_;
};

struct Line {
  Vector2d point, along;
};

Line line_through(const std::vector<Vector2d>& points) {
  Vector2d mean = Vector2d::Zero();
  for (const Vector2d& point : points) mean += point / static_cast<double>(points.size());
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const Vector2d& point : points) scatter += (point - mean) * (point - mean).transpose();
  return {
      mean,
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>().computeDirect(scatter).eigenvectors().col(
          1)};
}

Vector2d crossing(const Line& a, const Line& b) {
  Eigen::Matrix2d system;
  system << a.along, -b.along;
  const Vector2d lengths = system.inverse() * (b.point - a.point);
  return a.point + a.along * lengths.x();
}

// Corner i of a tag, in tangents from the photo's centre (right, down).
Vector2d tag_corner(int i, double photo_tangent) {
  const double angle = kTagTurn + kPi / 4 + i * kPi / 2;
  return std::sqrt(2.0) * kHalfTag * photo_tangent * Vector2d(std::cos(angle), std::sin(angle));
}

struct Tag {
  Vector2d centre;
  std::array<Vector2d, 4> corners;  // in some order
};

Tag expected_tag(const Truth& truth, const PatchConfig& patch, double t0) {
  const double photo_tangent = 2 * std::tan(patch.width / 2);
  const double a = patch.azimuth;
  const double e = patch.elevation;
  const Vector3d outward(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), -std::sin(e));
  const Vector3d right(-std::sin(a), std::cos(a), 0);
  const Vector3d down = outward.cross(right);
  std::array<Line, 4> edges;
  for (int i = 0; i < 4; ++i) {
    const Vector2d from = tag_corner(i, photo_tangent);
    const Vector2d to = tag_corner(i + 1, photo_tangent);
    std::vector<Vector2d> points;
    for (int step = 0; step < 16; ++step) {
      const Vector2d point = from + (to - from) * ((step + 0.5) / 16);
      points.push_back(truth.pixel(outward + point.x() * right + point.y() * down, t0));
    }
    edges.at(static_cast<std::size_t>(i)) = line_through(points);
  }
  std::array<Vector2d, 4> corners;
  for (std::size_t i = 0; i < 4; ++i) corners.at(i) = crossing(edges.at(i), edges.at((i + 3) % 4));
  return {crossing({corners[0], corners[2] - corners[0]}, {corners[1], corners[3] - corners[1]}),
          corners};
}

double distance_to_nearest(const Vector2d& point, const std::array<Vector2d, 4>& places) {
  double least = (point - places[0]).norm();
  for (const Vector2d& place : places) least = std::min(least, (point - place).norm());
  return least;
}

class AprilTags : public testing::TestWithParam<Case> {
 protected:
  AprilTags() : family_(tag36h11_create()), detector_(apriltag_detector_create()) {
    apriltag_detector_add_family(detector_, family_);
    detector_->quad_decimate = 1;
  }
  ~AprilTags() override {
    apriltag_detector_destroy(detector_);
    tag36h11_destroy(family_);
  }

  // A photo of tag `id`, turned by kTagTurn, on white.
  std::string draw(int id) {
    image_u8_t* tag = apriltag_to_image(family_, id);
    const double cell = 2 * kHalfTag * kPhotoSize / family_->width_at_border;
    cv::Mat photo(kPhotoSize, kPhotoSize, CV_8U);
    for (int y = 0; y < kPhotoSize; ++y) {
      for (int x = 0; x < kPhotoSize; ++x) {
        int sum = 0;
        for (int sample = 0; sample < 16; ++sample) {
          const Vector2d from_centre(x + (sample % 4 + 0.5) / 4 - kPhotoSize / 2.0,
                                     y + (sample / 4 + 0.5) / 4 - kPhotoSize / 2.0);
          const Eigen::Rotation2Dd turn(-kTagTurn);
          const Vector2d in_tag =
              (turn * from_centre) / cell + Vector2d::Constant(tag->width / 2.0);
          const int column = static_cast<int>(std::floor(in_tag.x()));
          const int row = static_cast<int>(std::floor(in_tag.y()));
          const bool inside = column >= 0 && row >= 0 && column < tag->width && row < tag->height;
          sum += inside ? tag->buf[row * tag->stride + column] : 255;
        }
        photo.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(20 + sum / 16 * 200 / 255);
      }
    }
    // What image_u8_destroy() does; the shared library does not export it.
    std::free(tag->buf);
    std::free(tag);
    const std::string file = directory_.path() + "/tag" + std::to_string(id) + ".png";
    cv::imwrite(file, photo);
    return file;
  }

  // The tags found, by number.
  std::map<int, Tag> detect(std::vector<std::uint8_t> image, const ImageConfig& size) {
    const cv::Mat rendered(size.height, size.width, CV_8U, image.data());
    cv::Mat enlarged;
    cv::resize(rendered, enlarged, {}, kEnlarged, kEnlarged, cv::INTER_CUBIC);
    image_u8_t view{enlarged.cols, enlarged.rows, enlarged.cols, enlarged.data};
    zarray_t* found = apriltag_detector_detect(detector_, &view);
    std::map<int, Tag> tags;
    for (int i = 0; i < zarray_size(found); ++i) {
      apriltag_detection_t* detection = nullptr;
      zarray_get(found, i, &detection);
      Tag& tag = tags[detection->id];
      tag.centre = Vector2d(detection->c[0], detection->c[1]) / kEnlarged;
      for (std::size_t n = 0; n < 4; ++n) {
        tag.corners.at(n) = Vector2d(detection->p[n][0], detection->p[n][1]) / kEnlarged;
      }
    }
    apriltag_detections_destroy(found);
    return tags;
  }

  TemporaryDirectory directory_;
  apriltag_family_t* family_;
  apriltag_detector_t* detector_;
};

TEST_P(AprilTags, AreFoundWhereTheTruthPutsThem) {
  Config config = config_of(GetParam());
  const double field = horizontal_field_of_view(config);
  const std::unique_ptr<Path> path = make_path(config);
  const Angles middle = config.zoom ? path->at(kMoment) : Angles{config.path.pan, config.path.tilt};
  for (int id = 0; id < kTagsAcross * kTagsAcross; ++id) {
    PatchConfig tag;
    tag.file = draw(id);
    tag.width = kPhotoPixels / GetParam().focal_length;
    tag.azimuth = middle.pan + 0.29 * field * (id % kTagsAcross - 1);
    tag.elevation = middle.tilt + 0.24 * field * (id / kTagsAcross - 1);
    config.scene.photos.push_back(tag);
  }
  const Renderer renderer(config, *path);
  const Truth truth(config);

  int found = 0;
  double squares = 0;
  double corner_squares = 0;
  Vector2d sum = Vector2d::Zero();
  // Moments near the turning points and crossings of the path, when most tags are in view.
  const std::vector<double> times =
      GetParam().zoom_factor == 1 ? std::vector<double>{kMoment}
      : config.zoom               ? std::vector<double>{kMoment - 0.1, kMoment, kMoment + 0.1}
      : config.path.amplitude > 0 ? std::vector<double>{0.02, 0.4, 2.7, 3.3}
                                  : std::vector<double>{0};
  for (const double t0 : times) {
    for (const auto& [id, seen] : detect(renderer.render(t0, 0), config.image)) {
      const PatchConfig& tag = config.scene.photos.at(static_cast<std::size_t>(id));
      const Tag expected = expected_tag(truth, tag, t0);
      // The detector cuts its search for an edge short near the border.
      const Eigen::AlignedBox2d inner(
          Vector2d::Constant(kBorder),
          Vector2d(config.image.width - kBorder, config.image.height - kBorder));
      if (!inner.contains(expected.centre)) continue;
      const Vector2d error = seen.centre - expected.centre;
      EXPECT_LT(error.norm(), 0.05) << "tag " << id << " at " << t0 << " s, " << error.transpose();
      for (const Vector2d& corner : seen.corners) {
        const double off = distance_to_nearest(corner, expected.corners);
        EXPECT_LT(off, 0.05) << "a corner of tag " << id << " at " << t0 << " s";
        corner_squares += off * off;
      }
      sum += error;
      squares += error.squaredNorm();
      ++found;
    }
  }
  // A tag or more of each frame may be out of view.
  ASSERT_GE(found, times.size() > 1 ? 12 : 5);
  EXPECT_LT((sum / found).norm(), 0.01);
  EXPECT_LT(std::sqrt(squares / found), 0.02);
  // Each from two of the four edges, a corner is less certain than the centre.
  EXPECT_LT(std::sqrt(corner_squares / (4 * found)), 0.025);
}

INSTANTIATE_TEST_SUITE_P(
    Scenes, AprilTags,
    testing::Values(Case{"AtRest", 8000, 1, 0, 0, 0, 0},
                    Case{"AtRestWithStrongDistortion", 8000, 1, 30, 0, 0, 0},
                    Case{"NarrowMoving", 8000, 1, 20, 30e-6, 0.5, 0},
                    Case{"NarrowMovingUpsideDown", 8000, 1, 20, -30e-6, 0.5, 0},
                    Case{"NarrowMovingBarrelWithBlur", 8000, 1, -20, 40e-6, 0.5, 4e-3},
                    Case{"PaperCamera", 32008, 1, 55.4, -14.2e-6, 0.5, 0},
                    Case{"WideMoving", 600, 1, 0.1, 30e-6, 0.5, 0},
                    Case{"WideMovingBarrelUpsideDown", 600, 0.98, -0.1, -30e-6, 0.5, 2e-3},
                    Case{"WideZoom", 600, 1, 0, 30e-6, 0.5, 0, 1},
                    Case{"WideZoomingIn", 600, 1, 0, 30e-6, 0.5, 0, 10},
                    Case{"MediumZoom", 3000, 1, 0, 30e-6, 0.5, 0, 1},
                    Case{"MediumZoomingOutUpsideDown", 3000, 1, 0, -30e-6, 0.5, 0, 0.1},
                    Case{"NarrowZoom", 12000, 1.01, 0, 30e-6, 0.5, 0, 1},
                    Case{"NarrowZoomingInUpsideDownWithBlur", 12000, 1.01, 0, -30e-6, 0.5, 4e-3,
                         10}),
    [](const auto& scene) { return std::string(scene.param.name); });

}  // namespace
}  // namespace alidade::simulator
