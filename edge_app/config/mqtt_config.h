#pragma once
// Section `mqtt`: the broker to which status, targets and orientation are published
// (edge_app/output/mqtt_publisher.h).
//   url                                   required: mqtt://broker:1883, or with TLS
//                                         mqtts://broker:8883; the port may be left out
//   ca_file, certificate_file, key_file   PEM; only with mqtts
//   user, password_env | password_file
//   prefix, client_id, qos, keep_alive_s, timeout_s, max_backoff_s, orientation_rate_hz
// Meanings and defaults: mqtt_options.h.

#include <string>
#include <vector>

#include "edge_app/config/yaml_section.h"
#include "edge_app/output/mqtt_options.h"

namespace alidade {

// Throws ConfigError.
MqttOptions read_mqtt(YamlSection section, const std::string& config_path,
                      std::vector<std::string>* warnings);

}  // namespace alidade
