#include <algorithm>
#include <string>
#include <vector>

#include "core/calibration/estimate_reader.h"
#include "core/calibration/number_text.h"
#include "edge_app/storage/lens_file.h"
#include "edge_app/storage/named_values.h"
#include "platform/streams/picture_size.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

EstimateRange plausible_range(LensParameter parameter) {
  switch (parameter) {
    case LensParameter::kFocalLengthU:
    case LensParameter::kFocalLengthV:
      return {1, 1e7, "pixels, more than 0"};
    case LensParameter::kCentreU:
    case LensParameter::kCentreV:
      return {-1e5, 1e5, "pixels from the image's corner"};
    case LensParameter::kLineDelay:
      return {-1e-3, 1e-3, "seconds a row; 14 microseconds are 14e-6"};
    default:
      return {-1e12, 1e12, "a plain number"};
  }
}

class LensReader {
 public:
  LensReader(const YAML::Node& root, const std::string& name) : file_(root, name) {}

  LensEstimate read() const {
    std::vector<std::string> known = {"format", "image"};
    known.insert(known.end(), kLensParameterNames.begin(), kLensParameterNames.end());
    known.insert(known.end(), {"covariance", "quality"});
    file_.check_top("a lens", known);
    LensEstimate estimate;
    file_.read_image(&estimate.width, &estimate.height);
    if (std::max(estimate.width, estimate.height) > kMostPictureSide) {
      file_.fail(file_.root()["image"],
                 "image is larger than " + std::to_string(kMostPictureSide) + " px");
    }
    const auto check = [&](const LensVector& value) {
      estimate.lens = value;
      check_plausible(estimate);
    };
    estimate.covariance =
        read_named_values(
            file_, kLensParameterNames,
            [](std::size_t i) { return plausible_range(static_cast<LensParameter>(i)); }, check,
            "the unit of the value", "parameters")
            .covariance;
    const YAML::Node& root = file_.root();
    if (root["quality"] && !root["quality"].IsMap()) {
      file_.fail(root["quality"], "quality is not a map; write `quality: {name: value, ...}`");
    }
    return estimate;
  }

 private:
  // Refuses values that suggest another unit or another image.
  void check_plausible(const LensEstimate& estimate) const {
    const auto value = [&](LensParameter parameter) { return estimate.lens[index(parameter)]; };
    const auto name = [](LensParameter parameter) {
      return std::string(kLensParameterNames[static_cast<std::size_t>(index(parameter))]);
    };
    const auto fail = [&](LensParameter parameter, const std::string& what) {
      file_.fail(file_.root()[name(parameter)]["value"],
                 name(parameter) + " " + short_text(value(parameter)) + what);
    };
    for (const LensParameter f : {LensParameter::kFocalLengthU, LensParameter::kFocalLengthV}) {
      if (value(f) < 0.1 * estimate.width) {
        fail(f, " sees more than 157 degrees across the image; give pixels, not millimetres");
      }
    }
    const double aspect = value(LensParameter::kFocalLengthV) / value(LensParameter::kFocalLengthU);
    if (aspect < 0.5 || aspect > 2) {
      fail(LensParameter::kFocalLengthV, " is " + short_text(aspect) +
                                             " times focal_length_u; two focal lengths of one "
                                             "lens are about the same");
    }
    const auto check_centre = [&](LensParameter centre, int size) {
      if (value(centre) < 0 || value(centre) > size) {
        fail(centre, " lies outside the image of " + std::to_string(estimate.width) + "x" +
                         std::to_string(estimate.height) +
                         " px; are image and lens of one camera?");
      }
    };
    check_centre(LensParameter::kCentreU, estimate.width);
    check_centre(LensParameter::kCentreV, estimate.height);
  }

  const EstimateReader file_;
};

}  // namespace

bool parse_lens(const std::string& text, const std::string& name, LensEstimate* lens,
                std::string* error) {
  return read_yaml(
      text, name, {"", "; valid YAML is needed"},
      [&](const YAML::Node& root) { *lens = LensReader(root, name).read(); }, error);
}

bool load_lens(const std::string& path, LensEstimate* lens, std::string* error) {
  std::string text;
  return read_file(path, &text, error) && parse_lens(text, path, lens, error);
}

}  // namespace alidade
