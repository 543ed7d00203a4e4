#include "platform/pan_tilt/onvif_addresses.h"

#include <strings.h>

#include <algorithm>
#include <string_view>

namespace alidade {
namespace {

constexpr std::string_view kDevicePath = "/onvif/device_service";
constexpr const char* kPtzPaths[] = {"/onvif/ptz_service", "/onvif/PTZ", "/onvif/ptz", "/onvif/Ptz",
                                     "/onvif/services"};
constexpr const char* kMediaPaths[] = {"/onvif/media_service", "/onvif/Media", "/onvif/media",
                                       "/onvif/services"};

struct ToldAddress {
  std::string scheme;
  std::string host;  // empty: none is given
  std::string port;
  std::string path;
};

// Not parsed by libcurl, which takes onvif for the host of http:///onvif/ptz.
ToldAddress parse_told(const std::string& told) {
  ToldAddress address;
  const std::size_t scheme_end = told.find("://");
  if (scheme_end == std::string::npos) {
    address.path = told.empty() || told[0] == '/' ? told : "/" + told;
    return address;
  }
  address.scheme = told.substr(0, scheme_end);
  const std::string rest = told.substr(scheme_end + 3);
  const std::size_t path_begin = std::min(rest.find('/'), rest.size());
  address.path = path_begin < rest.size() ? rest.substr(path_begin) : "/";
  address.host = rest.substr(0, path_begin);
  const std::size_t user_end = address.host.rfind('@');
  address.host.erase(0, user_end == std::string::npos ? 0 : user_end + 1);
  const std::size_t bracket = address.host.rfind(']');  // end of an IPv6 address
  const std::size_t colon = address.host.find(':', bracket == std::string::npos ? 0 : bracket);
  if (colon != std::string::npos) {
    address.port = address.host.substr(colon + 1);
    address.host.resize(colon);
  }
  return address;
}

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
}

}  // namespace

std::string onvif_address(const Url& device, const std::string& path) {
  const bool own_port = !device.port.empty() && path.rfind(':', 0) != 0;
  return device.scheme + "://" + device.host + (own_port ? ":" + device.port : "") + path;
}

std::vector<std::string> onvif_addresses(const Url& device, const std::string& told_text,
                                         OnvifService service, bool other_port) {
  std::vector<std::string> addresses;
  const auto add = [&addresses](const std::string& address) {
    if (std::find(addresses.begin(), addresses.end(), address) == addresses.end()) {
      addresses.push_back(address);
    }
  };
  const ToldAddress told = parse_told(told_text);
  const std::string_view path(device.path);
  const bool is_usual = path.size() >= kDevicePath.size() &&
                        path.substr(path.size() - kDevicePath.size()) == kDevicePath;
  const std::string prefix(is_usual ? path.substr(0, path.size() - kDevicePath.size())
                                    : std::string_view());
  if (!told.path.empty()) {
    if (::strcasecmp(told.host.c_str(), device.host.c_str()) == 0 &&
        ::strcasecmp(told.scheme.c_str(), device.scheme.c_str()) == 0 && other_port &&
        is_number(told.port)) {
      add(onvif_address(device, ":" + told.port + told.path));
    }
    if (prefix.empty() || told.path.rfind(prefix + "/", 0) == 0) {
      add(onvif_address(device, told.path));
    } else {
      add(onvif_address(device, prefix + told.path));
      add(onvif_address(device, told.path));
    }
  }
  const auto add_usual = [&](const auto& paths) {
    for (const char* usual : paths) add(onvif_address(device, prefix + usual));
  };
  service == OnvifService::kPtz ? add_usual(kPtzPaths) : add_usual(kMediaPaths);
  add(onvif_address(device, device.path));
  return addresses;
}

}  // namespace alidade
