#include "edge_app/commands/live_targets.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <cerrno>
#include <sstream>
#include <system_error>
#include <thread>
#include <utility>

#include "edge_app/commands/command.h"
#include "edge_app/commands/network_trial.h"
#include "platform/system/realtime.h"
#include "platform/system/whole_file.h"

namespace alidade {
namespace {

// Does not block: a pipe without a reader is an error.
FileDescriptor open_to_append(const std::string& path) {
  if (path.empty()) return FileDescriptor();
  FileDescriptor file(
      ::open(path.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC | O_NONBLOCK, 0666));
  if (!file.is_open()) {
    throw CommandError(kExitFailed,
                       path + ": cannot be written: " + std::generic_category().message(errno) +
                           "; give output.targets a file that can");
  }
  return file;
}

std::shared_ptr<const PlaneEstimate> plane_of(const Config& config,
                                              std::shared_ptr<const PlaneEstimate> plane) {
  return config.tracking.targets->tracker.space == TargetSpace::kPlane ? std::move(plane) : nullptr;
}

constexpr std::size_t kMostNetworkBytes = std::size_t{1} << 30;

// Reads a file with one name a line; throws CommandError.
std::vector<std::string> read_class_names(const std::string& path) {
  std::string text;
  std::string error;
  if (!read_file(path, &text, &error)) throw CommandError(kExitUsage, "detectors.onnx: " + error);
  std::vector<std::string> names;
  std::istringstream in(text);
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.empty()) continue;
    if (!is_class_name(line)) {
      throw CommandError(
          kExitUsage, fmt::format("detectors.onnx: {}:{}: is not a class name ({} bytes); expected "
                                  "text of at most {} bytes, without control characters",
                                  path, number, line.size(), kLongestClass));
    }
    names.push_back(line);
  }
  if (names.empty()) {
    throw CommandError(kExitUsage, "detectors.onnx: " + path +
                                       ": is empty; expected the classes' names, one a line");
  }
  return names;
}

}  // namespace

std::unique_ptr<NetworkDetector> load_network(const std::optional<NetworkFiles>& files) {
  if (!files) return nullptr;
  NetworkOptions options = files->options;
  std::string model;
  std::string error;
  if (!read_file(files->model, &model, &error, kMostNetworkBytes)) {
    throw CommandError(kExitUsage, "detectors.onnx: " + error);
  }
  if (!files->labels.empty()) options.labels = read_class_names(files->labels);
  if (!survives_trial(model, options, &error)) {
    throw CommandError(kExitUsage, "detectors.onnx: " + files->model + ": " + error);
  }
  std::unique_ptr<NetworkDetector> network;
  // OpenCV's worker threads inherit the priority of the thread that first needs them. So a thread
  // of the lowest priority loads the network, not the one that starts the real-time thread.
  std::thread([&] {
    static_cast<void>(set_lowest_priority());
    network = NetworkDetector::load(model, options, &error);
  }).join();
  if (!network) {
    throw CommandError(kExitUsage, "detectors.onnx: " + files->model + ": " + error);
  }
  spdlog::info("network: {}, {} classes", files->model, network->classes());
  return network;
}

LiveTargets::LiveTargets(const Config& config, std::shared_ptr<const PlaneEstimate> plane)
    : file_(open_to_append(config.output.targets)),
      lines_((config.output.targets.empty()
                  ? nullptr
                  : &writer_.emplace(file_.get(), config.output.targets, "targets",
                                     LineWriter::Stalled::kDrop))),
      feed_(*config.tracking.targets, plane_of(config, plane)) {
  feed_.add_on_news([this](const auto& state) { lines_.take(*state); });
  if (!config.detectors.any()) return;
  tap_.emplace(detectors_.emplace(config.detectors, std::move(plane),
                                  load_network(config.detectors.onnx), feed_));
  std::string names;
  for (auto row = kDetectorKinds.rbegin(); row != kDetectorKinds.rend(); ++row) {
    if (config.detectors.has(row->kind)) names += std::string(" ") + row->name;
  }
  spdlog::info("detectors:{}", names);
}

DetectorsReport LiveTargets::detectors() const {
  DetectorsReport report = detectors_->report();
  report.replaced = tap_->replaced();
  return report;
}

void LiveTargets::start() {
  if (!feed_.start()) throw CommandError(kExitFailed, "the thread for targets cannot be started");
}

void LiveTargets::stop() {
  feed_.stop();
  spdlog::info("targets: {}", detections_text(feed_.snapshot().counters));
  if (writer_ && writer_->dropped() > 0)
    spdlog::warn(
        "{} lines of targets were not written, as the reader of output.targets was too slow",
        writer_->dropped());
}

std::unique_ptr<LiveTargets> make_live_targets(const Config& config,
                                               const std::shared_ptr<const PlaneEstimate>& plane) {
  if (!config.tracking.targets) return nullptr;
  if (!config.output.http && !config.detectors.any()) {
    spdlog::info("targets: none, as nothing delivers detections; set output.http, or detectors");
    return nullptr;
  }
  return std::make_unique<LiveTargets>(config, plane);
}

}  // namespace alidade
