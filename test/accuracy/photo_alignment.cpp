// alidade_photo_alignment DIR...: patch alignment between neighbouring photos of a camera that turned in
// place, against the homography that SIFT finds between them.
//
// Neighbours are photos that follow each other by name and overlap: 25 features or more agree with
// one homography. FAST corners of the first are looked for in the second from where the homography puts
// them plus 1 px each way, with the homography's derivative as warp, as OE mode would with a known
// camera. SIFT's own error (0.1 to 0.3 px) and what lens and parallax keep from being a homography
// are part of the difference.
// Exit status: 0 every median is below the bound, 1 some are not, 2 wrong usage or unreadable photos.

#include <CLI/CLI.hpp>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <optional>
#include <vector>

#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/image_noise.h"
#include "core/realtime/image/patch_alignment.h"
#include "test/accuracy/matched_homography.h"

namespace alidade::test {
namespace {

constexpr double kBound = 0.3;  // px, of the median

struct Photo {
  cv::Mat image;
  PlacedFeatures features;

  [[nodiscard]] ImageView view() const {
    return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step[0])};
  }
};

Photo read_photo(const std::filesystem::path& file) {
  Photo photo;
  photo.image = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (photo.image.empty()) throw std::runtime_error(file.string() + ": is no picture");
  std::vector<cv::KeyPoint> points;
  cv::SIFT::create()->detectAndCompute(photo.image, cv::noArray(), points,
                                       photo.features.descriptors);
  cv::KeyPoint::convert(points, photo.features.points);
  return photo;
}

// In pixels whose centres are at halves; nothing where the photos hardly overlap.
std::optional<Matrix3<double>> homography(const Photo& from, const Photo& to) {
  const auto found = match_homography(from.features, to.features, 1);
  if (!found) return std::nullopt;
  Matrix3<double> to_halves = Matrix3<double>::Identity();
  to_halves.topRightCorner<2, 1>().setConstant(0.5);
  return to_halves * found->H * to_halves.inverse();
}

struct Differences {
  int pairs = 0;
  int looked_for = 0;
  std::vector<double> px;  // of those found
};

void compare(const Photo& from, const Photo& to, Differences* out) {
  const auto found = homography(from, to);
  if (!found) return;
  const Matrix3<double>& H = *found;
  ++out->pairs;
  FastGrid grid(from.image.cols, from.image.rows, 12);
  std::vector<FastCorner> corners(static_cast<std::size_t>(grid.max_cells()));
  std::vector<float> scratch(2000);
  const double noise = image_noise(from.view(), scratch.data(), static_cast<int>(scratch.size()));
  const FastResult result =
      grid.detect(from.view(), 10, corners.data(), static_cast<int>(corners.size()));
  for (int i = 0; i < result.count; ++i) {
    const FastCorner& corner = corners[static_cast<std::size_t>(i)];
    const Vector2<double> u(corner.u + 0.5, corner.v + 0.5);
    const Vector3<double> projected = H * u.homogeneous();
    const Vector2<double> expected = projected.hnormalized();
    // A patch's width from the border: beyond it the other photo has nothing to show.
    if (projected.z() <= 0 || expected.minCoeff() < kPatchSize ||
        expected.x() > to.image.cols - kPatchSize || expected.y() > to.image.rows - kPatchSize) {
      continue;
    }
    const Matrix2<double> J =
        (H.topLeftCorner<2, 2>() - expected * H.block<1, 2>(2, 0)) / projected.z();
    ReferencePatch patch;
    if (prepare(from.view(), u, J.inverse(), 1.5 * noise, &patch) != PrepareStatus::kOk) continue;
    ++out->looked_for;
    Alignment alignment;
    if (align(patch, to.view(), expected + Vector2<double>(1, 1), {}, &alignment) !=
        AlignmentStatus::kConverged) {
      continue;
    }
    out->px.push_back((alignment.position - expected).norm());
  }
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return NAN;
  const auto at =
      values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace
}  // namespace alidade::test

int main(int argc, char** argv) {
  using namespace alidade::test;
  CLI::App app("Patch alignment between neighbouring photos, against SIFT's homography");
  std::vector<std::string> directories;
  app.add_option("DIR", directories, "folders of photos")
      ->required()
      ->check(CLI::ExistingDirectory);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 2;
  }
  bool ok = true;
  try {
    for (const std::string& directory : directories) {
      std::vector<std::filesystem::path> files;
      for (const auto& entry : std::filesystem::directory_iterator(directory)) {
        if (entry.path().extension() == ".png" || entry.path().extension() == ".jpg") {
          files.push_back(entry.path());
        }
      }
      std::sort(files.begin(), files.end());
      Differences differences;
      std::vector<Photo> photos;
      for (const auto& file : files) photos.push_back(read_photo(file));
      for (std::size_t i = 1; i < photos.size(); ++i) {
        compare(photos[i - 1], photos[i], &differences);
        compare(photos[i], photos[i - 1], &differences);
      }
      const double median = quantile(differences.px, 0.5);
      std::cout << directory << ": " << photos.size() << " photos, " << differences.pairs
                << " pairs (either way), " << differences.px.size() << " of "
                << differences.looked_for << " patches found; from the homography: median "
                << median << " px, 90 % " << quantile(differences.px, 0.9) << " px\n";
      if (!(median <= kBound)) {
        ok = false;
        std::cout << "MISSED: " << directory << ": bound " << kBound << " px\n";
      }
    }
  } catch (const std::exception& error) {
    std::cerr << "alidade_photo_alignment: " << error.what() << "\n";
    return 2;
  }
  return ok ? 0 : 1;
}
