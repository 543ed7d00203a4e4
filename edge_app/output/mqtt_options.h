#pragma once
// Where and how to publish by MQTT: section `mqtt` of the configuration
// (edge_app/config/mqtt_config.h).

#include <string>

namespace alidade {

struct MqttOptions {
  std::string host;
  int port = 1883;
  bool tls = false;
  std::string ca_file;           // PEM; empty: the system's authorities
  std::string certificate_file;  // PEM, of the client; empty: none
  std::string key_file;          // PEM, with certificate_file
  std::string user;              // empty: none
  std::string password;
  std::string client_id;  // empty: random
  std::string prefix = "alidade";
  int qos = 1;  // MQTT's quality of service, 0 to 2
  // s, 5 to 3600; after 1.5 times this without a sign the broker says `offline`.
  int keep_alive_s = 15;
  double timeout_s = 5;            // s, from an attempt to the broker's answer
  double max_backoff_s = 30;       // s, longest pause between two attempts
  double orientation_rate_hz = 1;  // at most; 0: orientation is not published

  // For messages: mqtts://broker:8883.
  [[nodiscard]] std::string name() const {
    const bool bracketed = host.find(':') != std::string::npos;
    return (tls ? "mqtts://" : "mqtt://") + (bracketed ? "[" + host + "]" : host) + ":" +
           std::to_string(port);
  }
};

}  // namespace alidade
