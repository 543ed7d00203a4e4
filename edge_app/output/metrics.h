#pragma once
// MetricsText: Prometheus' text format, one family after the other. Names contain their unit; names
// of counters end in _total.
//   # HELP alidade_frames_total Video frames
//   # TYPE alidade_frames_total counter
//   alidade_frames_total 1234
// A value that is not finite is written as NaN, +Inf or -Inf, as the format allows. Pure;
// allocates.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/pipeline/latency_histogram.h"

namespace alidade {

class MetricsText {
 public:
  // Names and values; a value may be any text.
  using Labels = std::vector<std::pair<std::string, std::string>>;

  // These begin a family. The values that follow belong to it.
  void gauge(const std::string& name, const std::string& help) { begin(name, help, "gauge"); }
  void counter(const std::string& name, const std::string& help) { begin(name, help, "counter"); }
  void histogram(const std::string& name, const std::string& help) {
    begin(name, help, "histogram");
  }

  void add(double value, const Labels& labels = {});
  void add(std::int64_t value, const Labels& labels = {});
  // For a histogram family. Every 16th bucket is written; a written bucket is 2.2 times as long as
  // the written one before.
  void add(const LatencyHistogram& histogram, const Labels& labels = {});

  [[nodiscard]] const std::string& text() const { return text_; }

 private:
  void begin(const std::string& name, const std::string& help, const char* type);
  void line(const std::string& suffix, const Labels& labels, const std::string& value);

  std::string family_;
  std::string text_;
};

}  // namespace alidade
