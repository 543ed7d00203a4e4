// Patch alignment on images that are known exactly between their pixels: bias, covariance, gain and
// offset, warps, borders, images without corners.

#include "core/realtime/image/patch_alignment.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>

#include "core/realtime/image/sampling.h"
#include "test/core/realtime/image/analytic_image.h"

namespace alidade::test {
namespace {

constexpr int kSize = 24;
constexpr double kMinContrast = 4;
const Vector2<double> kCentre(12.0, 12.0);
const Matrix2<double> kIdentity = Matrix2<double>::Identity();

struct Statistics {
  int count = 0;
  int trials = 0;
  Vector2<double> sum = Vector2<double>::Zero();  // of errors
  double squares = 0;                             // of errors, mean of u and v
  double variances = 0;                           // predicted, mean of u and v
  double normalised = 0;                          // error squared by covariance, 2 degrees
  double noise_variances = 0;

  [[nodiscard]] double bias() const { return (sum / count).cwiseAbs().maxCoeff(); }
  [[nodiscard]] double rms() const { return std::sqrt(squares / count); }
  [[nodiscard]] double anees() const { return normalised / count; }
};

// The image shows texture(A (x - shift - kCentre) + kCentre) changed by gain, offset and slope.
struct Change {
  Vector2<double> shift = Vector2<double>::Zero();
  Matrix2<double> A = kIdentity;
  double gain = 1;
  double offset = 0;
  Vector2<double> slope = Vector2<double>::Zero();  // grey levels/px
  double amplitude = 6;                             // of the texture, grey levels
};

void try_once(const Change& change, double sigma, std::mt19937_64* random, Statistics* statistics,
              Alignment* out = nullptr) {
  ++statistics->trials;
  const AnalyticImage texture(random, change.amplitude);
  const Pixels before = make_pixels(kSize, kSize, texture, sigma, random);
  const auto changed = [&](const Vector2<double>& at) -> double {
    const double grey = texture(kCentre + change.A * (at - change.shift - kCentre));
    return 128 + change.offset + change.gain * (grey - 128) + change.slope.dot(at - kCentre);
  };
  const Pixels after = make_pixels(kSize, kSize, changed, sigma, random);
  ReferencePatch reference;
  if (prepare(before.view, kCentre, change.A, kMinContrast, &reference) != PrepareStatus::kOk) {
    return;
  }
  Alignment alignment;
  const Vector2<double> start = kCentre + Vector2<double>(0.5, 0.5);
  ASSERT_EQ(align(reference, after.view, start, {}, &alignment), AlignmentStatus::kConverged);
  const Vector2<double> error = alignment.position - kCentre - change.shift;
  ++statistics->count;
  statistics->sum += error;
  statistics->squares += error.squaredNorm() / 2;
  statistics->variances += alignment.covariance.trace() / 2;
  statistics->normalised += error.dot(alignment.covariance.inverse() * error);
  statistics->noise_variances += alignment.noise_sigma * alignment.noise_sigma;
  if (out != nullptr) *out = alignment;
}

Vector2<double> random_shift(std::mt19937_64* random) {
  std::uniform_real_distribution<double> uniform(0, 1);
  const double u = uniform(*random);
  return {u, uniform(*random)};
}

// The change with so many random shifts, one texture each.
Statistics tried(Change change, int times, double sigma, std::mt19937_64* random) {
  Statistics statistics;
  for (int n = 0; n < times; ++n) {
    change.shift = random_shift(random);
    try_once(change, sigma, random, &statistics);
  }
  return statistics;
}

// Correlation of blurred white noise between points k px apart, averaged over the fraction of a pixel.
double correlation_of_blur(int k) {
  constexpr int kFractions = 64;
  double sum = 0;
  for (int n = 0; n < kFractions; ++n) {
    const auto taps = CubicBSpline::taps(static_cast<float>((n + 0.5) / kFractions));
    for (int i = 0; i + k < 4; ++i) {
      sum += static_cast<double>(taps.weight[static_cast<std::size_t>(i)]) *
             static_cast<double>(taps.weight[static_cast<std::size_t>(i + k)]) / kFractions;
    }
  }
  return sum;
}

// The position is a weighted sum J of the image's points, whose noise has the correlation R: J R J^T.
TEST(PatchAlignment, CovarianceIsThatOfItsWeights) {
  std::mt19937_64 random(21);
  double largest_share = 0;
  for (int n = 0; n < 60; ++n) {
    const AnalyticImage texture(&random);
    const Pixels image = make_pixels(kSize, kSize, texture, 0, &random);
    ReferencePatch patch;
    if (prepare(image.view, kCentre, kIdentity, kMinContrast, &patch) != PrepareStatus::kOk) {
      continue;
    }
    Matrix2<double> expected = Matrix2<double>::Zero();
    for (int j = 0; j < kPatchSize * kPatchSize; ++j) {
      for (int i = 0; i < kPatchSize * kPatchSize; ++i) {
        const int across = std::abs(i % kPatchSize - j % kPatchSize);
        const int down = std::abs(i / kPatchSize - j / kPatchSize);
        if (across > 3 || down > 3) continue;
        const double R = correlation_of_blur(across) * correlation_of_blur(down);
        const Vector2<double> J_i(patch.to_u.data()[i], patch.to_v.data()[i]);
        const Vector2<double> J_j(patch.to_u.data()[j], patch.to_v.data()[j]);
        expected += R * J_i * J_j.transpose();
      }
    }
    const Matrix2<double> error = patch.unit_covariance.cast<double>() - expected;
    EXPECT_LT(error.cwiseAbs().maxCoeff(), 0.01 * expected.trace());
    largest_share = std::max(largest_share, std::abs(expected(0, 1)) / expected.trace());
  }
  EXPECT_GT(largest_share, 0.1) << "textures that lean";
}

// Two images were rounded to whole grey levels, the reference then taken times the gain.
TEST(PatchAlignment, ClaimsNoLessNoiseThanRoundingOfBothImagesMakes) {
  std::mt19937_64 random(22);
  for (const double gain : {0.4, 1.0, 2.5}) {
    double least = 1e9;
    for (int n = 0; n < 60; ++n) {
      Change change;
      change.shift = random_shift(&random);
      change.gain = gain;
      change.amplitude = 4;
      Statistics statistics;
      Alignment alignment;
      try_once(change, 0, &random, &statistics, &alignment);
      if (statistics.count == 0) continue;
      const double rounding = (1 + alignment.gain * alignment.gain) / 12;
      const double claimed = alignment.noise_sigma * alignment.noise_sigma / rounding;
      EXPECT_GT(claimed, 1 - 1e-6) << gain;
      least = std::min(least, claimed);
    }
    EXPECT_NEAR(least, 1, 1e-6) << gain;
  }
}

TEST(PatchAlignment, HasNoBiasAtAnyFractionOfAPixel) {
  std::mt19937_64 random(1);
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < 4; ++j) {
      Statistics statistics;
      Change change;
      change.shift = {i / 4.0, j / 4.0};
      for (int n = 0; n < 100; ++n) try_once(change, 0, &random, &statistics);
      ASSERT_GT(statistics.count, 20);
      EXPECT_LT(statistics.bias(), 0.01) << change.shift.transpose();
      EXPECT_LT(statistics.rms(), 0.02) << change.shift.transpose();
    }
  }
}

