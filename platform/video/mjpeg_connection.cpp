#include "platform/video/mjpeg_connection.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <climits>
#include <cmath>
#include <thread>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/link_rules.h"
#include "platform/system/shown.h"

namespace alidade {
namespace {

constexpr long kReceiveBuffer = 128 * 1024;  // bytes read at a time
// Limits the sleep for the awaited bytes, in case fewer come than announced.
constexpr double kMostAsleep_s = 0.02;
// Parts that are not pictures; one or two before each picture are usual.
constexpr int kUselessInARow = 1000;
// A sender that woke the thread this often for one picture sends byte by byte. From then on it is
// woken at most once per pause.
constexpr int kWakesForAPicture = 256;
constexpr auto kPauseOfWakes = std::chrono::milliseconds(1);
constexpr long kDigest = static_cast<long>(CURLAUTH_DIGEST);
constexpr long kDigestOrBasic = static_cast<long>(CURLAUTH_DIGEST | CURLAUTH_BASIC);

}  // namespace

MjpegConnection::MjpegConnection(const MjpegSourceOptions& options, const Url& url,
                                 TakePicture take_picture)
    : options_(options),
      configured_(url),
      take_picture_(std::move(take_picture)),
      multi_(make_curl_multi()) {}

void MjpegConnection::interrupt() { curl_multi_wakeup(multi_.get()); }

bool MjpegConnection::make_handle(const std::string& url, bool logs_in) {
  asked_ = url;
  logs_in_ = logs_in;
  methods_ = options_.rules.permits_basic(is_by_tls(asked_)) ? kDigestOrBasic : kDigest;
  easy_ = make_http_handle(logs_in ? options_.user : "", options_.password, methods_, curl_error_);
  if (!easy_) {
    return false;
  }
  curl_easy_setopt(easy_.get(), CURLOPT_URL, asked_.c_str());
  curl_easy_setopt(easy_.get(), CURLOPT_BUFFERSIZE, kReceiveBuffer);
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERFUNCTION, &MjpegConnection::on_header);
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEFUNCTION, &MjpegConnection::on_body);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_SOCKOPTFUNCTION, &MjpegConnection::on_socket);
  curl_easy_setopt(easy_.get(), CURLOPT_SOCKOPTDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_CLOSESOCKETFUNCTION, &MjpegConnection::on_close);
  curl_easy_setopt(easy_.get(), CURLOPT_CLOSESOCKETDATA, this);
  return true;
}

int MjpegConnection::on_socket(void* self, curl_socket_t socket, curlsocktype /*purpose*/) {
  auto* connection = static_cast<MjpegConnection*>(self);
  connection->socket_ = socket;
  connection->low_water_ = 1;
  return CURL_SOCKOPT_OK;
}

// libcurl may have opened two sockets for a name with two addresses. A closed number is soon that
// of another file.
int MjpegConnection::on_close(void* self, curl_socket_t socket) {
  auto* connection = static_cast<MjpegConnection*>(self);
  if (socket == connection->socket_) {
    connection->socket_ = CURL_SOCKET_BAD;
    connection->low_water_ = 1;
  }
  return ::close(socket);
}

std::size_t MjpegConnection::on_header(char* /*data*/, std::size_t size, std::size_t count,
                                       void* self) {
  auto* connection = static_cast<MjpegConnection*>(self);
  connection->header_bytes_ += size * count;
  if (connection->header_bytes_ <= kMostHeaderBytes) return size * count;
  connection->refusal_ = kHeadersTooLong;
  return 0;  // ends the transfer with CURLE_WRITE_ERROR
}

std::size_t MjpegConnection::on_body(char* data, std::size_t size, std::size_t count, void* self) {
  auto* connection = static_cast<MjpegConnection*>(self);
  const double arrival_s = monotonic_now_s();
  const std::size_t bytes = size * count;
  long status = 0;
  curl_easy_getinfo(connection->easy_.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status != 200) {
    return bytes;  // an error page; the status says more
  }
  if (!connection->scanner_ && !connection->begin_stream()) {
    return 0;  // ends the transfer with CURLE_WRITE_ERROR
  }
  connection->take_bytes({data, bytes}, arrival_s);
  if (connection->useless_in_a_row_ <= kUselessInARow) return bytes;
  connection->refusal_ = "more than " + std::to_string(kUselessInARow) +
                         " parts in a row are not pictures: this is not a camera's stream";
  return 0;
}

bool MjpegConnection::begin_stream() {
  const char* type = nullptr;
  curl_easy_getinfo(easy_.get(), CURLINFO_CONTENT_TYPE, &type);
  std::string boundary;
  if (!parse_multipart_type(type == nullptr ? "" : type, &boundary)) {
    refusal_ = std::string("the answer is ") + (type == nullptr ? "of no type" : type) +
               ", not a stream of pictures (multipart/x-mixed-replace); give the address of the "
               "camera's MJPEG stream";
    return false;
  }
  scanner_.emplace(boundary, most_picture_bytes(options_.max_pixels));
  discarded_ = 0;
  return true;
}

