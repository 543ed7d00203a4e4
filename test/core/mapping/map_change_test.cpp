#include "core/mapping/map_change.h"

#include <gtest/gtest.h>

#include "test/core/mapping/random_scene_map.h"

namespace alidade::test {
namespace {

SceneLandmark landmark_with(const SceneMap& map, std::int64_t id) {
  SceneLandmark out = map.landmarks[3];
  out.id = id;
  return out;
}

TEST(MapChange, IsAppliedAsAWhole) {
  SceneMap map = random_scene_map(3, 5, 20);
  const std::size_t landmarks = map.landmarks.size();
  MapChange change;
  change.died = {map.landmarks[0].id, map.landmarks[7].id};
  SceneLandmark moved = map.landmarks[5];
  moved.d_b = -moved.d_b;
  change.changed = {moved};
  SceneKeyframe keyframe = map.keyframes[1];
  keyframe.id = map.keyframes.back().id + 1;
  change.new_keyframes = {keyframe};
  change.born = {landmark_with(map, map.next_landmark), landmark_with(map, map.next_landmark + 4)};
  change.born[1].sightings = {{keyframe.id, {1, 2}, 1}};
  std::string error;
  ASSERT_TRUE(apply(change, &map, &error)) << error;
  EXPECT_TRUE(is_valid(map, &error)) << error;
  EXPECT_EQ(map.landmarks.size(), landmarks);
  EXPECT_EQ(landmark_index(map, change.died[1]), -1);
  EXPECT_EQ(map.landmarks[static_cast<std::size_t>(landmark_index(map, moved.id))].d_b, moved.d_b);
  EXPECT_EQ(map.next_landmark, change.born[1].id + 1);
  EXPECT_EQ(map.keyframes.size(), 6U);
}

TEST(MapChange, WhatDoesNotFitIsNamedAndChangesNothing) {
  const SceneMap before = random_scene_map(3, 5, 20);
  const SceneLandmark& there = before.landmarks[4];
  std::vector<std::pair<const char*, MapChange>> slips(8);
  slips[0] = {"has an id that is not new", {{}, {}, {landmark_with(before, there.id)}, {}}};
  slips[1] = {"is changed, but is not in the map", {{}, {landmark_with(before, 1000)}, {}, {}}};
  slips[2] = {"is changed, but is not in the map", {{}, {there}, {}, {there.id}}};
  slips[3] = {"is removed, but is not in the map", {{}, {}, {}, {1000}}};
  slips[4] = {"is removed, but is not in the map", {{}, {}, {}, {there.id, there.id}}};
  slips[5] = {"which does not exist", {{}, {there}, {}, {}}};
  slips[5].second.changed[0].sightings = {{99, {1, 2}, 1}};
  slips[6] = {"not a unit vector", {{}, {there}, {}, {}}};
  slips[6].second.changed[0].d_b *= 2;
  slips[7] = {"has an id that is not new", {{before.keyframes[2]}, {}, {}, {}}};
  for (const auto& [what, change] : slips) {
    SceneMap map = before;
    std::string error;
    EXPECT_FALSE(apply(change, &map, &error)) << what;
    EXPECT_NE(error.find(what), std::string::npos) << what << ": " << error;
    EXPECT_EQ(map.landmarks.size(), before.landmarks.size());
    EXPECT_EQ(map.keyframes.size(), before.keyframes.size());
    EXPECT_EQ(map.next_landmark, before.next_landmark);
  }
}

}  // namespace
}  // namespace alidade::test
