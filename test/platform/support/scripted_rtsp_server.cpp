#include "test/platform/support/scripted_rtsp_server.h"

#include <algorithm>

#include "test/simulator/servers/digest_check.h"

namespace alidade {
namespace {

constexpr int kPace_ms = 5;  // between two pictures

const char* const kDescription =
    "v=0\r\no=- 1 1 IN IP4 127.0.0.1\r\ns=x\r\nc=IN IP4 127.0.0.1\r\nt=0 0\r\n"
    "m=video 0 RTP/AVP 26\r\na=control:track1\r\n";

RtspAnswer plain_answer(const RtspRequest& request) {
  RtspAnswer answer;
  if (request.method == "OPTIONS") {
    answer.headers = "Public: OPTIONS, DESCRIBE, SETUP, PLAY, GET_PARAMETER, TEARDOWN\r\n";
  } else if (request.method == "DESCRIBE") {
    answer.body = kDescription;
  } else if (request.method == "SETUP") {
    answer.headers =
        "Transport: " + header_of(request.text, "Transport") + "\r\nSession: 1;timeout=2\r\n";
  }
  return answer;
}

}  // namespace

// What is sent on one connection.
struct ScriptedRtspServer::Stream {
  bool by_tcp = true;
  bool playing = false;
  std::unique_ptr<RtpRelay> relay;
  std::unique_ptr<RtpSender> sender;
  std::int64_t packets = 0;  // sent within the connection
};

int ScriptedRtspServer::count(const std::string& method, const std::string& text) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return static_cast<int>(
      std::count_if(requests_.begin(), requests_.end(), [&](const RtspRequest& request) {
        return request.method == method && request.text.find(text) != std::string::npos;
      }));
}

void ScriptedRtspServer::serve(int fd) {
  Stream stream;
  std::string received;
  pollfd waiting{fd, POLLIN, 0};
  while (!server_.closing()) {
    if (::poll(&waiting, 1, kPace_ms) > 0) {
      char buffer[2048];
      const ssize_t count = ::recv(fd, buffer, sizeof buffer, 0);
      if (count <= 0) return;
      received.append(buffer, static_cast<std::size_t>(count));
    }
    for (auto end = received.find("\r\n\r\n"); end != std::string::npos;
         end = received.find("\r\n\r\n")) {
      const std::string text = received.substr(0, end + 4);
      received.erase(0, end + 4);
      const RtspRequest request{server_.connections(), text.substr(0, text.find(' ')), text};
      if (request.method != "RTSP/1.0" && !answer(fd, request, &stream)) return;
      const std::lock_guard<std::mutex> lock(mutex_);
      requests_.push_back(request);
    }
    if (!stream.playing) continue;
    if (hang_up.exchange(false)) return;
    if (stop_speaking.exchange(false)) ::shutdown(fd, SHUT_WR);
    if (ask.exchange(false)) RawServer::send(fd, "OPTIONS * RTSP/1.0\r\nCSeq: 77\r\n\r\n");
    if (!send_picture(fd, &stream)) return;
  }
}

// False: the other side has closed.
bool ScriptedRtspServer::answer(int fd, const RtspRequest& request, Stream* stream) {
  RtspAnswer answer = plain_answer(request);
  script_(request, &answer);
  if (request.method == "SETUP") {
    const std::string transport = header_of(request.text, "Transport");
    const auto port = transport.find("client_port=");
    stream->by_tcp = port == std::string::npos;
    stream->relay =
        std::make_unique<RtpRelay>(stream->by_tcp ? 9 : std::stoi(transport.substr(port + 12)));
    stream->sender = std::make_unique<RtpSender>(RtpSender::Codec::kMjpeg, stream->relay->port());
  }
  stream->playing = stream->playing || (request.method == "PLAY" && answer.status == "200 OK");
  if (!answer.before.empty() && !RawServer::send(fd, answer.before)) return false;
  for (int i = 0; answer.pictures_before && i < 2; ++i) {
    if (!send_picture(fd, stream)) return false;
  }
  const std::string type = answer.body.empty() ? "" : "Content-Type: application/sdp\r\n";
  return RawServer::send(
      fd, "RTSP/1.0 " + answer.status + "\r\nCSeq: " + header_of(request.text, "CSeq") + "\r\n" +
              answer.headers + type + "Content-Length: " + std::to_string(answer.body.size()) +
              "\r\n\r\n" + answer.body);
}

bool ScriptedRtspServer::send_picture(int fd, Stream* stream) const {
  const std::int64_t picture = stream->sender->sent();
  stream->sender->send();
  std::string within;
  stream->relay->forward([&](RtpRelay::Packets& packets) {
    if (change_packets) change_packets(picture, &packets);
    if (!stream->by_tcp) return;
    for (const RtpRelay::Packet& packet : packets) {
      std::string bytes = {'$', 0, static_cast<char>(packet.size() >> 8U),
                           static_cast<char>(packet.size())};
      bytes.append(packet.begin(), packet.end());
      if (change_bytes) change_bytes(stream->packets, &bytes);
      ++stream->packets;
      within += bytes;
    }
    packets.clear();
  });
  return within.empty() || RawServer::send(fd, within);
}

}  // namespace alidade
