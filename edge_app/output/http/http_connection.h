#pragma once
// HttpConnection: one client, from its first byte to the last that it takes. Stage after stage, one operation under way
// and one deadline at a time:
//
//   head --> gate --> body --> handler --> answer --> linger --> closed
//
// A refusal is an answer, too. An endless answer is asked for more whenever all was taken, until the client is gone.
// Network thread but for the handler, which runs on a handlers' thread while the connection does nothing else. What is
// thrown in a stage, where memory has run out, ends this connection and is passed on.

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include "edge_app/output/http/http_fairness.h"
#include "edge_app/output/http/http_gate.h"
#include "edge_app/output/http/http_handlers.h"
#include "edge_app/output/http/http_head.h"
#include "edge_app/output/http/http_message.h"
#include "edge_app/output/http/http_options.h"
#include "edge_app/output/http/http_transport.h"

namespace alidade {

class HttpConnection;

// The places that connections hold: each one, until it ends.
struct HttpPlaces {
  explicit HttpPlaces(const HttpLimits& limits)
      : strangers(limits.max_strangers),
        with_token(limits.max_with_token),
        streams(limits.max_streams) {}

  FairPlaces<HttpConnection> strangers;
  FairPlaces<HttpConnection> with_token;
  FairPlaces<HttpConnection> streams;  // those whose answer is endless
};

// What the connections of a server share.
struct HttpService {
  const HttpLimits& limits;
  HttpGate& gate;
  HttpTally& tally;
  HttpHandlers& handlers;
  HttpPlaces& places;
};

class HttpConnection final : public std::enable_shared_from_this<HttpConnection> {
 public:
  // tls: null for plain HTTP.
  HttpConnection(boost::asio::ip::tcp::socket socket, std::shared_ptr<HttpTls::Context> tls,
                 const HttpAddress& address, const HttpService& service);
  ~HttpConnection();
  HttpConnection(const HttpConnection&) = delete;
  HttpConnection& operator=(const HttpConnection&) = delete;

  // Once; it keeps itself alive from then on.
  void begin();
  // An endless answer may have more to say.
  void wake();
  // Somebody else takes its place: says so, if nothing was said yet, and ends.
  void give_way();

  [[nodiscard]] const HttpClient& client() const { return client_; }
  // Asks the handler; on any thread.
  void work() noexcept;
  // Behind it.
  void take_answer();

 private:
  using Error = boost::system::error_code;
  using Step = void (HttpConnection::*)();

  void take_handshake(const Error& error);
  void read_head();
  void take_head(const Error& error, std::size_t size);
  void read_body();
  void take_body(const Error& error);
  void ask_handler();
  void answer(ServerResponse response);
  [[nodiscard]] bool take_stream_place();
  void say_more();
  void linger();
  void linger_plainly();
  void discard();

  // Sends, then goes on with the step.
  void send(std::string text, Step then);
  void send_rest();
  void take_sent(std::size_t count);

  // Of the oldest of whoever has most, where all are taken.
  void take_place(FairPlaces<HttpConnection>* places);
  void leave_place();

  template <typename Stage>
  void guarded(Stage stage);

  // Calls the step unless the next deadline is set before; one at a time.
  void within(double time_s, Step late);
  void without_deadline();
  void stop_reading();
  void drop_stalled();
  void drop();

  HttpTransport transport_;
  boost::asio::steady_timer timer_;
  const HttpService service_;
  HttpClient client_;
  FairPlaces<HttpConnection>* place_ = nullptr;
  bool spoke_ = false;  // something was sent
  bool ended_ = false;

  std::string received_;  // the head, and what came with it
  bool late_ = false;     // a read was ended by its deadline
  int cancelled_ = 0;     // how often that was tried
  HttpHead head_;
  const HttpRoute* route_ = nullptr;
  ServerRequest request_;
  bool body_to_come_ = false;  // when the head was there: then the request costs once it has
  std::size_t body_came_ = 0;
  double complete_s_ = 0;  // when the request was
  std::optional<ServerResponse> response_;
  bool failed_ = false;  // there can be no response

  std::string sending_;
  std::size_t sent_ = 0;
  Step after_sending_ = nullptr;
  double answer_deadline_s_ = 0;
  std::unique_ptr<HttpStream> stream_;
  bool silent_ = false;  // an endless answer that has nothing to say
  std::size_t discarded_ = 0;
};

}  // namespace alidade