// The error squared over a covariance whose scale was estimated from n values is F distributed: a mean of
// 2 after the factor n / (n - 2), a variance of 4 n / (n - 4). Four standard deviations of the mean of the
// trials, and 5 % on top: averaging the correlation of the noise over all fractions of a pixel makes the
// noise estimated here, where the reference lies on whole pixels, 5 % too large.
TEST(PatchAlignment, ErrorsAreAsLargeAsTheCovarianceSays) {
  std::mt19937_64 random(2);
  const Statistics statistics = tried({}, 1600, 2, &random);
  ASSERT_GT(statistics.count, 750);
  const double sigma = std::sqrt(4 * kNoiseFreedom / (kNoiseFreedom - 4) / statistics.count);
  EXPECT_NEAR(statistics.anees(), 2, 4 * sigma + 0.05 * 2);
  EXPECT_NEAR(statistics.rms(), std::sqrt(statistics.variances / statistics.count),
              0.05 * statistics.rms());
  EXPECT_LT(statistics.bias(), 4 * statistics.rms() / std::sqrt(statistics.count));
  // Both images' noise and rounding; the averaged correlation is 5 % too large.
  const double truth = 2 * (2 * 2 + 1.0 / 12);
  EXPECT_NEAR(statistics.noise_variances / statistics.count, 1.05 * truth, 0.05 * truth);
}

