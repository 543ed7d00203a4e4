// New landmarks: where there are none, as many as allowed, and at the directions that show them.

#include "core/realtime/oe_mode/landmark_maker.h"

#include <gtest/gtest.h>

#include <set>
#include <utility>

#include "core/model/direction.h"
#include "test/core/realtime/oe_mode/textured_scene.h"
#include "test/core/realtime/pixel_truth.h"
#include "test/support/parameter_changes.h"

namespace alidade::test {
namespace {

class MadeLandmarks : public testing::Test {
 protected:
  TexturedScene scene_;
  LandmarkMaker maker_{TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                       TexturedScene::kHeight};
};

TEST_F(MadeLandmarks, CoverAnEmptyViewInEachOctaveAtOnce) {
  scene_.look({0, 0});
  EXPECT_EQ(scene_.make_landmarks(&maker_, {0, 0}), 1) << "all in view are new";
  std::set<int> octaves;
  std::set<std::pair<int, int>> cells;
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    const Landmark& landmark = scene_.map_.at(slot);
    octaves.insert(landmark.octave);
    Vector2<double> u;
    const ViewProjection view(scene_.calibration_, TexturedScene::motion_at({0, 0}));
    ASSERT_TRUE(view.project(landmark.d, &u));
    if (landmark.octave == 0) {
      const bool fresh =
          cells.insert({static_cast<int>(u.x() / 24), static_cast<int>(u.y() / 24)}).second;
      EXPECT_TRUE(fresh) << "one a cell";
    }
    EXPECT_GT(landmark.covariance.trace(), 0);
  }
  EXPECT_GE(octaves.size(), 3U);
  EXPECT_GT(cells.size(), 40U) << "of 130";
}

TEST_F(MadeLandmarks, AreFewerTheMoreThereAre) {
  scene_.look({0, 0});
  double share = 1;
  for (int i = 0; i < 10; ++i) {
    share = scene_.make_landmarks(&maker_, {0, 0});
    EXPECT_LE(share, i == 0 ? 1 : 0.5);
  }
  EXPECT_LT(share, 0.05);
}

TEST_F(MadeLandmarks, AreNoMoreThanAllowedWhereTheViewIsNotEmpty) {
  LandmarkMakerOptions options = TexturedScene::maker_options();
  options.empty_view = 0;
  options.max_new = 7;
  LandmarkMaker maker(options, OctaveOptions{}, TexturedScene::kWidth, TexturedScene::kHeight);
  scene_.look({0, 0});
  int before = 0;
  for (int i = 0; i < 5; ++i) {
    static_cast<void>(scene_.make_landmarks(&maker, {0, 0}));
    EXPECT_GT(scene_.map_.size(), before);
    EXPECT_LE(scene_.map_.size(), before + 7);
    before = scene_.map_.size();
  }
}

TEST_F(MadeLandmarks, NeedATexture) {
  scene_.look({0, 0});
  EXPECT_TRUE(maker_.is_textured(scene_.pyramid_, scene_.octaves_));
  scene_.look_at_nothing();
  EXPECT_FALSE(maker_.is_textured(scene_.pyramid_, scene_.octaves_));
  EXPECT_EQ(scene_.make_landmarks(&maker_, {0, 0}), 0);
  EXPECT_EQ(scene_.map_.size(), 0);
}

// Found in the very image that they were made of: at their direction's pixel, by the warp that they keep.
TEST_F(MadeLandmarks, LieWhereTheirImagesDo) {
  scene_.look({0, 0});
  static_cast<void>(scene_.make_landmarks(&maker_, {0, 0}));
  const ViewProjection view(scene_.calibration_, TexturedScene::motion_at({0, 0}));
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    const Landmark& landmark = scene_.map_.at(slot);
    const double scale = std::ldexp(1.0, landmark.octave);
    // Octave px, of a direction that is a little off.
    const auto pixel_of = [&](const Vector2<double>& off) {
      Vector2<double> u = Vector2<double>::Zero();
      EXPECT_TRUE(view.project(direction_plus<double>(landmark.d, off), &u));
      return Vector2<double>(u / scale);
    };
    const Vector2<double> u = pixel_of({0, 0});
    ReferencePatch patch;
    ASSERT_TRUE(is_usable(prepare(landmark.image(), Vector2<double>::Constant(kReferenceCentre),
                                  Matrix2<double>::Identity(), 0.5, &patch)));
    Alignment alignment;
    ASSERT_EQ(align(patch, scene_.pyramid_.octave(landmark.octave), u, {}, &alignment),
              AlignmentStatus::kConverged);
    EXPECT_LT((alignment.position - u).norm(), 0.01) << "octave " << int{landmark.octave};
    constexpr double kStep = 1e-6;  // rad
    for (int i = 0; i < 2; ++i) {
      const Vector2<double> off = kStep * Vector2<double>::Unit(i);
      const Vector2<double> numeric = (pixel_of(off) - pixel_of(-off)) / (2 * kStep);
      EXPECT_LT((landmark.J_pixel_tangent.col(i) - numeric).norm(), 1e-3 * numeric.norm());
    }
  }
}

