#pragma once
// `alidade plane`, and the same over HTTP. Its options bear the names of the command line (command_line.cpp), checked there.

#include <string>

namespace alidade {

struct PlaneOptions {
  std::string action;  // fit
  std::string data;    // what is known of the ground, see plane_data.h
  std::string output;  // empty: plane.yaml beside the data
  bool json = false;
};

// Returns the exit code; throws CommandError.
[[nodiscard]] int fit_plane_command(const PlaneOptions& options);

// The same of what a client of `run` tells, POST /api/v1/plane/fit: data as JSON, to the fit as JSON with the text of plane.yaml; that is null, with
// the reason, where there is no plane. False with one line: the data cannot be read.
[[nodiscard]] bool answer_plane_fit(const std::string& body, std::string* answer,
                                    std::string* error);

}  // namespace alidade
