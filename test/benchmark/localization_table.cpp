// Localization by a scene map and its upkeep beside the real-time step (paired_turns.h): each picture is followed at once by the next, each that is found changes
// the map on disk.
// Usage: localization_table [FILE.json [normal]]

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "core/mapping/features.h"
#include "core/mapping/map_building.h"
#include "edge_app/localization/scene_localization.h"
#include "edge_app/storage/scene_map_file.h"
#include "edge_app/taps/scene_tap.h"
#include "test/benchmark/paired_turns.h"
#include "test/benchmark/sent_pictures.h"
#include "test/support/temporary_directory.h"

namespace alidade::benchmarks {
namespace {

constexpr int kEach = 9;         // of the camera's images is a keyframe
constexpr double kPause = 1e-3;  // s, between two pictures

SceneMap map_of(const TurningCamera& camera) {
  const Calibration& calibration = camera.calibration();
  MapBuildOptions options;
  options.width = calibration.camera.width;
  options.height = calibration.camera.height;
  options.line_delay = calibration.line_delay;
  options.mechanics = calibration.mechanics;
  MapBuilder builder(options);
  const FeatureDetector detector;
  for (int k = 0; k < camera.frames(); k += kEach) {
    const double time_s = camera.middle_row_time_s(k);
    MapView view;
    view.frame = k;
    view.log_f = std::log(calibration.camera.focal_length);
    view.telemetry = camera.angle(time_s);
    view.angle_sigma = kPacedSigma;
    view.angular_velocity =
        angular_velocity(calibration.mechanics, *view.telemetry, camera.rate(time_s));
    const ImageView image = camera.view(k);
    builder.add(view, detector.find(image.luma, image.width, image.height, image.stride));
  }
  MapBuild built = builder.build();
  require(built.status == MapBuildStatus::kOk, to_string(built.status));
  return std::move(built.map);
}

class MapLoad final : public Beside {
 public:
  explicit MapLoad(const SceneMap& map) : path_(directory_.path() + "/scene.map") {
    std::string error;
    require(save_scene_map(path_, map, &error) && file_.open(path_, &error), error.c_str());
    SceneMap stored;
    require(file_.read(&stored, &error), error.c_str());
    locator_ = std::make_unique<SceneLocalization>(
        std::move(stored), path_, BaseJudgeOptions{}, true, std::nullopt,
        [this](const MapChange& change, std::string* why) { return file_.update(change, why); });
    tap_ = std::make_unique<SceneTap>(*locator_, SceneTapOptions{kPause, kPause});
  }
  void join(PipelineOptions* options) override { options->scene = tap_.get(); }
  [[nodiscard]] nlohmann::json stop() override {
    const SceneReport report = locator_->report();
    require(report.upkeep && !report.upkeep->stopped, "the map was not kept up");
    return {{"pictures", report.pictures},
            {"found", report.found},
            {"landmarks", report.landmarks},
            {"transactions", report.upkeep->updates}};
  }

 private:
  TemporaryDirectory directory_;
  std::string path_;
  SceneMapFile file_;
  std::unique_ptr<SceneLocalization> locator_;
  std::unique_ptr<SceneTap> tap_;
};

}  // namespace
}  // namespace alidade::benchmarks

int main(int argc, char** argv) {
  using namespace alidade::benchmarks;
  std::unique_ptr<const alidade::SceneMap> map;
  return compare_turns(argc, argv, "localization", "localization and upkeep",
                       [&map](const TurningCamera& camera) {
                         if (!map) map = std::make_unique<const alidade::SceneMap>(map_of(camera));
                         return std::make_unique<MapLoad>(*map);
                       });
}
