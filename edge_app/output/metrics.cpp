#include "edge_app/output/metrics.h"

#include <fmt/format.h>

#include <cmath>

namespace alidade {
namespace {

std::string number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "+Inf" : "-Inf";
  return fmt::format("{}", value);
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\n') {
      out += "\\n";
      continue;
    }
    if (c == '\\' || c == '"') out += '\\';
    out += c;
  }
  return out;
}

}  // namespace

void MetricsText::begin(const std::string& name, const std::string& help, const char* type) {
  family_ = name;
  text_ += fmt::format("# HELP {} {}\n# TYPE {} {}\n", name, help, name, type);
}

void MetricsText::line(const std::string& suffix, const Labels& labels, const std::string& value) {
  text_ += family_ + suffix;
  for (const auto& [name, label] : labels) {
    text_ += &name == &labels.front().first ? '{' : ',';
    text_ += fmt::format("{}=\"{}\"", name, escaped(label));
  }
  text_ += (labels.empty() ? " " : "} ") + value + "\n";
}

void MetricsText::add(double value, const Labels& labels) { line("", labels, number(value)); }

void MetricsText::add(std::int64_t value, const Labels& labels) {
  line("", labels, std::to_string(value));
}

void MetricsText::add(const LatencyHistogram& histogram, const Labels& labels) {
  constexpr std::size_t kEvery = 16;
  Labels with_edge = labels;
  with_edge.emplace_back("le", "");
  std::int64_t below = 0;
  // The last bucket holds everything longer; +Inf below covers it.
  for (std::size_t i = 0; i + 1 < LatencyHistogram::kBuckets; ++i) {
    below += histogram.count(i);
    if (i % kEvery != 0) continue;
    with_edge.back().second = fmt::format("{:.6g}", LatencyHistogram::upper_edge_s(i));
    line("_bucket", with_edge, std::to_string(below));
  }
  with_edge.back().second = "+Inf";
  line("_bucket", with_edge, std::to_string(histogram.total()));
  line("_sum", labels, number(histogram.sum_s()));
  line("_count", labels, std::to_string(histogram.total()));
}

}  // namespace alidade
