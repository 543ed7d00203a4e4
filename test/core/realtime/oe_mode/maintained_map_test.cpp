// The map as a whole: begun, handed over, moved with the lens, forgotten where nothing is as it
// should be.

#include "core/realtime/oe_mode/maintained_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "test/core/realtime/oe_mode/textured_scene.h"

namespace alidade::test {
namespace {

class WholeMap : public testing::Test {
 protected:
  static OeOptions options() {
    OeOptions out;
    out.max_width = TexturedScene::kWidth;
    out.max_height = TexturedScene::kHeight;
    out.max_landmarks = 1000;
    out.maker = TexturedScene::maker_options();
    return out;
  }

  WholeMap() {
    begin(&map_);
    image_.reset(TexturedScene::kHeight);
    see(scene_.look({0, 0}));
  }

  void begin(MaintainedMap* map) {
    map->reset(scene_.calibration_);
    map->begin(scene_.calibration_);
  }

  void see(const ImageView& view) {
    frame_.frame = ++frames_;
    frame_.motion = TexturedScene::motion_at({0, 0});
    EXPECT_TRUE(image_.build(view, scene_.calibration_.camera));
    image_.learn_noise(view, true);
  }

  TexturedScene scene_;
  ImageOctaves image_{options()};
  MaintainedMap map_{options()};
  ProcessedFrame frame_;
  std::uint32_t frames_ = 0;
};

TEST_F(WholeMap, RefusesImagesOfAnotherSize) {
  Camera<double> wider = scene_.calibration_.camera;
  wider.width += 1;
  EXPECT_FALSE(image_.build(scene_.look({0, 0}), wider));
  EXPECT_FALSE(image_.build({}, scene_.calibration_.camera));
}

TEST_F(WholeMap, BeginsEmptyAndTakesAllThatAnotherHas) {
  EXPECT_TRUE(map_.empty());
  EXPECT_EQ(map_.make(scene_.calibration_, image_, frame_, nullptr), 1);
  map_.begin_shear(frame_);
  const MapState state = map_.state();
  ASSERT_GT(state.landmarks.size(), 50U);
  MaintainedMap other(options());
  begin(&other);
  EXPECT_FALSE(other.take({}, image_.octaves()));
  ASSERT_TRUE(other.take(state, image_.octaves()));
  EXPECT_EQ(static_cast<std::size_t>(other.landmarks().size()), state.landmarks.size());
  EXPECT_EQ(other.shear().covariances(), map_.shear().covariances());
  other.begin(scene_.calibration_);
  EXPECT_TRUE(other.empty());
}

TEST_F(WholeMap, RetiresWhatWasHandedOverAndIsNotThere) {
  static_cast<void>(map_.make(scene_.calibration_, image_, frame_, nullptr));
  MaintainedMap other(options());
  begin(&other);
  ASSERT_TRUE(other.take(map_.state(), image_.octaves()));
  const int before = other.landmarks().size();
  // Nothing can be judged where nothing is to be seen.
  see(scene_.look_at_nothing());
  EXPECT_FALSE(other.retire_unproven(scene_.calibration_, image_, frame_, false));
  EXPECT_EQ(other.landmarks().size(), before);
  see(scene_.look({700, 300}));
  EXPECT_EQ(other.retire_unproven(scene_.calibration_, image_, frame_, false), 0);
  EXPECT_LT(other.landmarks().size(), before);
}

TEST_F(WholeMap, MovesWithTheLensAndBack) {
  static_cast<void>(map_.make(scene_.calibration_, image_, frame_, nullptr));
  ParameterDirection along = ParameterDirection::Zero();
  along[index(Parameter::kFocalLength)] = TexturedScene::kFocalLength;
  const MapState before = map_.state();
  map_.move(1e-3, along);
  const MapState after = map_.state();
  ASSERT_EQ(after.landmarks.size(), before.landmarks.size());
  double farthest = 0;
  for (std::size_t i = 0; i < before.landmarks.size(); ++i) {
    const Vector3<double>& d = before.landmarks[i].d;
    farthest = std::max(farthest, (after.landmarks[i].d - d).norm());
    EXPECT_LT((moved_direction(after.landmarks[i], -1e-3, along) - d).norm(), 1e-9);
  }
  // A thousandth of the way from the image's middle.
  EXPECT_GT(farthest, 0.05 * TexturedScene::kPixel);
  EXPECT_LT(farthest, 0.25 * TexturedScene::kPixel);
}

TEST_F(WholeMap, CountsItsZoomFromTheLensThatItBeganWith) {
  EXPECT_EQ(map_.zoom_of(TexturedScene::kFocalLength), 0);
  EXPECT_EQ(map_.zoom_of(2 * TexturedScene::kFocalLength), LandmarkMap::kZoomsPerOctave);
  Calibration near = scene_.calibration_;
  near.camera.focal_length *= 2;
  map_.begin(near);
  EXPECT_EQ(map_.zoom_of(TexturedScene::kFocalLength), -LandmarkMap::kZoomsPerOctave);
}

TEST_F(WholeMap, ForgetsLandmarksThatRemainCrooked) {
  static_cast<void>(map_.make(scene_.calibration_, image_, frame_, nullptr));
  frame_.covariance(2, 2) = 1e-6;
  map_.forget_crooked(scene_.calibration_, frame_);
  EXPECT_TRUE(map_.empty());
  // Those to come are as wrong as this frame's rates.
  EXPECT_DOUBLE_EQ(map_.shear().covariances()[0](1, 1), 1e-6);
}

}  // namespace
}  // namespace alidade::test
