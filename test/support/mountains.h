#pragma once
// The virtual camera before a photograph of mountains, 40 degrees wide, with distortion, rolling shutter and a little
// noise. Duration and path are for the test to set. Its target needs ALIDADE_TEST_DATA, where the photograph is.

#include "core/model/trigonometry.h"
#include "test/simulator/config.h"

namespace alidade::test {

inline simulator::Config camera_before_mountains(const simulator::ImageConfig& image,
                                                 double focal_length) {
  simulator::Config config;
  config.image = image;
  config.camera.focal_length = focal_length;
  config.camera.radial_distortion = 0.3;
  config.camera.line_delay = 50e-6;
  simulator::PatchConfig mountains;
  mountains.file = ALIDADE_TEST_DATA "/picosdeeuropa_by_Aitzol_Berasategi.jpg";
  mountains.width = 40 * kPi / 180;
  config.scene.photos.push_back(mountains);
  config.sensor.exposure = 2e-3;
  config.sensor.shot_noise = 0.02;
  config.sensor.read_noise = 0.7;
  return config;
}

}  // namespace alidade::test
