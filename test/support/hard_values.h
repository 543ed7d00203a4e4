#pragma once
// Hand-picked values on which geometry breaks: zero, the edges of the series, half and whole turns,
// the cameras and mounts at the ends of what Alidade meets. Every property of the model is tested
// over them.

#include <cmath>
#include <string>
#include <vector>

#include "core/model/angle.h"
#include "core/model/calibration.h"
#include "core/model/direction.h"
#include "core/model/lens/camera.h"
#include "core/model/mechanics.h"
#include "core/model/rolling_shutter.h"

namespace alidade::test {

// rad; 0.1 is where trigonometry.h changes from series to formula.
inline std::vector<double> hard_angles() {
  return {0,
          1e-300,
          1e-12,
          1e-5,
          std::nextafter(0.1, 0),
          0.1,
          0.7,
          kPi / 2,
          3,
          kPi - 1e-5,
          kPi - 1e-9,
          std::nextafter(kPi, 0),
          kPi,
          std::nextafter(kPi, 4),
          kPi + 1e-9,
          4,
          6};
}

// Unit vectors: coordinate axes, ties of the tangent basis, near-ties, the general case.
inline std::vector<Vector3<double>> hard_directions() {
  std::vector<Vector3<double>> directions = {
      {1, 0, 0},    {0, 1, 0},     {0, 0, 1},         {-1, 0, 0},         {0, -1, 0},
      {0, 0, -1},   {1, 1, 0},     {0, 1, 1},         {1, 0, -1},         {1, 1, 1},
      {-1, 1, -1},  {1e-9, 0, 1},  {0.012, 0, 1},     {0.001, -0.014, 1}, {0.3, -0.5, 0.8},
      {-5, 0.1, 2}, {1, 1e-12, 0}, {-0.7, 0.70001, 3}};
  for (auto& d : directions) d.normalize();
  return directions;
}

struct NamedCamera {
  std::string name;
  Camera<double> camera;
  // How far beyond each border of the image tests go, in image sizes: as far as the model reaches.
  double margin;
};

inline std::vector<NamedCamera> hard_cameras() {
  return {{"paper", {32008, 1, {55.4}, 1920, 1080}, 0.5},
          {"paper, barrel", {32008, 1, {-55.4}, 1920, 1080}, 0.2},
          {"not square", {8000, 1.03, {3}, 1280, 720}, 0.5},
          {"no distortion", {1000, 1, {0}, 1280, 720}, 0.5},
          {"k barely positive", {1000, 1, {1e-18}, 1280, 720}, 0.5},
          {"k barely negative", {1000, 1, {-1e-18}, 1280, 720}, 0.5},
          {"wide, pincushion", {600, 0.98, {0.4}, 1280, 720}, 0.5},
          {"wide, barrel", {900, 1, {-0.15}, 1280, 720}, 0.05},
          {"off centre", {1500, 1.01, {0.2}, 1280, 720, 21.5, -13.25}, 0.5}};
}

// points_a_side^2 pixels from border to border, margins included.
inline std::vector<Vector2<double>> pixel_grid(const NamedCamera& named, int points_a_side) {
  std::vector<Vector2<double>> pixels;
  const auto coordinate = [&](int i, int size) {
    return size * ((1 + 2 * named.margin) * i / (points_a_side - 1) - named.margin);
  };
  for (int i = 0; i < points_a_side; ++i) {
    for (int j = 0; j < points_a_side; ++j) {
      pixels.emplace_back(coordinate(i, named.camera.width), coordinate(j, named.camera.height));
    }
  }
  return pixels;
}

// The paper's mount: axes 12 and 14 mrad off.
inline Mechanics<double> paper_mechanics() {
  Mechanics<double> mechanics;
  mechanics.pan_axis = Vector3<double>(-0.012, 0.001, 1).normalized();
  mechanics.tilt_axis = Vector3<double>(0.002, 1, 0.014).normalized();
  return mechanics;
}

inline std::vector<Mechanics<double>> hard_mechanics() {
  Mechanics<double> slanted;
  slanted.pan_axis = Vector3<double>(0.3, -0.2, 0.9).normalized();
  slanted.tilt_axis = Vector3<double>(-0.1, 0.8, 0.4).normalized();
  slanted.pan_scale = 1.02;
  slanted.tilt_scale = 0.97;
  return {Mechanics<double>(), paper_mechanics(), slanted};
}

// s/row: none, the paper's (a camera upside down), and 1080 rows in a 30th of a second.
inline std::vector<double> hard_line_delays() { return {0, -14.2e-6, 14.2e-6, 30e-6}; }

// At rest, slow, fast, across the seam at half a turn, and accelerating.
inline std::vector<FrameMotion<double>> hard_motions() {
  return {{{0, 0}, {0, 0}, 0},
          {{0.4, -0.2}, {0.02, -0.01}, 540},
          {{-2, 0.9}, {-0.5, 0.3}, 0},
          {{kPi - 1e-4, 0.1}, {0.6, -0.2}, 360},
          {{-kPi, -1.2}, {-0.3, -0.4}, 1080},
          {{0.2, 0.3}, {0.4, -0.3}, 540, {3, -5}},
          {{0.4, -0.2}, {0.1, -0.05}, 540, {}, 0.85},
          {{-1, 0.3}, {-0.2, 0.1}, 0, {1, 0.5}, -2}};
}

}  // namespace alidade::test
