#include "test/platform/support/axis_server.h"

#include <openssl/evp.h>

#include <map>
#include <regex>
#include <stdexcept>
#include <utility>

namespace alidade {
namespace {

constexpr const char* kRealm = "AXIS_TEST";
constexpr const char* kNonce = "0123456789abcdef";

std::string md5(const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  EVP_Digest(text.data(), text.size(), digest, &size, EVP_md5(), nullptr);
  std::string hex;
  for (unsigned i = 0; i < size; ++i) {
    constexpr const char* kDigits = "0123456789abcdef";
    hex += kDigits[digest[i] >> 4];
    hex += kDigits[digest[i] & 15];
  }
  return hex;
}

}  // namespace

AxisServer::AxisServer(std::string user, std::string password, std::function<std::string()> answer,
                       int port)
    : user_(std::move(user)), password_(std::move(password)), answer_(std::move(answer)) {
  server_.set_keep_alive_max_count(1'000'000);
  server_.set_tcp_nodelay(true);
  server_.Get("/axis-cgi/com/ptz.cgi",
              [this](const httplib::Request& request, httplib::Response& response) {
                serve_position(request, response);
              });
  port_ = port == 0 ? server_.bind_to_any_port("127.0.0.1") : port;
  if (port != 0 && !server_.bind_to_port("127.0.0.1", port)) {
    throw std::runtime_error("the port is taken");
  }
  thread_ = std::thread([this] { server_.listen_after_bind(); });
  while (!server_.is_running()) {
    std::this_thread::yield();
  }
}

AxisServer::~AxisServer() {
  server_.stop();
  thread_.join();
}

std::string AxisServer::last_query() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return last_query_;
}

std::size_t AxisServer::connections() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return client_ports_.size();
}

bool AxisServer::authorised(const httplib::Request& request) const {
  const std::string header = request.get_header_value("Authorization");
  if (header.rfind("Digest ", 0) != 0) {
    return false;
  }
  std::map<std::string, std::string> field;
  const std::regex pair("(\\w+)=(\"([^\"]*)\"|[^,\\s]+)");
  for (std::sregex_iterator match(header.begin(), header.end(), pair), end; match != end; ++match) {
    field[(*match)[1]] = (*match)[3].matched ? (*match)[3].str() : (*match)[2].str();
  }
  const std::string secret = md5(user_ + ":" + kRealm + ":" + password_);
  const std::string what = md5("GET:" + field["uri"]);
  return field["username"] == user_ && field["nonce"] == kNonce && field["uri"] == request.target &&
         field["response"] == md5(secret + ":" + kNonce + ":" + field["nc"] + ":" +
                                  field["cnonce"] + ":auth:" + what);
}

void AxisServer::serve_position(const httplib::Request& request, httplib::Response& response) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    last_query_ = request.target;
    client_ports_.insert(request.remote_port);
  }
  if (!user_.empty() && !authorised(request)) {
    ++refusals;
    response.status = 401;
    response.set_header("WWW-Authenticate", std::string("Digest realm=\"") + kRealm +
                                                "\", nonce=\"" + kNonce +
                                                "\", algorithm=MD5, qop=\"auth\"");
    return;
  }
  ++polls;
  response.status = status;
  response.set_content(answer_(), "text/plain");
}

}  // namespace alidade
