// Coarse alignment from starts that are wrong by up to 60 px in any direction of a 1920x1080 image.

#include "core/realtime/oe_mode/coarse_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <complex>
#include <deque>
#include <functional>
#include <limits>
#include <random>
#include <vector>

#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {
namespace {

constexpr int kFullWidth = 1920;
constexpr int kFullHeight = 1080;
constexpr int kMargin = 80;  // px, by which a view may be moved in its image
constexpr int kOctaves = 6;
constexpr int kFinest = 2;
constexpr int kPatches = 24;  // of each octave

// Waves with periods from 10 to 800 px, as many of each octave, so that all octaves have contrast.
std::vector<float> texture(std::uint64_t seed) {
  constexpr int kColumns = kFullWidth + 2 * kMargin;
  constexpr int kRows = kFullHeight + 2 * kMargin;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::vector<float> grey(static_cast<std::size_t>(kColumns) * kRows, 128.0F);
  for (int wave = 0; wave < 40; ++wave) {
    const double number = 2 * kPi / (10 * std::pow(80.0, uniform(random)));
    const double direction = 2 * kPi * uniform(random);
    const double phase = 2 * kPi * uniform(random);
    const std::complex<float> step(std::polar(1.0, number * std::cos(direction)));
    for (int v = 0; v < kRows; ++v) {
      std::complex<float> at(std::polar(4.5, phase + number * std::sin(direction) * v));
      float* row = grey.data() + static_cast<std::ptrdiff_t>(v) * kColumns;
      for (int u = 0; u < kColumns; ++u) {
        row[u] += at.real();
        at = {at.real() * step.real() - at.imag() * step.imag(),
              at.real() * step.imag() + at.imag() * step.real()};
      }
    }
  }
  return grey;
}

class BlurredImage {
 public:
  BlurredImage(const std::vector<float>& grey, double gain, std::uint64_t seed)
      : pixels_(grey.size()) {
    std::mt19937_64 random(seed);
    std::normal_distribution<float> noise(0, 2);
    for (std::size_t i = 0; i < grey.size(); ++i) {
      const float value = 128 + static_cast<float>(gain) * (grey[i] - 128) + noise(random);
      pixels_[i] = static_cast<std::uint8_t>(std::lround(std::clamp(value, 0.0F, 255.0F)));
    }
  }

  // What is at u without a shift is at u + shift.
  [[nodiscard]] ImageView view(int shift_u = 0, int shift_v = 0) const {
    constexpr int kStride = kFullWidth + 2 * kMargin;
    return {pixels_.data() + (kMargin - shift_v) * kStride + kMargin - shift_u, kFullWidth,
            kFullHeight, kStride};
  }

  // Hides a strip of the view by what another one shows there.
  void cover(int shift_u, int shift_v, int from_u, int to_u, const BlurredImage& other) {
    const ImageView target = view(shift_u, shift_v);
    const ImageView source = other.view();
    for (int v = 0; v < kFullHeight; ++v) {
      std::uint8_t* to = pixels_.data() + (target.row(v) - pixels_.data());
      std::copy(source.row(v) + from_u, source.row(v) + to_u, to + from_u);
    }
  }

 private:
  std::vector<std::uint8_t> pixels_;
};

class CoarseAlignmentTest : public testing::Test {
 protected:
  // Descending octaves, positions all over where a patch stays in the image.
  void SetUp() override {
    J_angle_ << -20000, 800, 500, 19000;
    Pyramid pyramid(kFullWidth, kFullHeight, kOctaves);
    ASSERT_EQ(pyramid.build(reference().view(), kOctaves), PyramidStatus::kOk);
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform(0, 1);
    references_.reserve(kPatches * kOctaves);
    for (int octave = kOctaves - 1; octave >= kFinest; --octave) {
      const double border = border_of(octave);
      for (int taken = 0; taken < kPatches;) {
        const double u = border + (kFullWidth - 2 * border) * uniform(random);
        const Vector2<double> at(u, border + (kFullHeight - 2 * border) * uniform(random));
        ReferencePatch patch;
        if (prepare(pyramid.octave(octave), std::ldexp(1.0, -octave) * at,
                    Matrix2<double>::Identity(), 1, &patch) != PrepareStatus::kOk) {
          continue;
        }
        references_.push_back(patch);
        patches_.push_back({&references_.back(), octave, at, J_angle_});
        ++taken;
      }
    }
  }

