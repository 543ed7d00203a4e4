#include "core/detection/uncovered_places.h"

#include <gtest/gtest.h>

#include "test/core/detection/changed_scene.h"

namespace alidade::test {
namespace {

// The left edges of those that stay.
std::vector<double> kept(ChangedScene scene) {
  drop_uncovered_places(scene.view(), scene.z(), &scene.boxes);
  return scene.left_edges();
}

TEST(UncoveredPlaces, GoWhicheverWayTheTargetGoesAndHoweverBrightItIs) {
  for (const bool to_the_right : {true, false}) {
    for (const int brighter : {30, -30}) {
      ChangedScene scene;
      scene.paint(row_of(40, 16), kScene + brighter);
      const DetectionBox front = to_the_right ? row_of(52, 4) : row_of(40, 4);
      const DetectionBox behind = to_the_right ? row_of(36, 4) : row_of(56, 4);
      const int z = brighter > 0 ? 9 : -9;
      scene.change(behind, -z);
      scene.change(front, z);
      EXPECT_EQ(kept(scene), std::vector<double>{front.u}) << to_the_right << " " << brighter;
    }
  }
}

TEST(UncoveredPlaces, TwoTargetsThatPassEachOtherStay) {
  ChangedScene scene;
  scene.paint(row_of(30, 8), kScene + 30);
  scene.paint(row_of(48, 8), kScene - 20);
  scene.change(row_of(30, 8), 9);
  scene.change(row_of(48, 8), -9);
  EXPECT_EQ(kept(scene), (std::vector<double>{30, 48}));
}

TEST(UncoveredPlaces, WhatChangedTheSameWayStays) {
  ChangedScene scene;
  scene.paint(row_of(40, 16), kScene + 30);
  scene.change(row_of(36, 4), 9);
  scene.change(row_of(52, 4), 9);
  EXPECT_EQ(kept(scene), (std::vector<double>{36, 52}));
}

// Wider than what lies between: its earlier places would not have overlapped.
TEST(UncoveredPlaces, AWideBoxStays) {
  ChangedScene scene;
  scene.paint(row_of(40, 16), kScene + 30);
  scene.change(row_of(28, 12), -9);
  scene.change(row_of(51, 5), 9);
  EXPECT_EQ(kept(scene), (std::vector<double>{28, 51}));
}

TEST(UncoveredPlaces, AFarBoxStays) {
  for (const double gap : {12.0, 13.0}) {
    ChangedScene scene;
    scene.paint(row_of(40, gap + 4), kScene + 30);
    scene.change(row_of(36, 4), -9);
    scene.change(row_of(40 + gap, 4), 9);
    EXPECT_EQ(kept(scene).size(), gap == 12 ? 1U : 2U);
  }
}

}  // namespace
}  // namespace alidade::test