void MjpegConnection::take_bytes(std::string_view bytes, double arrival_s) {
  scanner_->feed(bytes, arrival_s);
  const std::int64_t discarded =
      scanner_->discarded() - std::exchange(discarded_, scanner_->discarded());
  damaged_ += discarded;
  useless_in_a_row_ += static_cast<int>(discarded);
  MultipartPart part;
  while (scanner_->next(&part)) {
    if (part.body.compare(0, 2, "\xFF\xD8") == 0) {
      ++pictures_;
      useless_in_a_row_ = 0;
      wakes_ = 0;
      worked_ = true;
      last_picture_s_ = arrival_s;
      take_picture_(std::move(part));
      continue;
    }
    ++useless_in_a_row_;
    if (part.content_type.empty() || part.content_type.rfind("image/", 0) == 0) {
      ++damaged_;
    }  // else text between the pictures
  }
}

// One connection from start to end. Each logs in anew: a rebooted camera does not know its earlier
// nonces, and if it does not call them stale, libcurl believes that the password is wrong.
ReadStatus MjpegConnection::receive(const std::function<bool()>& ending, std::string* error) {
  last_picture_s_ = monotonic_now_s();
  Redirection next{configured_.bare, true, ""};
  for (int i = 0; i <= kMostRedirections; ++i) {
    if (!make_handle(next.url, next.takes_login)) {
      *error = kNoCurl;
      return ReadStatus::kDisconnected;
    }
    CURLcode code = CURLE_OK;
    const ReadStatus status = receive_answer(ending, &code, error);
    if (status != ReadStatus::kOk) return status;
    next = redirection_of(easy_.get(), configured_, asked_, options_.rules.redirects);
    if (next.url.empty()) {
      *error = next.error;
      return next.error.empty() ? connection_end(code, error) : ReadStatus::kDisconnected;
    }
  }
  *error = "more than " + std::to_string(kMostRedirections) + " redirections, the last to " +
           shown_url(asked_);
  return ReadStatus::kDisconnected;
}

// kOk: the answer has ended with *code.
ReadStatus MjpegConnection::receive_answer(const std::function<bool()>& ending, CURLcode* code,
                                           std::string* error) {
  scanner_.reset();
  refusal_.clear();
  header_bytes_ = 0;
  useless_in_a_row_ = 0;
  wakes_ = 0;
  curl_error_[0] = '\0';
  pictures_ = 0;
  curl_multi_add_handle(multi_.get(), easy_.get());
  ReadStatus status = ReadStatus::kStopped;
  while (!ending()) {
    int running = 0;
    curl_multi_perform(multi_.get(), &running);
    int queued = 0;
    const CURLMsg* message = curl_multi_info_read(multi_.get(), &queued);
    if (message != nullptr && message->msg == CURLMSG_DONE) {
      *code = message->data.result;
      status = ReadStatus::kOk;
      break;
    }
    const double left_s = last_picture_s_ + options_.timeout_s - monotonic_now_s();
    if (left_s <= 0) {
      *error = std::string(scanner_ ? "bytes come, but no whole picture" : "no answer") +
               " within " + std::to_string(std::lround(1e3 * options_.timeout_s)) + " ms";
      status = ReadStatus::kDisconnected;
      break;
    }
    wait_for_bytes(left_s);
  }
  curl_multi_remove_handle(multi_.get(), easy_.get());
  return status;
}

// A picture comes in many segments. Without a low-water mark, a thread with priority would wake for
// each.
void MjpegConnection::wait_for_bytes(double left_s) {
  if (++wakes_ > kWakesForAPicture) std::this_thread::sleep_for(kPauseOfWakes);
  set_low_water(scanner_ ? scanner_->missing_bytes() : 1);
  const double most_s = low_water_ > 1 ? std::min(left_s, kMostAsleep_s) : left_s;
  int ready = 0;
  curl_multi_poll(multi_.get(), nullptr, 0, poll_milliseconds(most_s), &ready);
  if (ready == 0) {
    set_low_water(1);  // libcurl also polls the socket before it reads
  }
}

// Not for TLS: a record need not be as long as its content.
void MjpegConnection::set_low_water(std::size_t bytes) {
  const auto wanted = static_cast<int>(std::min<std::size_t>(bytes, INT_MAX));
  if (is_by_tls(asked_) || socket_ == CURL_SOCKET_BAD || wanted == low_water_) {
    return;
  }
  if (::setsockopt(socket_, SOL_SOCKET, SO_RCVLOWAT, &wanted, sizeof wanted) == 0) {
    low_water_ = wanted;
  }
}

ReadStatus MjpegConnection::connection_end(CURLcode code, std::string* error) {
  long status = 0;
  curl_easy_getinfo(easy_.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status == 401) {
    *error = logs_in_ ? login_error(easy_.get(), options_.user, methods_)
                      : login_wanted_elsewhere(asked_);
    return worked_ || !logs_in_ ? ReadStatus::kDisconnected : ReadStatus::kFailed;
  }
  if (!refusal_.empty()) {
    *error = refusal_;
  } else if (code != CURLE_OK) {
    *error = curl_error_[0] != '\0' ? curl_error_ : curl_easy_strerror(code);
  } else if (status != 200) {
    *error = "HTTP status " + std::to_string(status) + " instead of a stream of pictures";
  } else {
    *error = std::string("the camera ended the stream") +
             (pictures_ == 0 ? " before its first picture" : "");
  }
  return ReadStatus::kDisconnected;
}

}  // namespace alidade
