#include "test/platform/support/rtsp_server.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <utility>
#include <vector>

extern char** environ;

namespace alidade {

const char* const kWhitePictures =
    "videotestsrc is-live=true pattern=white ! "
    "video/x-raw,format=I420,width=320,height=240,framerate=30/1 ! ";
const RtspStream kMjpegStream{"/mjpeg",
                              std::string(kWhitePictures) + "jpegenc ! rtpjpegpay name=pay0 pt=26"};
const RtspStream kH264Stream{"/h264",
                             std::string(kWhitePictures) +
                                 "x264enc tune=zerolatency speed-preset=ultrafast key-int-max=10 ! "
                                 "rtph264pay config-interval=1 name=pay0 pt=96"};
const RtspStream kH265Stream{"/h265",
                             std::string(kWhitePictures) +
                                 "x265enc tune=zerolatency speed-preset=ultrafast key-int-max=10 "
                                 "option-string=log-level=none:pools=none:frame-threads=1 ! "
                                 "rtph265pay config-interval=1 name=pay0 pt=96"};

RtspServer::RtspServer(RtspStream stream, std::string user, std::string password,
                       std::string certificate)
    : stream_(std::move(stream)),
      user_(std::move(user)),
      password_(std::move(password)),
      certificate_(std::move(certificate)) {
  restart();
}

void RtspServer::kill() {
  if (child_ > 0) {
    ::kill(child_, SIGKILL);
    ::waitpid(child_, nullptr, 0);
    child_ = -1;
  }
}

void RtspServer::freeze() { ::kill(child_, SIGSTOP); }
void RtspServer::thaw() { ::kill(child_, SIGCONT); }

void RtspServer::restart() {
  kill();
  int ends[2];
  if (::pipe(ends) != 0) {
    throw std::runtime_error("no pipe");
  }
  std::vector<std::string> arguments = {RTSP_SERVER_PROGRAM, std::to_string(port_), user_,
                                        password_,           certificate_,          stream_.path,
                                        stream_.launch};
  std::vector<char*> pointers;
  for (std::string& argument : arguments) {
    pointers.push_back(argument.data());
  }
  pointers.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  posix_spawn_file_actions_addclose(&actions, ends[0]);
  posix_spawn_file_actions_addclose(&actions, ends[1]);
  const int code =
      ::posix_spawn(&child_, RTSP_SERVER_PROGRAM, &actions, nullptr, pointers.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  std::string answer;
  char byte = 0;
  while (code == 0 && ::read(ends[0], &byte, 1) == 1 && byte != '\n') {
    answer += byte;
  }
  ::close(ends[0]);
  if (answer.empty()) {
    throw std::runtime_error("the RTSP server does not start");
  }
  port_ = std::stoi(answer);
}

}  // namespace alidade
