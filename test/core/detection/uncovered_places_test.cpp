#include "core/detection/uncovered_places.h"

#include <gtest/gtest.h>

#include "core/detection/change_regions.h"

namespace alidade::test {
namespace {

constexpr int kWide = 100;
constexpr int kHigh = 60;
constexpr int kScene = 100;  // grey levels

DetectionBox row_of(double u, double width) {
  DetectionBox out;
  out.u = u;
  out.v = 20;
  out.width = width;
  out.height = 12;
  out.score = 7;
  return out;
}

// A scene of one grey level; things are painted into the picture, and boxes are of what changed.
class ChangedScene {
 public:
  void paint(const DetectionBox& where, int grey) {
    each_pixel(where, [&](std::size_t at) { pixels_[at] = static_cast<std::uint16_t>(grey); });
  }
  // z: sigmas.
  void change(const DetectionBox& where, int z) {
    each_pixel(where, [&](std::size_t at) {
      z_[at] = static_cast<std::int16_t>(z * ChangeRegions::kUnit);
    });
    boxes_.push_back(where);
  }
  // The left edges of those that stay.
  std::vector<double> kept() {
    drop_uncovered_places({pixels_.data(), kWide, kHigh}, z_.data(), &boxes_);
    std::vector<double> left;
    for (const DetectionBox& box : boxes_) {
      EXPECT_EQ(box.score, 7);
      left.push_back(box.u);
    }
    return left;
  }

 private:
  template <typename Act>
  static void each_pixel(const DetectionBox& where, Act&& act) {
    for (int v = static_cast<int>(where.v); v < where.v + where.height; ++v) {
      for (int u = static_cast<int>(where.u); u < where.u + where.width; ++u) {
        act(static_cast<std::size_t>(v * kWide + u));
      }
    }
  }

  std::vector<std::uint16_t> pixels_ = std::vector<std::uint16_t>(kWide * kHigh, kScene);
  std::vector<std::int16_t> z_ = std::vector<std::int16_t>(kWide * kHigh);
  std::vector<DetectionBox> boxes_;
};

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
      EXPECT_EQ(scene.kept(), std::vector<double>{front.u}) << to_the_right << " " << brighter;
    }
  }
}

TEST(UncoveredPlaces, TwoTargetsThatPassEachOtherStay) {
  ChangedScene scene;
  scene.paint(row_of(30, 8), kScene + 30);
  scene.paint(row_of(48, 8), kScene - 20);
  scene.change(row_of(30, 8), 9);
  scene.change(row_of(48, 8), -9);
  EXPECT_EQ(scene.kept(), (std::vector<double>{30, 48}));
}

TEST(UncoveredPlaces, WhatChangedTheSameWayStays) {
  ChangedScene scene;
  scene.paint(row_of(40, 16), kScene + 30);
  scene.change(row_of(36, 4), 9);
  scene.change(row_of(52, 4), 9);
  EXPECT_EQ(scene.kept(), (std::vector<double>{36, 52}));
}

// Wider than what lies between: its earlier places would not have overlapped.
TEST(UncoveredPlaces, AWideBoxStays) {
  ChangedScene scene;
  scene.paint(row_of(40, 16), kScene + 30);
  scene.change(row_of(28, 12), -9);
  scene.change(row_of(51, 5), 9);
  EXPECT_EQ(scene.kept(), (std::vector<double>{28, 51}));
}

TEST(UncoveredPlaces, AFarBoxStays) {
  for (const double gap : {12.0, 13.0}) {
    ChangedScene scene;
    scene.paint(row_of(40, gap + 4), kScene + 30);
    scene.change(row_of(36, 4), -9);
    scene.change(row_of(40 + gap, 4), 9);
    EXPECT_EQ(scene.kept().size(), gap == 12 ? 1U : 2U);
  }
}

}  // namespace
}  // namespace alidade::test
