#include "edge_app/commands/log.h"

#include <spdlog/pattern_formatter.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <cstdio>
#include <memory>
#include <string_view>
#include <utility>

#include "platform/system/escaped.h"

namespace alidade {
namespace {

class EscapingFormatter final : public spdlog::formatter {
 public:
  explicit EscapingFormatter(std::unique_ptr<spdlog::formatter> line) : line_(std::move(line)) {}

  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& to) override {
    const std::string text =
        escaped(std::string_view(message.payload.data(), message.payload.size()));
    spdlog::details::log_msg shown = message;
    shown.payload = text;
    line_->format(shown, to);
    // Tells the sink where to put colours.
    message.color_range_start = shown.color_range_start;
    message.color_range_end = shown.color_range_end;
  }
  [[nodiscard]] std::unique_ptr<spdlog::formatter> clone() const override {
    return std::make_unique<EscapingFormatter>(line_->clone());
  }

 private:
  std::unique_ptr<spdlog::formatter> line_;
};

}  // namespace

void start_log() {
  spdlog::set_default_logger(spdlog::stderr_color_mt("alidade"));
  spdlog::set_formatter(std::make_unique<EscapingFormatter>(
      std::make_unique<spdlog::pattern_formatter>("%H:%M:%S.%e %^%l%$ %v")));
}

void print_error(const std::string& text) {
  std::fprintf(stderr, "alidade: %s\n", escaped(text).c_str());
}

}  // namespace alidade
