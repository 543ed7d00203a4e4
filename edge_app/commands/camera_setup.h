#pragma once
// From a found camera to a configuration that `check` accepts: the text is made, read as `run`
// would read it, both links are tried, and only then it is written. The password gets a file of its
// own in the same folder, which only its owner can read. Nothing is overwritten; after a failure
// nothing is left.

#include <string>
#include <vector>

#include "edge_app/commands/camera_search.h"

namespace alidade {

struct CameraSetupOptions {
  std::string path;    // of the configuration to write
  std::string device;  // as in CameraSearchOptions; empty: the only camera
  std::string user;    // empty: no login
  std::string password;
  std::string password_file;      // an existing one to name; empty: the password is stored
  std::string field_of_view;      // deg; "62:2.3" of a lens that zooms
  std::string head;               // "pelco_d:/dev/ttyUSB0"; empty: the camera's own telemetry
  std::vector<std::string> keys;  // "pan_tilt.pan_positive=left"; they replace what was found
  bool try_links = true;
};

struct CameraSetupResult {
  std::string path;
  std::string password_file;         // that was written; empty: none
  std::vector<std::string> remarks;  // one line each
};

// Throws CommandError if a file exists already, the camera cannot be used, a value is missing or
// wrong, a link that is tried delivers nothing, or a file cannot be written. The error's line names
// it.
[[nodiscard]] CameraSetupResult set_up_camera(const CameraFindings& findings,
                                              const CameraSetupOptions& options);

// Throws CommandError if the configuration, or the file for its password, exists already.
void refuse_existing_files(const CameraSetupOptions& options);

// Throws CommandError if the camera that is meant cannot be used, or if there is none.
void refuse_unusable_camera(const CameraFindings& findings, const CameraSetupOptions& options);

// Whether the chosen camera needs a field of view that the options lack: a value of
// camera.focal_length_px is not among the keys.
[[nodiscard]] bool lacks_field_of_view(const CameraSetupOptions& options);

}  // namespace alidade