// At half the contrast the same noise moves the patch twice as far.
TEST(PatchAlignment, ErrorsAreAsLargeAsTheCovarianceSaysAtAnyContrast) {
  for (const double gain : {0.5, 1.5}) {
    std::mt19937_64 random(23);
    Change change;
    change.gain = gain;
    const Statistics statistics = tried(change, 400, 1, &random);
    ASSERT_GT(statistics.count, 80);
    const double sigma = std::sqrt(4 * kNoiseFreedom / (kNoiseFreedom - 4) / statistics.count);
    EXPECT_NEAR(statistics.anees(), 2, 4 * sigma + 0.05 * 2) << gain;
  }
}

TEST(PatchAlignment, GainAndOffsetChangeNothingAndAreReported) {
  for (const double gain : {0.5, 0.75, 1.0, 1.25, 1.5}) {
    for (const double offset : {-20.0, 0.0, 20.0}) {
      std::mt19937_64 random(3);
      Statistics statistics;
      for (int n = 0; n < 120; ++n) {
        Change change;
        change.shift = random_shift(&random);
        change.gain = gain;
        change.offset = offset;
        change.amplitude = 4;  // never black or white
        Alignment alignment;
        const int before = statistics.count;
        try_once(change, 0, &random, &statistics, &alignment);
        if (statistics.count == before) continue;
        // What rounding to grey levels does to it does not shrink with it.
        EXPECT_NEAR(alignment.gain, gain, 0.01 + 0.01 * gain);
        // The gain's error turns about black.
        EXPECT_NEAR(alignment.offset, 128 + offset - 128 * gain, 128 * 0.02 * gain + 0.5);
        EXPECT_GT(alignment.correlation, 0.995);
      }
      ASSERT_GT(statistics.count, 5);
      EXPECT_LT(statistics.rms(), 0.02 / std::min(gain, 1.0)) << gain << ' ' << offset;
    }
  }
}

// As vignetting and haze make it: it must not pull patches to the brighter side.
TEST(PatchAlignment, SlopeOfTheLightMovesNothing) {
  for (const Vector2<double>& slope :
       {Vector2<double>(1, 0), Vector2<double>(0, -1), Vector2<double>(2, 2)}) {
    std::mt19937_64 random(9);
    Change change;
    change.slope = slope;
    const Statistics statistics = tried(change, 200, 0, &random);
    ASSERT_GT(statistics.count, 50);
    EXPECT_LT(statistics.bias(), 0.01) << slope.transpose();
    EXPECT_LT(statistics.rms(), 0.02) << slope.transpose();
  }
}

TEST(PatchAlignment, FollowsRotationScaleAndShearThatTheCallerKnows) {
  const double angle = 0.3;
  Matrix2<double> rotation;
  rotation << std::cos(angle), -std::sin(angle), std::sin(angle), std::cos(angle);
  Matrix2<double> shear;
  shear << 1, 0.1, 0, 1;
  const Matrix2<double> warps[] = {
      rotation, rotation.transpose(), 1.1 * kIdentity,        0.9 * kIdentity,
      shear,    shear.transpose(),    0.95 * rotation * shear};
  std::mt19937_64 random(4);
  for (const Matrix2<double>& A : warps) {
    Change change;
    change.A = A;
    const Statistics statistics = tried(change, 300, 0, &random);
    ASSERT_GT(statistics.count, 50);
    EXPECT_LT(statistics.bias(), 0.01) << A;
    EXPECT_LT(statistics.rms(), 0.03) << A;
  }
}

