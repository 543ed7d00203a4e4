#pragma once
// `alidade plane`, and the same over HTTP. The command line (command_line.cpp) names the options as
// here and checks them.

#include <string>

namespace alidade {

struct PlaneOptions {
  std::string action;  // "fit"
  std::string data;    // file with what is known of the ground, see plane_data.h
  std::string output;  // empty: plane.yaml beside the data
  bool json = false;
};

// Returns kExitOk. Throws CommandError if the data cannot be read, no plane or no heading follows
// from it, the result would overwrite the data, or a file or stdout cannot be written.
[[nodiscard]] int fit_plane_command(const PlaneOptions& options);

// The same for a client of `run`, POST /api/v1/plane/fit. body: the data as JSON. *answer: the fit
// as JSON with the text of plane.yaml; if there is no plane, the text is null and a message says
// why. False with one line in *error if the data cannot be read.
[[nodiscard]] bool answer_plane_fit(const std::string& body, std::string* answer,
                                    std::string* error);

}  // namespace alidade