  static double border_of(int octave) { return std::ldexp(6.5, octave) + 65; }

  // True and the remaining error in px.
  bool align(const ImageView& image, const CoarseOptions& options, const Vector2<double>& shift,
             double* error_px, CoarseAlignment* out) {
    EXPECT_EQ(pyramid_.build(image, kOctaves), PyramidStatus::kOk);
    const bool ok =
        align_coarsely(pyramid_, patches_.data(), static_cast<int>(patches_.size()), options, out);
    *error_px = (J_angle_ * out->angle - shift).norm();
    return ok;
  }

  void expect_recovered(const BlurredImage& image, double radius, double search_px,
                        double least_found) {
    for (int i = 0; i < 12; ++i) {
      const double turn = 2 * kPi * (i + 0.3) / 12;
      const int du = static_cast<int>(std::lround(radius * std::cos(turn)));
      const int dv = static_cast<int>(std::lround(radius * std::sin(turn)));
      CoarseOptions options;
      options.search_px = search_px;
      CoarseAlignment out;
      double error_px = 0;
      ASSERT_TRUE(align(image.view(du, dv), options, {du, dv}, &error_px, &out))
          << du << ' ' << dv << ", found " << out.found;
      EXPECT_LT(error_px, 1) << du << ' ' << dv;
      EXPECT_GE(out.found, least_found) << du << ' ' << dv;
      EXPECT_EQ(out.patches, kPatches);
    }
  }

  // Made once for all cases.
  static const std::vector<float>& grey() {
    static const std::vector<float> of_first = texture(1);
    return of_first;
  }
  static const BlurredImage& reference() {
    static const BlurredImage of_first(grey(), 1, 1);
    return of_first;
  }