// A quarter turn takes pixels to pixels: what the caller turns is the patch of the turned image.
TEST(PatchAlignment, PreparesAWarpedReferenceAsTheImageThatShowsItSo) {
  Matrix2<double> turn;
  turn << 0, -1, 1, 0;
  std::mt19937_64 random(24);
  int compared = 0;
  for (int n = 0; n < 20; ++n) {
    const AnalyticImage texture(&random);
    const auto turned_texture = [&](const Vector2<double>& at) {
      return texture(kCentre + turn * (at - kCentre));
    };
    const Pixels plain = make_pixels(kSize, kSize, texture, 0, &random);
    const Pixels turned = make_pixels(kSize, kSize, turned_texture, 0, &random);
    ReferencePatch warped;
    ReferencePatch expected;
    if (prepare(plain.view, kCentre, turn, kMinContrast, &warped) != PrepareStatus::kOk) continue;
    ASSERT_EQ(prepare(turned.view, kCentre, kIdentity, kMinContrast, &expected),
              PrepareStatus::kOk);
    const auto expect_same = [](const auto& a, const auto& b) {
      EXPECT_LT((a - b).matrix().norm(), 1e-3F * b.matrix().norm());
    };
    expect_same(warped.value, expected.value);
    expect_same(warped.to_u, expected.to_u);
    expect_same(warped.to_v, expected.to_v);
    expect_same(warped.unit_covariance, expected.unit_covariance);
    ++compared;
  }
  EXPECT_GT(compared, 5);
}

// Prepared for the image's warp A (I + B), or for A and corrected by what B displaces: the same to second order,
// 4 px of half a patch times |B|^2 = 1e-3. Uncorrected, contrast a pixel beside the middle moves by |B| px.
TEST(PatchAlignment, TellsWhereAPatchLiesThatIsWarpedMoreThanPreparedFor) {
  Matrix2<double> A;
  A << 1.05, -0.2, 0.2, 1.05;
  Matrix2<double> B;
  B << 0.02, -0.015, 0.01, -0.02;
  std::mt19937_64 random(29);
  double squares = 0;
  double uncorrected_squares = 0;
  int count = 0;
  for (int n = 0; n < 200; ++n) {
    const AnalyticImage texture(&random);
    const Vector2<double> shift = random_shift(&random);
    const auto changed = [&](const Vector2<double>& at) {
      return texture(kCentre + A * ((kIdentity + B) * (at - shift - kCentre)));
    };
    const Pixels before = make_pixels(kSize, kSize, texture, 0, &random);
    const Pixels after = make_pixels(kSize, kSize, changed, 0, &random);
    ReferencePatch prepared;
    ReferencePatch exact;
    if (prepare(before.view, kCentre, A, kMinContrast, &prepared) != PrepareStatus::kOk ||
        prepare(before.view, kCentre, A * (kIdentity + B), kMinContrast, &exact) !=
            PrepareStatus::kOk) {
      continue;
    }
    Alignment found;
    Alignment expected;
    ASSERT_EQ(align(prepared, after.view, kCentre, {}, &found), AlignmentStatus::kConverged);
    ASSERT_EQ(align(exact, after.view, kCentre, {}, &expected), AlignmentStatus::kConverged);
    const Vector2<double> off = found.position - expected.position;
    uncorrected_squares += off.squaredNorm() / 2;
    squares += (off + warp_displacement(prepared, B.cast<float>())).squaredNorm() / 2;
    ++count;
  }
  ASSERT_GT(count, 100);
  EXPECT_LT(std::sqrt(squares / count), 4 * B.squaredNorm());
  EXPECT_GT(std::sqrt(uncorrected_squares / count), 8 * B.squaredNorm());
}

TEST(PatchAlignment, GoesAsFarAsItMayAndNoFarther) {
  std::mt19937_64 random(25);
  const AnalyticImage texture(&random);
  const Pixels pixels = make_pixels(kSize, kSize, texture, 0, &random);
  ReferencePatch reference;
  ASSERT_TRUE(is_usable(prepare(pixels.view, kCentre, kIdentity, 0.1, &reference)));
  Alignment alignment;
  const auto from = [&](double away, double max_move) {
    AlignmentLimits limits;
    limits.max_move = max_move;
    return align(reference, pixels.view, kCentre + Vector2<double>(away, 0), limits, &alignment);
  };
  EXPECT_EQ(from(0.6, 0.5), AlignmentStatus::kMovedTooFar);
  EXPECT_EQ(from(0.6, 0.8), AlignmentStatus::kConverged);
  EXPECT_EQ(from(1.3, 1.2), AlignmentStatus::kMovedTooFar);
  EXPECT_EQ(from(1.3, 1.5), AlignmentStatus::kConverged);
}

