#include "core/mapping/features.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <random>

#include "core/mapping/feature_matching.h"
#include "test/core/mapping/drawn_images.h"

namespace alidade::test {
namespace {

FeatureSet features_of(const DrawnImage& image, const FeatureOptions& options = {}) {
  return FeatureDetector(options).find(image.luma.data(), image.width, image.height, image.width);
}

// Blobs of one size on a grid, each at a place of its own within its pixel.
std::vector<Blob> blobs_of_size(int width, int height, double sigma) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> within(0, 1);
  std::vector<Blob> out;
  const double spacing = 12 * sigma;
  for (double v = spacing; v < height - spacing / 2; v += spacing) {
    for (double u = spacing; u < width - spacing / 2; u += spacing) {
      out.push_back({{std::floor(u) + within(random), std::floor(v) + within(random)}, sigma, 90});
    }
  }
  return out;
}

TEST(Features, BlobsOfAllSizesAreWhereTheyWereDrawn) {
  for (const double sigma : {1.5, 3.0, 6.0, 12.0}) {
    const int side = static_cast<int>(54 * sigma);
    const std::vector<Blob> blobs = blobs_of_size(side, side, sigma);
    const FeatureSet found = features_of(draw(side, side, blobs));
    Vector2<double> mean = Vector2<double>::Zero();
    int count = 0;
    for (const Blob& blob : blobs) {
      for (const Feature& feature : found.features) {
        const Vector2<double> off = feature.u - blob.u;
        if (off.norm() > 1 || std::abs(std::log(feature.scale / sigma)) > 0.3) continue;
        EXPECT_LT(off.norm(), 0.04 * sigma) << "sigma " << sigma;
        mean += off;
        ++count;
      }
    }
    ASSERT_GE(count, static_cast<int>(blobs.size()) - 1) << "sigma " << sigma;
    mean /= count;
    // Uncorrected, both are 0.25 at every size.
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 0.03) << "sigma " << sigma;
  }
}

TEST(Features, AnImageTurnedByHalfATurnHasThemAtTheOppositePlaces) {
  constexpr int kWidth = 400;
  constexpr int kHeight = 300;
  const DrawnImage image = draw(kWidth, kHeight, blob_texture(kWidth, kHeight, 2500, 3));
  const FeatureSet upright = features_of(image);
  const FeatureSet turned = features_of(image.half_turned());
  std::map<int, std::vector<Vector2<double>>> sums_of_octave;
  for (const FeatureMatch& match : FeatureIndex(turned.descriptors).match(upright.descriptors)) {
    const Feature& a = upright.features[static_cast<std::size_t>(match.query)];
    const Feature& b = turned.features[static_cast<std::size_t>(match.indexed)];
    const Vector2<double> sum = a.u + b.u - Vector2<double>(kWidth, kHeight);
    if (sum.norm() < 2) sums_of_octave[std::ilogb(a.scale)].push_back(sum);
  }
  int octaves = 0;
  for (const auto& [octave, sums] : sums_of_octave) {
    const auto n = static_cast<double>(sums.size());
    Vector2<double> mean = Vector2<double>::Zero();
    for (const Vector2<double>& sum : sums) mean += sum / n;
    double variance = 0;
    for (const Vector2<double>& sum : sums) variance += (sum - mean).squaredNorm() / (2 * n);
    const double of_mean = std::sqrt(variance / n);
    // Uncorrected, the mean is 0.5: an octave that could not tell proves nothing.
    if (n < 5 || of_mean > 0.05) continue;
    ++octaves;
    EXPECT_LT(mean.cwiseAbs().maxCoeff(), 4 * of_mean + 0.01) << "octave " << octave << ", " << n;
  }
  EXPECT_GE(octaves, 3);
}

TEST(Features, AreBoundedAndSpreadOverTheImage) {
  constexpr int kWidth = 400;
  constexpr int kHeight = 300;
  // Strong texture on the left, weak on the right.
  std::vector<Blob> blobs = blob_texture(kWidth, kHeight, 2500, 5);
  for (Blob& blob : blobs) {
    if (blob.u.x() > kWidth / 2.0) blob.contrast *= 0.35;
  }
  FeatureOptions options;
  options.max_features = 120;
  const FeatureSet found = features_of(draw(kWidth, kHeight, blobs), options);
  ASSERT_EQ(found.size(), 120U);
  ASSERT_EQ(found.descriptors.size(), 120U);
  int right = 0;
  for (const Feature& feature : found.features) right += feature.u.x() > kWidth / 2.0 ? 1 : 0;
  EXPECT_GE(right, 36);
  EXPECT_LE(right, 84);
}

TEST(Features, DescriptorsHaveOneLength) {
  const FeatureSet found = features_of(draw(300, 200, blob_texture(300, 200, 1200, 9)));
  ASSERT_GT(found.size(), 50U);
  for (const Descriptor& descriptor : found.descriptors) {
    double square = 0;
    for (const std::uint8_t value : descriptor) square += value * value;
    // Rounding moves each of 128 numbers by half at most.
    EXPECT_NEAR(std::sqrt(square), 512, 6);
  }
}

TEST(Features, WithoutAnImageOrTextureThereAreNone) {
  const FeatureDetector detector;
  EXPECT_EQ(detector.find(nullptr, 640, 480, 640).size(), 0U);
  const std::vector<std::uint8_t> flat(640 * 480, 90);
  EXPECT_EQ(detector.find(flat.data(), 640, 480, 640).size(), 0U);
  EXPECT_EQ(detector.find(flat.data(), 3, 480, 640).size(), 0U);
  EXPECT_EQ(detector.find(flat.data(), 640, 0, 640).size(), 0U);
}

TEST(Features, RowsMayLieFurtherApartThanTheImageIsWide) {
  const DrawnImage image = draw(200, 160, blob_texture(200, 160, 700, 2));
  std::vector<std::uint8_t> padded(300 * 160, 255);
  for (int v = 0; v < 160; ++v) {
    std::copy_n(image.luma.begin() + v * 200, 200, padded.begin() + v * 300);
  }
  const FeatureDetector detector;
  const FeatureSet tight = detector.find(image.luma.data(), 200, 160, 200);
  const FeatureSet loose = detector.find(padded.data(), 200, 160, 300);
  ASSERT_GT(tight.size(), 20U);
  EXPECT_EQ(tight.descriptors, loose.descriptors);
}

}  // namespace
}  // namespace alidade::test
