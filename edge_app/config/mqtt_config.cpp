#include "edge_app/config/mqtt_config.h"

#include <fmt/format.h>

#include <algorithm>

#include "edge_app/config/link_keys.h"
#include "platform/system/url.h"

namespace alidade {
namespace {

// mqtt://broker, mqtts://broker:8883, mqtt://[::1]:1883.
void read_broker(YamlSection& section, MqttOptions* mqtt) {
  const std::string text = required_url(section, "mqtt://broker", {"mqtt://", "mqtts://"});
  Url url;
  std::string error;
  if (!parse_url(text, &url, &error) || url.host.empty())
    section.fail("url", "is not an address; expected for example mqtt://broker:1883");
  if (!url.path.empty() && url.path != "/")
    section.fail("url", "has a path, but a broker has none; set the topics by mqtt.prefix");
  mqtt->tls = is_by_tls(url.scheme);
  mqtt->host = url.host;
  // An IPv6 address stands in brackets.
  if (mqtt->host.size() > 2 && mqtt->host.front() == '[')
    mqtt->host = mqtt->host.substr(1, mqtt->host.size() - 2);
  constexpr int kPort = 1883;
  constexpr int kPortOfTls = 8883;
  mqtt->port = url.port.empty() ? (mqtt->tls ? kPortOfTls : kPort) : std::stoi(url.port);
  if (mqtt->port == 0) section.fail("url", "has port 0; expected for example mqtt://broker:1883");
}

void read_tls_files(YamlSection& section, const std::string& config_path, MqttOptions* mqtt) {
  for (const auto& [key, file] : {std::pair{"ca_file", &mqtt->ca_file},
                                  {"certificate_file", &mqtt->certificate_file},
                                  {"key_file", &mqtt->key_file}}) {
    const auto path = section.text(key);
    if (!path) continue;
    if (!mqtt->tls) section.fail(key, "is for mqtts:// only; change mqtt.url, or leave it out");
    *file = path_relative_to(config_path, *path);
  }
  if (mqtt->certificate_file.empty() != mqtt->key_file.empty()) {
    section.fail(mqtt->key_file.empty() ? "certificate_file" : "key_file",
                 "is given alone; give certificate_file and key_file");
  }
}

std::string read_prefix(YamlSection& section, const std::string& usual) {
  std::string prefix = section.text("prefix").value_or(usual);
  constexpr std::size_t kLongest = 200;
  const bool is_topic = !prefix.empty() && prefix.size() <= kLongest && prefix.front() != '/' &&
                        prefix.front() != '$' && prefix.back() != '/' &&
                        std::all_of(prefix.begin(), prefix.end(), [](char c) {
                          return c > ' ' && c < 0x7f && c != '+' && c != '#';
                        });
  if (!is_topic) {
    section.fail("prefix",
                 "is not a topic; expected for example site/mast, letters, digits and signs "
                 "without blanks, + and #, and no / or $ at its beginning, no / at its end");
  }
  return prefix;
}

}  // namespace

MqttOptions read_mqtt(YamlSection section, const std::string& config_path,
                      std::vector<std::string>* warnings) {
  MqttOptions mqtt;
  read_broker(section, &mqtt);
  read_tls_files(section, config_path, &mqtt);
  read_login(section, config_path, &mqtt.user, &mqtt.password);
  if (!mqtt.password.empty() && !mqtt.tls && !is_loopback(mqtt.host)) {
    warnings->push_back(section.where("url") +
                        ": the password crosses the network unencrypted; use mqtts://");
  }
  mqtt.prefix = read_prefix(section, mqtt.prefix);
  mqtt.client_id = section.text("client_id").value_or("");
  mqtt.qos = section.integer("qos", {0, 2, "quality of service"}).value_or(mqtt.qos);
  mqtt.keep_alive_s = section.integer("keep_alive_s", {5, 3600, "s"}).value_or(mqtt.keep_alive_s);
  mqtt.timeout_s = section.number("timeout_s", kSeconds).value_or(mqtt.timeout_s);
  mqtt.max_backoff_s = section.number("max_backoff_s", kSeconds).value_or(mqtt.max_backoff_s);
  mqtt.orientation_rate_hz =
      section.number("orientation_rate_hz", {0, 1000, "Hz"}).value_or(mqtt.orientation_rate_hz);
  section.finish();
  return mqtt;
}

}  // namespace alidade