// A smooth step at angle `normal` through the centre.
Pixels step_edge(double normal, double height, double shift, double sigma,
                 std::mt19937_64* random) {
  const Vector2<double> across(std::cos(normal), std::sin(normal));
  return make_pixels(
      kSize, kSize,
      [&](const Vector2<double>& at) {
        return 128 + height / 2 * std::tanh((across.dot(at - kCentre) - shift) / 1.5);
      },
      sigma, random);
}

TEST(PatchAlignment, KnowsAnEdgeOnlyAcrossIt) {
  std::mt19937_64 random(5);
  for (const double sigma : {0.0, 2.0}) {
    for (double normal = 0; normal < 3.1; normal += 0.2) {
      const Vector2<double> across(std::cos(normal), std::sin(normal));
      const Vector2<double> along(-across.y(), across.x());
      const Pixels before = step_edge(normal, 100, 0, sigma, &random);
      const Pixels after = step_edge(normal, 100, 0.4, sigma, &random);
      ReferencePatch reference;
      ASSERT_EQ(prepare(before.view, kCentre, kIdentity, kMinContrast, &reference),
                PrepareStatus::kEdge);
      Alignment alignment;
      ASSERT_EQ(align(reference, after.view, kCentre, {}, &alignment), AlignmentStatus::kConverged);
      const Vector2<double> moved = alignment.position - kCentre;
      EXPECT_NEAR(across.dot(moved), 0.4, sigma > 0 ? 0.1 : 0.02) << normal;
      EXPECT_NEAR(along.dot(moved), 0, sigma > 0 ? 0.1 : 0.02) << normal;
      EXPECT_LT(across.dot(alignment.covariance * across), 0.1 * 0.1 + 0.3);
      EXPECT_GT(along.dot(alignment.covariance * along), 0.99 * kUnobservedVariance);
      EXPECT_GT(alignment.covariance.determinant(), 0);
    }
  }
}

TEST(PatchAlignment, RefusesReferencesWithoutContrast) {
  std::mt19937_64 random(6);
  ReferencePatch reference;
  const auto prepared = [&](const auto& grey_at, double sigma) {
    const Pixels pixels = make_pixels(kSize, kSize, grey_at, sigma, &random);
    return prepare(pixels.view, kCentre, kIdentity, kMinContrast, &reference);
  };
  const auto flat = [](const Vector2<double>&) { return 90.0; };
  EXPECT_EQ(prepared(flat, 0), PrepareStatus::kTooFlat);
  EXPECT_EQ(prepared(flat, 2), PrepareStatus::kTooFlat);
  EXPECT_EQ(prepared(flat, 5), PrepareStatus::kTooFlat);
  // A displacement of a ramp is an offset.
  const auto ramp = [](const Vector2<double>& at) { return 3 * at.x() + 2 * at.y(); };
  EXPECT_EQ(prepared(ramp, 0), PrepareStatus::kTooFlat);
  // Without a demand on contrast, too, no image is divided by zero.
  const Pixels pixels = make_pixels(kSize, kSize, flat, 0, &random);
  EXPECT_EQ(prepare(pixels.view, kCentre, kIdentity, 0, &reference), PrepareStatus::kTooFlat);
}

