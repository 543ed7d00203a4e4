#pragma once
// RecordingVerifier: runs `alidade verify RECORDING` while `run` goes on. It starts this program
// again in a process of its own, so that neither its memory nor a crash of it is that of `run`. The
// process has the lowest priority, and is killed after half an hour.

#include <atomic>
#include <mutex>
#include <string>
#include <thread>

#include "edge_app/output/recording_verification.h"
#include "platform/system/file_descriptor.h"

namespace alidade {

class RecordingVerifier {
 public:
  // program: path of an executable that takes `verify RECORDING --json`.
  explicit RecordingVerifier(std::string program = "/proc/self/exe");
  // Kills the process, if there is one.
  ~RecordingVerifier();
  RecordingVerifier(const RecordingVerifier&) = delete;
  RecordingVerifier& operator=(const RecordingVerifier&) = delete;

  // Any thread; returns at once. False: a verification is under way.
  [[nodiscard]] bool begin(const std::string& recording);
  // Any thread.
  [[nodiscard]] RecordingVerification state() const;

 private:
  void run(std::string recording);

  const std::string program_;
  FileDescriptor ends_;       // an eventfd, readable once the process is to end
  mutable std::mutex mutex_;  // guards the members below
  RecordingVerification state_;
  std::thread thread_;
};

}  // namespace alidade
