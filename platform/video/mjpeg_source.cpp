#include "platform/video/mjpeg_source.h"

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <climits>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>
#include <utility>

#include "platform/system/clock.h"
#include "platform/system/curl_handles.h"
#include "platform/system/shown.h"
#include "platform/system/url.h"
#include "platform/video/jpeg_decoder.h"
#include "platform/video/multipart_scanner.h"
#include "platform/video/receiving_thread.h"
#include "platform/video/remarks.h"
#include "platform/video/stamp_guard.h"
#include "platform/video/stream_copy.h"

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
constexpr int kDamagedInARow = 30;  // pictures: more are not an accident
// A part without a new, plausible time stamp adds doubt of the sender's clock; each good one
// reduces it by 1.
constexpr int kDoubtOfABadStamp = 20;
constexpr int kMostDoubt = 2 * kDoubtOfABadStamp;
constexpr std::size_t kShownUrl = 120;  // bytes
constexpr const char* kNoCurl = "libcurl does not start";
constexpr long kDigest = static_cast<long>(CURLAUTH_DIGEST);
constexpr long kDigestOrBasic = static_cast<long>(CURLAUTH_DIGEST | CURLAUTH_BASIC);

class MjpegSource : public FrameSource {
 public:
  explicit MjpegSource(const MjpegSourceOptions& options);
  ReadStatus read(Frame& frame, double timeout_s) override;

  void stop() override { thread_.stop(); }
  bool refuse(const std::string& reason) override {
    thread_.refuse(reason);
    return true;
  }
  std::string error() const override { return error_; }
  std::string name() const override { return name_; }
  FrameSourceCounters counters() const override {
    return {damaged_, thread_.dropped(), unstamped_};
  }
  std::string remark() override { return remarks_.take(); }

 private:
  void interrupt() {
    if (multi_) {
      curl_multi_wakeup(multi_.get());
    }
  }
  [[nodiscard]] bool is_by_tls() const { return asked_.rfind("https://", 0) == 0; }
  static int on_socket(void* self, curl_socket_t socket, curlsocktype purpose);
  static int on_close(void* self, curl_socket_t socket);
  static std::size_t on_header(char* data, std::size_t size, std::size_t count, void* self);
  static std::size_t on_body(char* data, std::size_t size, std::size_t count, void* self);
  bool make_handle(const std::string& url, bool logs_in);
  bool begin_stream();
  void take_bytes(std::string_view bytes, double arrival_s);
  ReadStatus receive_connection(std::string* error);
  ReadStatus receive_answer(CURLcode* code, std::string* error);
  void wait_for_bytes(double left_s);
  void set_low_water(std::size_t bytes);
  ReadStatus connection_end(CURLcode code, std::string* error);
  ReadStatus fail(const std::string& error) {
    error_ = name_ + ": " + error;
    failed_ = true;
    return ReadStatus::kFailed;
  }
  ReadStatus deliver(MultipartPart part, Frame& frame);
  void stamp_sender_time(const MultipartPart& part, FrameStamp* stamp);

  MjpegSourceOptions options_;
  std::string name_;
  Url configured_;

  std::atomic<std::int64_t> damaged_{0};
  std::atomic<std::int64_t> unstamped_{0};
  Remarks remarks_;

  // Used by the receiving thread only.
  char curl_error_[CURL_ERROR_SIZE] = "";
  std::string asked_;     // the URL, after redirections
  bool logs_in_ = false;  // at asked_
  long methods_ = kDigest;
  curl_socket_t socket_ = CURL_SOCKET_BAD;   // of the open connection
  int low_water_ = 1;                        // bytes at which poll() wakes
  CurlMultiPtr multi_;                       // stop() wakes it
  CurlEasyPtr easy_;                         // of this connection
  std::optional<MultipartScanner> scanner_;  // of this connection, created with its first bytes
  std::size_t header_bytes_ = 0;             // of this connection's answers
  std::string refusal_;                      // why the body of the answer was rejected
  int useless_in_a_row_ = 0;                 // parts
  int wakes_ = 0;                            // since the last picture
  std::int64_t discarded_ = 0;               // discarded by the scanner, as far as counted
  std::int64_t pictures_ = 0;                // of this connection
  bool worked_ = false;                      // a picture has come on any connection
  double last_picture_s_ = 0;                // arrival of the last picture, or start of the
                                             // connection

