// `alidade discover`: which cameras there are, on the network and on this machine; what each
// offers; and a configuration for one of them. The report goes to stdout, questions to the
// terminal.

#include "edge_app/commands/discover.h"

#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdio>

#include "edge_app/commands/camera_search.h"
#include "edge_app/commands/camera_setup.h"
#include "edge_app/commands/command.h"
#include "edge_app/commands/terminal_prompt.h"
#include "platform/system/text.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

constexpr const char* kNoTerminal = "there is no terminal to ask for the ";

std::string password_in(const std::string& file) {
  std::string text;
  std::string error;
  if (!read_file(file, &text, &error))
    throw CommandError(kExitUsage, error + "; put the password there");
  return std::string(first_line(text));
}

std::string wanted_password(const DiscoverOptions& options) {
  if (!options.password_file.empty()) return password_in(options.password_file);
  if (!can_ask()) {
    throw CommandError(kExitUsage, std::string(kNoTerminal) +
                                       "password at; give --password-file, a file whose first line "
                                       "it is");
  }
  const auto password = ask_secret(fmt::format("password of {}: ", options.user));
  if (!password) throw CommandError(kExitUsage, "no password was given");
  return *password;
}

CameraSetupOptions setup_options(const DiscoverOptions& options) {
  CameraSetupOptions setup;
  setup.path = options.write;
  setup.device = options.device;
  setup.user = options.user;
  setup.password_file = options.password_file;
  setup.field_of_view = options.field_of_view;
  setup.head = options.head;
  setup.keys = options.keys;
  setup.try_links = !options.untried;
  return setup;
}

void print_found(const CameraFindings& findings, bool json) {
  const std::string text = json ? json_of_findings(findings).dump(
                                      -1, ' ', false, nlohmann::json::error_handler_t::replace) +
                                      "\n"
                                : text_of_findings(findings);
  std::fputs(text.c_str(), stdout);
  if (std::fflush(stdout) != 0) throw CommandError(kExitFailed, "stdout: cannot be written");
}

void write_configuration(const CameraFindings& findings, CameraSetupOptions setup) {
  refuse_unusable_camera(findings, setup);
  if (lacks_field_of_view(setup) && can_ask()) {
    setup.field_of_view =
        ask("horizontal field of view in degrees, by the data sheet (wide:tele if it zooms): ")
            .value_or("");
  }
  const CameraSetupResult result = set_up_camera(findings, setup);
  if (setup.try_links) spdlog::info("tried: a picture and an angle came");
  for (const std::string& remark : result.remarks) spdlog::info("{}", remark);
  if (!result.password_file.empty())
    spdlog::info("{}: the password, for its owner only (mode 600)", result.password_file);
  spdlog::info("{}: written; next: alidade check -c {}", result.path, result.path);
}

}  // namespace

int discover_cameras(const DiscoverOptions& options) {
  CameraSetupOptions setup = setup_options(options);
  if (!options.write.empty()) refuse_existing_files(setup);
  CameraSearchOptions search;
  search.network.duration_s = options.duration_s;
  search.network.interface = options.interface;
  search.device = options.device;
  if (!options.user.empty()) {
    setup.password = wanted_password(options);
    search.login.user = options.user;
    search.login.password = setup.password;
  }
  if (is_terminal(STDERR_FILENO) && options.duration_s > 0)
    fmt::print(stderr, "searching for {:g} s ...\n", options.duration_s);
  const CameraFindings findings = find_cameras(search);
  print_found(findings, options.json);
  if (!options.user.empty() && options.device.empty() && findings.cameras.size() > 1) {
    throw CommandError(kExitUsage,
                       "several cameras were found, and a login is for one; name it with --device");
  }
  if (!options.write.empty()) {
    write_configuration(findings, setup);
    return kExitOk;
  }
  const FoundCamera* const named =
      options.device.empty() ? nullptr : find_camera(findings, options.device);
  if (named != nullptr && !named->report.error.empty() && !named->report.wants_login)
    throw CommandError(kExitFailed, named->device.host + ": " + named->report.error);
  if (!findings.cameras.empty() || !findings.video_devices.empty()) return kExitOk;
  throw CommandError(
      kExitFailed,
      "no camera was found; a search reaches only this machine's own networks, and a firewall may "
      "keep answers out (UDP from ports 3702 and 5353). If you know its address: alidade discover "
      "--device ADDRESS");
}

}  // namespace alidade