TEST(PatchAlignment, RefusesWhatNeedsPixelsBeyondTheBorder) {
  std::mt19937_64 random(7);
  const AnalyticImage texture(&random);
  const Pixels pixels = make_pixels(kSize, kSize, texture, 0, &random);
  ReferencePatch reference;
  const auto prepared = [&](double u, double v, const Matrix2<double>& A) {
    return prepare(pixels.view, {u, v}, A, 0.1, &reference);
  };
  // Points reach 3.5 px from the centre, and taps 1.5 px before and 2.5 px beyond them.
  Matrix2<double> nearly = kIdentity;
  nearly(0, 0) += 1e-9;
  for (const Matrix2<double>& A : {kIdentity, nearly}) {
    const double in = 5.01;
    const double out = 4.99;
    EXPECT_TRUE(is_usable(prepared(in, in, A)));
    EXPECT_TRUE(is_usable(prepared(kSize - in, kSize - in, A)));
    EXPECT_EQ(prepared(out, 12, A), PrepareStatus::kOutOfImage);
    EXPECT_EQ(prepared(12, out, A), PrepareStatus::kOutOfImage);
    EXPECT_EQ(prepared(kSize - out, 12, A), PrepareStatus::kOutOfImage);
    EXPECT_EQ(prepared(12, kSize - out, A), PrepareStatus::kOutOfImage);
    EXPECT_EQ(prepared(1e300, 12, A), PrepareStatus::kOutOfImage);
    EXPECT_EQ(prepared(std::numeric_limits<double>::quiet_NaN(), 12, A),
              PrepareStatus::kOutOfImage);
  }
  EXPECT_EQ(prepared(12, 12, kIdentity * std::numeric_limits<double>::infinity()),
            PrepareStatus::kNotFinite);
  EXPECT_EQ(prepare({}, kCentre, kIdentity, 1, &reference), PrepareStatus::kOutOfImage);

  ASSERT_TRUE(is_usable(prepared(5.01, 5.01, kIdentity)));
  Alignment alignment;
  EXPECT_EQ(align(reference, pixels.view, {5.01, 5.01}, {}, &alignment),
            AlignmentStatus::kConverged);
  EXPECT_EQ(align(reference, pixels.view, {4.9, 5.01}, {}, &alignment),
            AlignmentStatus::kOutOfImage);
  EXPECT_EQ(align(reference, {}, {5.01, 5.01}, {}, &alignment), AlignmentStatus::kOutOfImage);
  EXPECT_EQ(align(reference, pixels.view, {std::nan(""), 5.01}, {}, &alignment),
            AlignmentStatus::kNotFinite);
}

TEST(PatchAlignment, SaysWhyItFoundNothing) {
  std::mt19937_64 random(8);
  int unlike = 0;
  int moved_too_far = 0;
  int not_converged = 0;
  int found = 0;
  for (int n = 0; n < 300; ++n) {
    const AnalyticImage texture(&random);
    const AnalyticImage other(&random);
    const Pixels before = make_pixels(kSize, kSize, texture, 2, &random);
    const Pixels after = make_pixels(kSize, kSize, other, 2, &random);
    ReferencePatch reference;
    if (prepare(before.view, kCentre, kIdentity, kMinContrast, &reference) != PrepareStatus::kOk) {
      continue;
    }
    Alignment alignment;
    const AlignmentStatus status = align(reference, after.view, kCentre, {}, &alignment);
    unlike += status == AlignmentStatus::kUnlike;
    moved_too_far += status == AlignmentStatus::kMovedTooFar;
    not_converged += status == AlignmentStatus::kNotConverged;
    found += status == AlignmentStatus::kConverged;

    AlignmentLimits hasty;
    hasty.max_iterations = 1;
    EXPECT_EQ(align(reference, before.view, kCentre + Vector2<double>(0.7, 0), hasty, &alignment),
              AlignmentStatus::kNotConverged);
    AlignmentLimits near;
    near.max_move = 0.2;
    EXPECT_EQ(align(reference, before.view, kCentre + Vector2<double>(0.7, 0), near, &alignment),
              AlignmentStatus::kMovedTooFar);
    const Pixels covered = make_pixels(
        kSize, kSize, [](const Vector2<double>&) { return 20.0; }, 2, &random);
    EXPECT_NE(align(reference, covered.view, kCentre, {}, &alignment), AlignmentStatus::kConverged);
  }
  EXPECT_GT(unlike, 0);
  EXPECT_GT(moved_too_far, 0);
  // Images that have nothing to do with each other: with waves this long, one in
  // twenty looks alike somewhere within max_move.
  EXPECT_LT(found, (unlike + moved_too_far + not_converged + found) / 10);
}