  // Used by read() only.
  std::string error_;
  bool failed_ = false;
  bool restarted_ = true;
  std::int64_t next_frame_ = 0;
  int damaged_in_a_row_ = 0;
  int clock_doubt_ = 0;  // above kMostDoubt: no sender time for the rest of the connection
  std::optional<double> last_sender_time_s_;  // of this connection, unchecked
  StampGuard stamps_;
  JpegDecoder decoder_;
  CodecParametersPtr parameters_ = picture_parameters(AV_CODEC_ID_MJPEG);
  StreamCopy copy_;

  // Last, as its thread uses the other members.
  ReceivingThread<MultipartPart> thread_{
      options_.max_backoff_s, [this](std::string* error) { return receive_connection(error); },
      [this] { interrupt(); }};
};

MjpegSource::MjpegSource(const MjpegSourceOptions& options) : options_(options) {
  silence_av_log();
  Url url;
  std::string error;
  const bool is_url = parse_url(options.url, &url, &error);
  name_ = url.bare;
  if (!is_url) {
    (void)fail(error);
    return;
  }
  if (url.scheme != "http" && url.scheme != "https") {
    (void)fail("not an MJPEG stream; the URL must be http://host[:port]/path or https://...");
    return;
  }
  configured_ = url;
  if (options_.user.empty() && options_.password.empty()) {
    options_.user = url.user;
    options_.password = url.password;
  }
  multi_ = make_curl_multi();
  if (!multi_) {
    (void)fail(kNoCurl);
  }
}

bool MjpegSource::make_handle(const std::string& url, bool logs_in) {
  asked_ = url;
  logs_in_ = logs_in;
  methods_ = options_.rules.permits_basic(is_by_tls()) ? kDigestOrBasic : kDigest;
  easy_ = make_http_handle(logs_in ? options_.user : "", options_.password, methods_, curl_error_);
  if (!easy_) {
    return false;
  }
  curl_easy_setopt(easy_.get(), CURLOPT_URL, asked_.c_str());
  curl_easy_setopt(easy_.get(), CURLOPT_BUFFERSIZE, kReceiveBuffer);
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERFUNCTION, &MjpegSource::on_header);
  curl_easy_setopt(easy_.get(), CURLOPT_HEADERDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEFUNCTION, &MjpegSource::on_body);
  curl_easy_setopt(easy_.get(), CURLOPT_WRITEDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_SOCKOPTFUNCTION, &MjpegSource::on_socket);
  curl_easy_setopt(easy_.get(), CURLOPT_SOCKOPTDATA, this);
  curl_easy_setopt(easy_.get(), CURLOPT_CLOSESOCKETFUNCTION, &MjpegSource::on_close);
  curl_easy_setopt(easy_.get(), CURLOPT_CLOSESOCKETDATA, this);
  return true;
}

int MjpegSource::on_socket(void* self, curl_socket_t socket, curlsocktype /*purpose*/) {
  auto* source = static_cast<MjpegSource*>(self);
  source->socket_ = socket;
  source->low_water_ = 1;
  return CURL_SOCKOPT_OK;
}

// libcurl may have opened two sockets for a name with two addresses. A closed number is soon that
// of another file.
int MjpegSource::on_close(void* self, curl_socket_t socket) {
  auto* source = static_cast<MjpegSource*>(self);
  if (socket == source->socket_) {
    source->socket_ = CURL_SOCKET_BAD;
    source->low_water_ = 1;
  }
  return ::close(socket);
}