  Matrix2<double> J_angle_;  // px/rad
  std::vector<ReferencePatch> references_;
  std::vector<CoarsePatch> patches_;
  Pyramid pyramid_{kFullWidth, kFullHeight, kOctaves};
};

TEST_F(CoarseAlignmentTest, FindsItsWayFromTheReachOfTheCoarsestOctave) {
  const BlurredImage same(grey(), 1, 2);
  for (const double radius : {0.0, 5.0, 20.0, 40.0}) {
    SCOPED_TRACE(radius);
    expect_recovered(same, radius, 0, 0.95);
  }
}

TEST_F(CoarseAlignmentTest, FindsItsWayFromSixtyPixelsBySearching) {
  const BlurredImage same(grey(), 1, 2);
  for (const double radius : {0.0, 20.0, 60.0}) {
    SCOPED_TRACE(radius);
    expect_recovered(same, radius, 60, 0.95);
  }
}

TEST_F(CoarseAlignmentTest, DoesNotMindBrightness) {
  for (const double gain : {0.5, 2.0}) {
    SCOPED_TRACE(gain);
    const BlurredImage changed(grey(), gain, 2);
    expect_recovered(changed, 30, 0, 0.95);
    expect_recovered(changed, 60, 60, 0.95);
  }
}

TEST_F(CoarseAlignmentTest, DoesNotMindWhatHidesThirtyPercent) {
  const BlurredImage clear(grey(), 1, 2);
  const BlurredImage other(texture(2), 1, 4);
  for (const double radius : {0.0, 30.0, 60.0}) {
    for (int i = 0; i < 3; ++i) {
      const double turn = 2 * kPi * (i + 0.3) / 3;
      const int du = static_cast<int>(std::lround(radius * std::cos(turn)));
      const int dv = static_cast<int>(std::lround(radius * std::sin(turn)));
      // Each octave has its patches in a strip of its own width; 30 % of the coarsest's are hidden.
      const auto from = static_cast<int>(border_of(kOctaves - 1));
      const int to = from + (kFullWidth - 2 * from) * 3 / 10;
      BlurredImage covered = clear;
      covered.cover(du, dv, 0, to, other);
      CoarseOptions options;
      options.search_px = radius > 40 ? radius : 0;
      CoarseAlignment out;
      double error_px = 0;
      ASSERT_TRUE(align(covered.view(du, dv), options, {du, dv}, &error_px, &out))
          << du << ' ' << dv << ", found " << out.found;
      EXPECT_LT(error_px, 1) << du << ' ' << dv;
      EXPECT_LT(out.found, 0.85);
      EXPECT_GT(out.found, 0.5);
    }
  }
}

TEST_F(CoarseAlignmentTest, FindsNothingWhereNothingIsAlike) {
  const std::vector<std::uint8_t> blank(static_cast<std::size_t>(kFullWidth) * kFullHeight, 90);
  const BlurredImage other(texture(2), 1, 4);
  const BlurredImage noise(std::vector<float>(grey().size(), 128.0F), 1, 5);
  const ImageView images[] = {
      {blank.data(), kFullWidth, kFullHeight, kFullWidth}, other.view(), noise.view()};
  for (const ImageView& image : images) {
    for (const double search_px : {0.0, 60.0}) {
      CoarseOptions options;
      options.search_px = search_px;
      CoarseAlignment out;
      double error_px = 0;
      EXPECT_FALSE(align(image, options, {0, 0}, &error_px, &out));
      EXPECT_LT(out.found, 0.4);
      EXPECT_TRUE(all_finite(out.angle));
    }
  }
}

TEST_F(CoarseAlignmentTest, NeedsAFewPatchesInTheImage) {
  ASSERT_EQ(pyramid_.build(reference().view(), kOctaves), PyramidStatus::kOk);
  CoarseAlignment out;
  EXPECT_FALSE(align_coarsely(pyramid_, nullptr, 0, {}, &out));
  EXPECT_FALSE(align_coarsely(pyramid_, patches_.data(), 4, {}, &out));
  EXPECT_TRUE(align_coarsely(pyramid_, patches_.data(), 5, {}, &out));
  // One octave alone is enough.
  const CoarsePatch* finest = patches_.data() + static_cast<std::ptrdiff_t>(patches_.size()) - 5;
  EXPECT_TRUE(align_coarsely(pyramid_, finest, 5, {}, &out));
  EXPECT_EQ(out.patches, 5);

  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  for (const double away : {-3000.0, 1e9, 1e300, kNaN}) {
    for (const double search_px : {0.0, 60.0}) {
      std::vector<CoarsePatch> moved = patches_;
      for (CoarsePatch& patch : moved) patch.u.x() += away;
      CoarseOptions options;
      options.search_px = search_px;
      EXPECT_FALSE(
          align_coarsely(pyramid_, moved.data(), static_cast<int>(moved.size()), options, &out));
      EXPECT_TRUE(all_finite(out.angle));
    }
  }
  // A mount that moves nothing in the image.
  std::vector<CoarsePatch> still = patches_;
  for (CoarsePatch& patch : still) patch.J_angle.setZero();
  for (const double search_px : {0.0, 60.0}) {
    CoarseOptions options;
    options.search_px = search_px;
    (void)align_coarsely(pyramid_, still.data(), static_cast<int>(still.size()), options, &out);
    EXPECT_TRUE(all_finite(out.angle)) << search_px;
  }
}

// Some patches of a small image that is known between its pixels; what each of them shows next is chosen freely.
class CoarsePatches : public testing::Test {
 protected:
  static constexpr int kSmallWidth = 240;
  static constexpr int kSmallHeight = 120;
  static constexpr int kColumns = 9;
  static constexpr int kRows = 3;
  static constexpr double kPxPerRad = 1000;
  using Grey = std::function<double(const Vector2<double>&)>;

  // Patches all over the image, column by column, of one octave.
  void prepare_patches(const Grey& grey, int octave = 0) {
    const Pixels pixels = make_pixels(kSmallWidth, kSmallHeight, grey, 0, &random_);
    ASSERT_EQ(pyramid_.build(pixels.view, 2), PyramidStatus::kOk);
    for (int column = 0; column < kColumns; ++column) {
      for (int row = 0; row < kRows; ++row) {
        ReferencePatch& reference = references_.emplace_back();
        const Vector2<double> u(24 + 24 * column, 30 + 30 * row);
        ASSERT_TRUE(is_usable(prepare(pyramid_.octave(octave), std::ldexp(1.0, -octave) * u,
                                      Matrix2<double>::Identity(), 1, &reference)));
        patches_.push_back({&reference, octave, u, kPxPerRad * Matrix2<double>::Identity()});
      }
    }
  }

  bool align(const Grey& grey, const CoarseOptions& options = {}) {
    const Pixels pixels = make_pixels(kSmallWidth, kSmallHeight, grey, 0, &random_);
    EXPECT_EQ(pyramid_.build(pixels.view, 2), PyramidStatus::kOk);
    return align_coarsely(pyramid_, patches_.data(), static_cast<int>(patches_.size()), options,
                          &out_);
  }
  [[nodiscard]] Vector2<double> moved_px() const { return kPxPerRad * out_.angle; }

