#pragma once
// Photos with detail at every scale from 100 to 1.6 degrees, about the direction that a zooming camera looks in.

#include <string>
#include <tuple>

#include "core/model/trigonometry.h"
#include "test/simulator/config.h"

namespace alidade::test {

inline void add_photos_of_all_scales(simulator::Config* config) {
  for (const auto& [name, azimuth, elevation, width] :
       {std::tuple{"friends_by_Aitzol_Berasategi.jpg", 0.7, 0.4, 1.6},
        std::tuple{"life_by_Aitzol_Berasategi.jpg", -0.5, 0.0, 7.0},
        std::tuple{"aitzgorri_by_Aitzol_Berasategi.jpg", 1.0, 1.0, 24.0},
        std::tuple{"picosdeeuropa_by_Aitzol_Berasategi.jpg", 0.0, 0.0, 100.0}}) {
    simulator::PatchConfig photo;
    photo.file = std::string(ALIDADE_TEST_DATA "/") + name;
    photo.azimuth = azimuth * kPi / 180;
    photo.elevation = elevation * kPi / 180;
    photo.width = width * kPi / 180;
    config->scene.photos.push_back(photo);
  }
}

}  // namespace alidade::test