std::size_t MjpegSource::on_header(char* /*data*/, std::size_t size, std::size_t count,
                                   void* self) {
  auto* source = static_cast<MjpegSource*>(self);
  source->header_bytes_ += size * count;
  if (source->header_bytes_ <= kMostHeaderBytes) return size * count;
  source->refusal_ = kHeadersTooLong;
  return 0;  // ends the transfer with CURLE_WRITE_ERROR
}

std::size_t MjpegSource::on_body(char* data, std::size_t size, std::size_t count, void* self) {
  auto* source = static_cast<MjpegSource*>(self);
  const double arrival_s = monotonic_now_s();
  const std::size_t bytes = size * count;
  long status = 0;
  curl_easy_getinfo(source->easy_.get(), CURLINFO_RESPONSE_CODE, &status);
  if (status != 200) {
    return bytes;  // an error page; the status says more
  }
  if (!source->scanner_ && !source->begin_stream()) {
    return 0;  // ends the transfer with CURLE_WRITE_ERROR
  }
  source->take_bytes({data, bytes}, arrival_s);
  if (source->useless_in_a_row_ <= kUselessInARow) return bytes;
  source->refusal_ = "more than " + std::to_string(kUselessInARow) +
                     " parts in a row are no pictures: no camera's stream";
  return 0;
}