  // Of waves with this wave number to the side, rad/px, or its negative.
  Grey waves_of(double across, double most_down) {
    std::vector<Vector3<double>> waves;
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int i = 0; i < 12; ++i) {
      waves.emplace_back(i % 2 == 0 ? across : -across, most_down * uniform(random_),
                         kPi * uniform(random_));
    }
    return [waves](const Vector2<double>& at) {
      double sum = 128;
      for (const Vector3<double>& wave : waves) {
        sum += 9 * std::cos(wave.x() * at.x() + wave.y() * at.y() + wave.z());
      }
      return sum;
    };
  }

  std::mt19937_64 random_{12};
  AnalyticImage texture_{&random_};
  Pyramid pyramid_{kSmallWidth, kSmallHeight, 2};
  std::deque<ReferencePatch> references_;
  std::vector<CoarsePatch> patches_;
  CoarseAlignment out_;
};

// The border between two parts of the image, px: left of it lie so many columns of patches.
double border_after(int columns) { return 24 * columns + 12; }

TEST_F(CoarsePatches, OutsideTheImageAreNeitherFoundNorMissed) {
  prepare_patches(texture_);
  for (std::size_t i = 0; i < patches_.size(); i += 2) patches_[i].u.x() -= 500;
  EXPECT_TRUE(align(texture_));
  EXPECT_EQ(out_.patches, kColumns * kRows / 2);
  EXPECT_EQ(out_.found, 1);
}

TEST_F(CoarsePatches, OfAnOctaveWithTooFewInTheImageHaveNoSay) {
  prepare_patches(texture_, 1);
  const int coarse = static_cast<int>(patches_.size());
  prepare_patches(texture_, 0);
  for (std::size_t i = static_cast<std::size_t>(coarse) + 4; i < patches_.size(); ++i) {
    patches_[i].u.x() -= 500;
  }
  EXPECT_TRUE(align(texture_));
  EXPECT_EQ(out_.patches, coarse);
  EXPECT_EQ(out_.found, 1);
}

// Half a wave away the image is its own negative, to the pixel; where it belongs, it lies between two steps of
// the search.
TEST_F(CoarsePatches, AreNotFoundWhereTheirNegativesAre) {
  const Grey texture = waves_of(kPi / 7, 0.5);
  prepare_patches(texture);
  CoarseOptions options;
  options.search_px = 10;
  EXPECT_TRUE(align([&](const Vector2<double>& at) { return texture(at - Vector2<double>(1, 0)); },
                    options));
  EXPECT_LT((moved_px() - Vector2<double>(1, 0)).norm(), 0.1);
}

// Five columns of nine are shown as their negatives, and displaced the other way.
TEST_F(CoarsePatches, AreNotPulledByThoseOfTurnedContrast) {
  prepare_patches(texture_);
  const Vector2<double> shift(1, 0);
  EXPECT_TRUE(align([&](const Vector2<double>& at) {
    return at.x() < border_after(4) ? texture_(at - shift) : 256 - texture_(at + shift);
  }));
  EXPECT_LT((moved_px() - shift).norm(), 0.1);
  EXPECT_NEAR(out_.found, 4.0 / 9, 0.01);
}

// Three columns of nine move by themselves.
TEST_F(CoarsePatches, AreNotPulledByThoseThatMoveByThemselves) {
  prepare_patches(texture_);
  EXPECT_TRUE(align([&](const Vector2<double>& at) {
    return at.x() < border_after(3) ? texture_(at - Vector2<double>(1.2, 0)) : texture_(at);
  }));
  // Their mean would be 0.4 px.
  EXPECT_LT(moved_px().norm(), 0.2);
}

// A fifth of a wave away the tangent promises three times the way: beyond half a wave all is turned round.
TEST_F(CoarsePatches, FindTheirWayFromWhereTheLinearisationPromisesTooMuch) {
  const Grey texture = waves_of(2 * kPi / 12, 0.1);
  prepare_patches(texture);
  const Vector2<double> shift(2.5, 0);
  EXPECT_TRUE(align([&](const Vector2<double>& at) { return texture(at - shift); }));
  EXPECT_LT((moved_px() - shift).norm(), 0.1);
}

}  // namespace
}  // namespace alidade::test
