#include "edge_app/output/manual_pages.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <filesystem>
#include <system_error>
#include <utility>

#include "platform/system/whole_file.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

constexpr const char* kRoot = "/manual/";
constexpr std::size_t kMostBytes = std::size_t{16} << 20;
constexpr const char* kPolicy =
    "default-src 'none'; style-src 'self'; script-src 'self'; img-src 'self'; connect-src 'self'; "
    "base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

struct FileKind {
  const char* extension;
  const char* type;
};
constexpr std::array<FileKind, 9> kKinds = {{{".html", "text/html; charset=utf-8"},
                                             {".css", "text/css; charset=utf-8"},
                                             {".js", "text/javascript; charset=utf-8"},
                                             {".png", "image/png"},
                                             {".svg", "image/svg+xml"},
                                             {".json", "application/json"},
                                             {".yaml", "text/plain; charset=utf-8"},
                                             {".py", "text/plain; charset=utf-8"},
                                             {".txt", "text/plain; charset=utf-8"}}};

// Null: such files are not served.
const char* type_of(const fs::path& path) {
  const std::string extension = path.extension();
  const auto* const kind = std::find_if(kKinds.begin(), kKinds.end(), [&](const FileKind& one) {
    return extension == one.extension;
  });
  return kind == kKinds.end() ? nullptr : kind->type;
}

bool is_plain(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
         c == '-' || c == '.' || c == '/';
}

// Whether each part of "how-to/verify.html" is there and not hidden.
bool is_safe(const std::string& path) {
  return std::all_of(path.begin(), path.end(), is_plain) && path.find("//") == std::string::npos &&
         path.find("/.") == std::string::npos && path.front() != '/' && path.front() != '.';
}

ServerResponse no_such_page() {
  return http_error(404, "the manual has no such page; it begins at /manual/");
}

ServerResponse manual_page(const std::string& folder, std::string path) {
  if (path.empty() || path.back() == '/') path += "index.html";
  std::error_code failed;
  if (folder.empty() || !fs::is_directory(folder, failed)) {
    return http_error(404,
                      "the manual is not installed beside this program: install the package, "
                      "or build the target `manual` and install that");
  }
  const char* const type = type_of(path);
  if (type == nullptr || !is_safe(path)) return no_such_page();
  const fs::path root = fs::canonical(folder, failed);
  if (failed) return no_such_page();
  const fs::path file = fs::canonical(root / path, failed);
  if (failed ||
      std::mismatch(root.begin(), root.end(), file.begin(), file.end()).first != root.end())
    return no_such_page();
  std::string body;
  std::string error;
  if (!read_file(file, &body, &error, kMostBytes)) return no_such_page();
  return http_page(type, std::move(body), kPolicy);
}

ServerResponse to_the_root() {
  ServerResponse response = http_error(308, "the manual begins at /manual/");
  response.headers.emplace_back("Location", kRoot);
  return response;
}

}  // namespace

std::string installed_manual() {
  std::error_code failed;
  const fs::path program = fs::read_symlink("/proc/self/exe", failed);
  if (failed) return "";
  return program.parent_path().parent_path() / "share/doc/alidade/manual";
}

void add_manual_pages(HttpServer* server, const std::string& folder) {
  server->get("/manual", HttpAccess::kOpen, [](const ServerRequest&) { return to_the_root(); });
  server->get_below("/manual/", HttpAccess::kOpen, [folder](const ServerRequest& request) {
    return manual_page(folder, request.path.substr(std::string(kRoot).size()));
  });
}

}  // namespace alidade