bool MjpegSource::begin_stream() {
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

void MjpegSource::take_bytes(std::string_view bytes, double arrival_s) {
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
      const std::size_t size = part.body.size();
      thread_.push(std::move(part), size);
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
ReadStatus MjpegSource::receive_connection(std::string* error) {
  last_picture_s_ = monotonic_now_s();
  Redirection next{name_, true, ""};
  for (int i = 0; i <= kMostRedirections; ++i) {
    if (!make_handle(next.url, next.takes_login)) {
      *error = kNoCurl;
      return ReadStatus::kDisconnected;
    }
    CURLcode code = CURLE_OK;
    const ReadStatus status = receive_answer(&code, error);
    if (status != ReadStatus::kOk) return status;
    next = redirection_of(easy_.get(), configured_, asked_, options_.rules.redirects);
    if (next.url.empty()) {
      *error = next.error;
      return next.error.empty() ? connection_end(code, error) : ReadStatus::kDisconnected;
    }
  }
  *error = "more than " + std::to_string(kMostRedirections) + " redirections, the last to " +
           shown(asked_, kShownUrl);
  return ReadStatus::kDisconnected;
}

// kOk: the answer has ended with *code.
ReadStatus MjpegSource::receive_answer(CURLcode* code, std::string* error) {
  scanner_.reset();
  refusal_.clear();
  header_bytes_ = 0;
  useless_in_a_row_ = 0;
  wakes_ = 0;
  curl_error_[0] = '\0';
  pictures_ = 0;
  curl_multi_add_handle(multi_.get(), easy_.get());
  ReadStatus status = ReadStatus::kStopped;
  while (!thread_.ending()) {
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
void MjpegSource::wait_for_bytes(double left_s) {
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
void MjpegSource::set_low_water(std::size_t bytes) {
  const auto wanted = static_cast<int>(std::min<std::size_t>(bytes, INT_MAX));
  if (is_by_tls() || socket_ == CURL_SOCKET_BAD || wanted == low_water_) {
    return;
  }
  if (::setsockopt(socket_, SOL_SOCKET, SO_RCVLOWAT, &wanted, sizeof wanted) == 0) {
    low_water_ = wanted;
  }
}

ReadStatus MjpegSource::connection_end(CURLcode code, std::string* error) {
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

ReadStatus MjpegSource::read(Frame& frame, double timeout_s) {
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration_cast<std::chrono::nanoseconds>(
                                             std::chrono::duration<double>(timeout_s));
  if (failed_) {
    return thread_.stopped() ? ReadStatus::kStopped : ReadStatus::kFailed;
  }
  for (;;) {
    MultipartPart part;
    std::string error;
    ReadStatus status = thread_.next(deadline, &part, &error);
    if (status == ReadStatus::kFailed) {
      return fail(error);
    }
    if (status == ReadStatus::kDisconnected) {
      error_ = name_ + ": " + error;
      restarted_ = true;
    }
    if (status != ReadStatus::kOk) {
      return status;
    }
    status = deliver(std::move(part), frame);
    if (status != ReadStatus::kTimeout) {
      return status;
    }
  }
}

// Makes a frame from a part; kTimeout if this part gives none.
ReadStatus MjpegSource::deliver(MultipartPart part, Frame& frame) {
  Picture picture;
  const double before_s = monotonic_now_s();
  bool usable = decoder_.read_size(part.body, &picture.width, &picture.height);
  const bool fits = std::int64_t{picture.width} * picture.height <= options_.max_pixels;
  if (usable && !fits && !options_.copy_to.empty()) {
    ++damaged_;
    return ReadStatus::kTimeout;
  }
  if (usable && fits && options_.decode) usable = decoder_.decode(part.body, &picture);
  if (!usable) {
    ++damaged_;
    if (++damaged_in_a_row_ < kDamagedInARow) {
      return ReadStatus::kTimeout;
    }
    damaged_in_a_row_ = 0;
    thread_.refuse(std::to_string(kDamagedInARow) +
                   " pictures in a row cannot be used; the last one: " + decoder_.error());
    return ReadStatus::kTimeout;
  }
  damaged_in_a_row_ = 0;
  const double decode_s = monotonic_now_s() - before_s;
  if (!options_.copy_to.empty()) {
    const PacketPtr packet = make_picture_packet(part.body.size());
    std::string error;
    if (!packet) {
      return fail("no memory for a picture");
    }
    std::memcpy(packet->data, part.body.data(), part.body.size());
    if (!copy_.add(options_.copy_to, *parameters_, picture.width, picture.height, *packet,
                   part.first_byte_s, &error)) {
      if (!copy_.is_another_stream()) return fail(error);
      thread_.refuse(error);
      return ReadStatus::kTimeout;
    }
  }
  frame = Frame{};
  frame.stamp.frame = next_frame_++;
  frame.stamp.receive_time_s = part.first_byte_s;
  frame.stamp.restarted = std::exchange(restarted_, false);
  stamp_sender_time(part, &frame.stamp);
  frame.width = picture.width;
  frame.height = picture.height;
  frame.luma = picture.luma;
  frame.stride = picture.stride;
  frame.owner = std::move(picture.owner);
  if (options_.decode && fits) {
    frame.decode_s = decode_s;
  }
  return ReadStatus::kOk;
}

void MjpegSource::stamp_sender_time(const MultipartPart& part, FrameStamp* stamp) {
  if (stamp->restarted) {
    clock_doubt_ = 0;
    last_sender_time_s_.reset();
    stamps_.restart();
  }
  if (clock_doubt_ > kMostDoubt) {
    return;
  }
  const bool stands = !part.timestamp_s || part.timestamp_s == last_sender_time_s_;
  if (part.timestamp_s) last_sender_time_s_ = part.timestamp_s;
  auto verdict = StampGuard::Verdict::kBad;
  if (!stands) {
    const double expected_s = stamps_.expected_s(stamp->receive_time_s);
    verdict = stamps_.judge(stamp->receive_time_s, *part.timestamp_s);
    if (verdict == StampGuard::Verdict::kBad) {
      ++unstamped_;
      remarks_.say(0, name_ + ": " + bad_stamp_remark(*part.timestamp_s - expected_s));
    }
  }
  if (verdict == StampGuard::Verdict::kBad) {
    clock_doubt_ += kDoubtOfABadStamp;
    return;
  }
  const bool jumped = verdict == StampGuard::Verdict::kJumped;
  clock_doubt_ = jumped ? 0 : std::max(0, clock_doubt_ - 1);
  stamp->sender_time_s = part.timestamp_s;
  stamp->restarted = stamp->restarted || jumped;
}

}  // namespace

std::unique_ptr<FrameSource> open_mjpeg(const MjpegSourceOptions& options) {
  return std::make_unique<MjpegSource>(options);
}

}  // namespace alidade