// One step is what align() takes, where that does not shorten it.
TEST(PatchAlignment, OneStepIsThatOfTheWholeAlignment) {
  std::mt19937_64 random(9);
  AlignmentLimits one;
  one.max_iterations = 1;
  one.min_correlation = 0;
  one.min_gain = 1e-3;
  int compared = 0;
  int nearer = 0;
  for (int n = 0; n < 800; ++n) {
    const AnalyticImage texture(&random, 5);
    const Pixels before = make_pixels(kSize, kSize, texture, 1, &random);
    const double gain = 0.5 + n % 3 * 0.5;
    const auto changed = [&](const Vector2<double>& at) {
      return 128 + gain * (texture(at) - 128);
    };
    const Pixels after = make_pixels(kSize, kSize, changed, 1, &random);
    ReferencePatch reference;
    if (prepare(before.view, kCentre, kIdentity, kMinContrast, &reference) != PrepareStatus::kOk) {
      continue;
    }
    PatchStep step;
    ASSERT_TRUE(measure_step(reference, after.view, kCentre, &step));
    EXPECT_NEAR(step.gain, gain, 0.15);
    EXPECT_GT(step.correlation, 0.9);
    EXPECT_LT(step.step.norm(), 1);

    const Vector2<double> away = random_shift(&random) - Vector2<double>(0.5, 0.5);
    const Vector2<double> start = kCentre + away;
    ASSERT_TRUE(measure_step(reference, after.view, start, &step));
    EXPECT_LE(std::abs(step.correlation), 1 + 1e-5);
    if (!(step.gain > one.min_gain) || !(step.step.norm() < 1)) continue;
    Alignment alignment;
    (void)align(reference, after.view, start, one, &alignment);
    EXPECT_LT((alignment.position - start - step.step).norm(), 1e-6);
    EXPECT_NEAR(alignment.gain, step.gain, 1e-6);
    ++compared;
    nearer += (start + step.step - kCentre).norm() < 0.5 * away.norm() + 0.1 ? 1 : 0;
  }
  EXPECT_GT(compared, 50);
  EXPECT_GT(nearer, 0.9 * compared);
}

TEST(PatchAlignment, OneStepTellsLikeFromUnlike) {
  std::mt19937_64 random(10);
  const AnalyticImage texture(&random);
  const Pixels before = make_pixels(kSize, kSize, texture, 0, &random);
  ReferencePatch reference;
  ASSERT_TRUE(is_usable(prepare(before.view, kCentre, kIdentity, 0.1, &reference)));
  const auto negative = [&](const Vector2<double>& at) { return 256 - texture(at); };
  const Pixels opposite = make_pixels(kSize, kSize, negative, 0, &random);
  PatchStep step;
  ASSERT_TRUE(measure_step(reference, opposite.view, kCentre, &step));
  EXPECT_LT(step.gain, -0.9);
  EXPECT_LT(step.correlation, -0.99);
  ASSERT_TRUE(measure_step(reference, before.view, kCentre, &step));
  EXPECT_NEAR(step.correlation, 1, 1e-5);
  EXPECT_NEAR(step.gain, 1, 1e-4);
  EXPECT_LT(step.step.norm(), 1e-4);

  const auto flat = [](const Vector2<double>&) { return 90.0; };
  const Pixels blank = make_pixels(kSize, kSize, flat, 0, &random);
  EXPECT_FALSE(measure_step(reference, blank.view, kCentre, &step));
  EXPECT_FALSE(measure_step(reference, {}, kCentre, &step));
  const double kNaN = std::numeric_limits<double>::quiet_NaN();
  const double kInfinity = std::numeric_limits<double>::infinity();
  for (const double bad : {kNaN, kInfinity, -kInfinity, 4.99, kSize - 4.99, -100.0, 1e300}) {
    EXPECT_FALSE(measure_step(reference, before.view, {bad, 12}, &step)) << bad;
    EXPECT_FALSE(measure_step(reference, before.view, {12, bad}, &step)) << bad;
  }
}

}  // namespace
}  // namespace alidade::test