// Twice the noise is four times the variance.
TEST_F(MadeLandmarks, AreAsUncertainAsTheNoiseSays) {
  TexturedScene noisy;
  noisy.octaves_.set_noise(2 * TexturedScene::kNoise);
  int compared = 0;
  for (TexturedScene* scene : {&scene_, &noisy}) {
    LandmarkMaker maker(TexturedScene::maker_options(), OctaveOptions{}, TexturedScene::kWidth,
                        TexturedScene::kHeight);
    scene->look({0, 0});
    static_cast<void>(scene->make_landmarks(&maker, {0, 0}));
  }
  for (int i = 0; i < scene_.map_.size(); ++i) {
    for (int j = 0; j < noisy.map_.size(); ++j) {
      const Landmark& a = scene_.map_.at(i);
      const Landmark& b = noisy.map_.at(j);
      if (a.octave > 1 || a.octave != b.octave || (a.d - b.d).norm() > 1e-12) continue;
      EXPECT_LT((b.covariance - 4 * a.covariance).norm(), 1e-9 * b.covariance.norm());
      ++compared;
    }
  }
  EXPECT_GT(compared, 40);
}

// The frame's errors are its landmarks', and how the frame follows the calibration, they do.
TEST_F(MadeLandmarks, ShareWhatTheFrameDoesNotKnow) {
  scene_.calibration_.line_delay = 20e-6;
  const Calibration& calibration = scene_.calibration_;
  const ParameterVector steps = parameter_steps(calibration.camera);
  ProcessedFrame frame;
  frame.motion = TexturedScene::motion_at({0, 0});
  frame.motion.rate = {0.01, -0.02};
  frame.covariance.topLeftCorner<2, 2>() << 4, 1, 1, 3;
  frame.shared_covariance << 5, 2, 2, 7;
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j < kParameterCount; ++j) {
      frame.sensitivity(i, j) =
          (i < 2 ? 1 : 100) * TexturedScene::kPixel / steps[j] * std::sin(1 + 3 * i + 7 * j);
    }
  }
  scene_.look({0, 0});
  static_cast<void>(
      maker_.make(calibration, scene_.pyramid_, scene_.octaves_, frame, {}, &scene_.map_));
  ASSERT_GT(scene_.map_.size(), 50);
  for (int slot = 0; slot < scene_.map_.size(); ++slot) {
    const Landmark& landmark = scene_.map_.at(slot);
    EXPECT_EQ(landmark.shared_covariance, (Matrix2<double>() << 9, 3, 3, 10).finished());
    Vector2<double> u;
    ASSERT_TRUE(ViewProjection(calibration, frame.motion).project(landmark.d, &u));
    const auto direction_with = [&](int j, double change) -> Vector3<double> {
      const Calibration changed = plus(calibration, change * ParameterVector::Unit(j));
      const Camera<double>& camera = changed.camera;
      const Vector6 x = change * frame.sensitivity.col(j);
      const auto path = [&](double t) {
        return Vector2<double>(
            frame.motion.angle.pan + x[0] + t * (frame.motion.rate.pan + x[2]),
            frame.motion.angle.tilt + x[1] + t * (frame.motion.rate.tilt + x[3]));
      };
      return true_direction(
          {camera.focal_length, camera.aspect, camera.distortion.radial, camera.width,
           camera.height, changed.line_delay, changed.mechanics.pan_axis,
           changed.mechanics.tilt_axis, camera.centre_offset()},
          path, -frame.motion.reference_row * changed.line_delay, u);
    };
    for (int j = 0; j < kParameterCount; ++j) {
      const Vector3<double> moved = direction_with(j, steps[j]) - direction_with(j, -steps[j]);
      const Vector2<double> numeric = tangent_basis(landmark.d).transpose() * moved / 2;
      const Vector2<double> told = steps[j] * landmark.sensitivity.col(j).cast<double>();
      EXPECT_LT((told - numeric).norm(), 2e-3 * TexturedScene::kPixel + 2e-3 * numeric.norm()) << j;
    }
  }
}

}  // namespace
}  // namespace alidade::test
