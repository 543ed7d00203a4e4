#include "core/detection/target_pieces.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "test/core/detection/changed_scene.h"

namespace alidade::test {
namespace {

// A z of 9 is a difference of 18 grey levels.
constexpr double kSigmaGrey = 2;

std::vector<DetectionBox> pieces_joined(ChangedScene scene, const ChangeOptions& options = {}) {
  join_target_pieces(scene.view(), scene.z(), kSigmaGrey, options, &scene.boxes);
  return scene.boxes;
}

// A target of 30 x 24 px of which the outline's four sides changed: outside of it the scene came out again.
ChangedScene outlined(int brighter) {
  ChangedScene scene;
  scene.paint(box_of(35, 18, 30, 24), kScene + brighter);
  const int z = brighter > 0 ? 9 : -9;
  scene.change(box_of(35, 22, 5, 16), z);
  scene.change(box_of(66, 22, 3, 16), -z);
  scene.change(box_of(44, 18, 12, 3), z);
  scene.change(box_of(44, 43, 12, 2), -z);
  return scene;
}

TEST(TargetPieces, AroundWhatHasTheirGreyLevelAreOneThing) {
  for (const int brighter : {20, -20}) {
    const std::vector<DetectionBox> boxes = pieces_joined(outlined(brighter));
    ASSERT_EQ(boxes.size(), 1U) << brighter;
    EXPECT_EQ(boxes[0].u, 35);
    EXPECT_EQ(boxes[0].v, 18);
    EXPECT_EQ(boxes[0].u + boxes[0].width, 69);
    EXPECT_EQ(boxes[0].v + boxes[0].height, 45);
    EXPECT_EQ(boxes[0].score, 7);
  }
}

TEST(TargetPieces, AreNoneLargerThanABoxMayBe) {
  ChangeOptions options;
  options.most_size_px = 29;
  for (const DetectionBox& box : pieces_joined(outlined(20), options)) {
    EXPECT_LE(std::max(box.width, box.height), options.most_size_px);
  }
}

TEST(TargetPieces, TwoTargetsBeforeAnEvenSkyStayTwo) {
  for (const int other : {20, -20}) {
    ChangedScene scene;
    scene.paint(row_of(30, 12), kScene + 20);
    scene.paint(row_of(54, 12), kScene + other);
    scene.change(row_of(30, 12), 9);
    scene.change(row_of(54, 12), other > 0 ? 9 : -9);
    EXPECT_EQ(pieces_joined(scene).size(), 2U);
  }
}

// Its mean is the targets' grey level, which half of its pixels are far from.
TEST(TargetPieces, TwoTargetsBeforeASceneOfManyGreyLevelsStayTwo) {
  ChangedScene scene;
  for (int u = 42; u < 54; ++u) {
    scene.paint(row_of(u, 1), kScene + 20 + (u % 4 < 2 ? 14 : -14));
  }
  scene.paint(row_of(30, 12), kScene + 20);
  scene.paint(row_of(54, 12), kScene + 20);
  scene.change(row_of(30, 12), 9);
  scene.change(row_of(54, 12), 9);
  EXPECT_EQ(pieces_joined(scene).size(), 2U);
}

TEST(TargetPieces, WhatIsFarFromATargetIsNoneOfIt) {
  ChangedScene scene;
  scene.paint(row_of(10, 60), kScene + 20);
  scene.change(row_of(10, 4), 9);
  scene.change(row_of(66, 4), 9);
  EXPECT_EQ(pieces_joined(scene).size(), 2U);
}

TEST(TargetPieces, ABoxThatHasGrownTakesWhatItHasComeNearTo) {
  ChangedScene scene = outlined(20);
  scene.change(box_of(70, 40, 3, 3), -9);
  EXPECT_EQ(pieces_joined(scene).size(), 1U);
}

}  // namespace
}  // namespace alidade::test
