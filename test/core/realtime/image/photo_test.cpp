// Corners and alignment on photos. OpenCV reads the photos, is a second opinion on FAST, and moves them:
// by turning the phases of their Fourier transform, which interpolates with every pixel of the image.

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "core/realtime/image/fast_corners.h"
#include "core/realtime/image/patch_alignment.h"
#include "core/realtime/image/pyramid.h"

namespace alidade::test {
namespace {

constexpr double kPhotoContrast = 4;

ImageView view_of(const cv::Mat& image) {
  return {image.data, image.cols, image.rows, static_cast<std::ptrdiff_t>(image.step)};
}

// The largest length up to n without prime factors above five.
int smooth(int n) {
  while (cv::getOptimalDFTSize(n) != n) --n;
  return n;
}

class Photo : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    photo_ = cv::imread(std::string(ALIDADE_TEST_DATA) + "/" + GetParam(), cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(photo_.empty());
    // A side with a large prime factor makes the Fourier transform ten times as slow.
    photo_ = photo_({0, 0, smooth(photo_.cols), smooth(photo_.rows)}).clone();
  }
  cv::Mat photo_;
};

INSTANTIATE_TEST_SUITE_P(Both, Photo,
                         testing::Values("picosdeeuropa_by_Aitzol_Berasategi.jpg",
                                         "aitzgorri_by_Aitzol_Berasategi.jpg"));

std::vector<FastCorner> corners_of(const cv::Mat& photo, int cell, int threshold) {
  FastGrid grid(photo.cols, photo.rows, cell);
  std::vector<FastCorner> corners(static_cast<std::size_t>(grid.max_cells()));
  const FastResult result = grid.detect(view_of(photo), static_cast<std::uint8_t>(threshold),
                                        corners.data(), grid.max_cells());
  EXPECT_EQ(result.status, FastStatus::kOk);
  corners.resize(static_cast<std::size_t>(result.count));
  return corners;
}

// Of equal neighbours OpenCV gives none, here the first is given.
TEST_P(Photo, HasTheCornersThatOpenCvFinds) {
  for (const int threshold : {10, 30}) {
    std::vector<cv::KeyPoint> all;
    cv::FAST(photo_, all, threshold, false, cv::FastFeatureDetector::TYPE_9_16);
    std::map<std::pair<int, int>, bool> is_corner;
    for (const cv::KeyPoint& point : all) {
      is_corner[{cvRound(point.pt.y), cvRound(point.pt.x)}] = true;
    }
    std::vector<cv::KeyPoint> best;
    cv::FAST(photo_, best, threshold, true, cv::FastFeatureDetector::TYPE_9_16);
    std::map<std::pair<int, int>, int> scores;
    std::map<std::pair<int, int>, int> best_of_cell;
    constexpr int kCell = 48;
    for (const cv::KeyPoint& point : best) {
      const int u = cvRound(point.pt.x);
      const int v = cvRound(point.pt.y);
      const int score = cvRound(point.response) + 1;
      scores[{v, u}] = score;
      int& of_cell = best_of_cell[{(v - 3) / kCell, (u - 3) / kCell}];
      of_cell = std::max(of_cell, score);
    }
    const std::vector<FastCorner> corners = corners_of(photo_, kCell, threshold);
    ASSERT_GT(corners.size(), 50U);
    int same = 0;
    for (const FastCorner& corner : corners) {
      EXPECT_TRUE(is_corner.count({corner.v, corner.u})) << corner.u << ' ' << corner.v;
      const auto found = scores.find({corner.v, corner.u});
      if (found == scores.end()) continue;  // has an equal neighbour
      EXPECT_EQ(found->second, corner.score) << corner.u << ' ' << corner.v;
      EXPECT_GE(corner.score, (best_of_cell[{(corner.v - 3) / kCell, (corner.u - 3) / kCell}]));
      ++same;
    }
    EXPECT_GT(same, 0.9 * static_cast<double>(corners.size()));
  }
}

// The same image seen `shift` px further right and down.
cv::Mat moved(const cv::Mat& image, const Vector2<double>& shift) {
  cv::Mat transform;
  cv::Mat real;
  image.convertTo(real, CV_64F);
  cv::dft(real, transform, cv::DFT_COMPLEX_OUTPUT);
  const auto frequency = [](int i, int n) {
    return 2 * CV_PI * static_cast<double>(i <= n / 2 ? i : i - n) / n;
  };
  for (int j = 0; j < transform.rows; ++j) {
    for (int i = 0; i < transform.cols; ++i) {
      const double phase =
          -(frequency(i, transform.cols) * shift.x() + frequency(j, transform.rows) * shift.y());
      auto& c = transform.at<cv::Vec2d>(j, i);
      c = {c[0] * std::cos(phase) - c[1] * std::sin(phase),
           c[0] * std::sin(phase) + c[1] * std::cos(phase)};
    }
  }
  cv::Mat result;
  cv::dft(transform, result, cv::DFT_INVERSE | cv::DFT_SCALE | cv::DFT_REAL_OUTPUT);
  return result;
}

cv::Mat rounded(const cv::Mat& image, double sigma, std::mt19937_64* random) {
  std::normal_distribution<double> normal(0, 1);
  cv::Mat result(image.size(), CV_8U);
  for (int j = 0; j < image.rows; ++j) {
    for (int i = 0; i < image.cols; ++i) {
      const double noise = sigma > 0 ? sigma * normal(*random) : 0;
      result.at<uchar>(j, i) = cv::saturate_cast<uchar>(image.at<double>(j, i) + noise);
    }
  }
  return result;
}

struct PhotoErrors {
  int count = 0, prepared = 0;
  Vector2<double> sum = Vector2<double>::Zero();
  double squares = 0, variances = 0, normalised = 0;
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
};

// As a camera takes it: the lens and the pixels' size have removed the finest detail.
PhotoErrors align_corners(const cv::Mat& photo, double sigma) {
  cv::Mat soft;
  photo.convertTo(soft, CV_64F);
  cv::GaussianBlur(soft, soft, {}, 0.7);
  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform(0, 1);
  PhotoErrors errors;
  const cv::Mat before = rounded(soft, sigma, &random);
  const std::vector<FastCorner> corners = corners_of(before, 48, 20);
  for (int n = 0; n < 4; ++n) {
    const Vector2<double> shift(uniform(random), uniform(random));
    const cv::Mat after = rounded(moved(soft, shift), sigma, &random);
    for (const FastCorner& corner : corners) {
      const Vector2<double> centre(corner.u + 0.5, corner.v + 0.5);
      // The Fourier transform joins opposite borders: ringing there.
      if (std::min({centre.x(), centre.y(), photo.cols - centre.x(), photo.rows - centre.y()}) <
          60) {
        continue;
      }
      ReferencePatch reference;
      if (prepare(view_of(before), centre, Matrix2<double>::Identity(), kPhotoContrast,
                  &reference) != PrepareStatus::kOk) {
        continue;
      }
      ++errors.prepared;
      Alignment alignment;
      if (align(reference, view_of(after), centre + Vector2<double>(0.5, 0.5), {}, &alignment) !=
          AlignmentStatus::kConverged) {
        continue;
      }
      const Vector2<double> error = alignment.position - centre - shift;
      ++errors.count;
      errors.sum += error;
      errors.squares += error.squaredNorm() / 2;
      errors.variances += alignment.covariance.trace() / 2;
      errors.normalised += error.dot(alignment.covariance.inverse() * error);
    }
  }
  return errors;
}

TEST_P(Photo, CornersAreFoundAgainToHundredthsOfAPixel) {
  const PhotoErrors errors = align_corners(photo_, 0);
  ASSERT_GT(errors.count, 500);
  EXPECT_GT(errors.count, 0.99 * errors.prepared);
  EXPECT_LT((errors.sum / errors.count).cwiseAbs().maxCoeff(), 0.002);
  EXPECT_LT(errors.rms(), 0.02);
  RecordProperty("rms", std::to_string(errors.rms()));
}

TEST_P(Photo, ErrorsAreAsLargeAsTheCovarianceSays) {
  const PhotoErrors errors = align_corners(photo_, 2);
  ASSERT_GT(errors.count, 500);
  EXPECT_GT(errors.count, 0.98 * errors.prepared);
  // As in patch_alignment_test, but one reference's noise serves four trials: as good as a fourth of them.
  const double sigma = std::sqrt(4 * kNoiseFreedom / (kNoiseFreedom - 4) / (errors.count / 4.0));
  EXPECT_NEAR(errors.normalised / errors.count, 2, 4 * sigma + 0.05 * 2);
  RecordProperty("rms", std::to_string(errors.rms()));
  RecordProperty("predicted", std::to_string(std::sqrt(errors.variances / errors.count)));
  RecordProperty("anees", std::to_string(errors.normalised / errors.count));
}

}  // namespace
}  // namespace alidade::test
