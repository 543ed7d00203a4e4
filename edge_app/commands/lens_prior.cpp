#include "edge_app/commands/lens_prior.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <optional>

#include "core/calibration/correlation.h"
#include "core/pattern/lens_camera.h"
#include "edge_app/commands/command.h"
#include "edge_app/storage/lens_file.h"

namespace alidade {
namespace {

// The lens for the same image scaled to this size.
LensEstimate scaled_lens(const LensEstimate& lens, int width, int height) {
  const double scale = static_cast<double>(width) / lens.width;
  LensVector factor = LensVector::Ones();
  for (const LensParameter parameter : {LensParameter::kFocalLengthU, LensParameter::kFocalLengthV,
                                        LensParameter::kCentreU, LensParameter::kCentreV}) {
    factor[index(parameter)] = scale;
  }
  factor[index(LensParameter::kLineDelay)] = static_cast<double>(lens.height) / height;
  LensEstimate result;
  result.width = width;
  result.height = height;
  result.lens = lens.lens.cwiseProduct(factor);
  result.covariance = factor.asDiagonal() * lens.covariance * factor.asDiagonal();
  return result;
}

// The factor for variances that are used without their correlations.
double variance_growth(const Matrix<double, 4, 4>& covariance) {
  return Eigen::SelfAdjointEigenSolver<Matrix<double, 4, 4>>(correlation_of(covariance),
                                                             Eigen::EigenvaluesOnly)
      .eigenvalues()
      .maxCoeff();
}

}  // namespace

KnownCamera load_lens_prior(const std::string& path, int width, int height,
                            std::vector<std::string>* remarks) {
  LensEstimate lens;
  std::string error;
  if (!load_lens(path, &lens, &error)) throw CommandError(kExitUsage, error);
  if (lens.width != width || lens.height != height) {
    if (std::abs(lens.height * static_cast<double>(width) / lens.width - height) > 1) {
      throw CommandError(
          kExitUsage,
          fmt::format(
              "{}: is for images of {}x{} px, but these have {}x{} px and another shape, so it is "
              "unknown which part of the sensor they show; calibrate the lens in this video mode",
              path, lens.width, lens.height, width, height));
    }
    remarks->push_back(
        fmt::format("{}: is for images of {}x{} px and is scaled to {}x{}; if the camera reads "
                    "other rows of its sensor in this video mode, calibrate the lens in this mode",
                    path, lens.width, lens.height, width, height));
    lens = scaled_lens(lens, width, height);
  }
  const std::optional<LensCamera> nearest =
      camera_of_lens(lens.lens, lens.covariance, width, height);
  if (!nearest) {
    throw CommandError(kExitUsage,
                       path +
                           ": its distortion is not monotone within the image; calibrate the lens "
                           "again with the pattern shown up to the image's corners");
  }
  const double growth = variance_growth(nearest->covariance);
  const auto known = [&](double value, int row) {
    return KnownValue{{value, std::sqrt(growth * nearest->covariance(row, row))}, true};
  };
  KnownCamera camera;
  camera.name = path;
  camera.focal_length = known(nearest->camera.focal_length, 0);
  camera.aspect = known(nearest->camera.aspect, 1);
  camera.radial_distortion = known(nearest->camera.distortion.only_term(), 2);
  camera.line_delay = known(nearest->line_delay, 3);
  return camera;
}

}  // namespace alidade
