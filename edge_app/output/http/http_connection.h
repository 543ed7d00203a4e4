#pragma once
// HttpConnection: one client, from its first byte to the last byte that the client takes. The
// connection goes through these stages, with one operation and one deadline at a time:
//
//   head --> gate --> body --> handler --> answer --> linger --> closed
//
// A refusal is an answer, too. An endless answer is asked for more whenever the client has taken
// everything. All stages run on the network thread, except the handler: the handler runs on a
// handlers' thread while the connection does nothing else. An exception in a stage, as when memory
// has run out, ends this connection and is passed on.

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

// The places of connections. Each connection holds one until it ends.
struct HttpPlaces {
  explicit HttpPlaces(const HttpLimits& limits)
      : strangers(limits.max_strangers),
        with_token(limits.max_with_token),
        streams(limits.max_streams) {}

  FairPlaces<HttpConnection> strangers;
  FairPlaces<HttpConnection> with_token;
  FairPlaces<HttpConnection> streams;  // connections with an endless answer
};

// Shared by the connections of a server.
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

  // To be called once. From then on the connection keeps itself alive, until it ends.
  void begin();
  // An endless answer may have more to send.
  void wake();
  // Another client takes this place. Sends 503 if nothing was sent yet, and ends.
  void give_way();

  [[nodiscard]] const HttpClient& client() const { return client_; }
  // Calls the handler; on a handlers' thread.
  void work() noexcept;
  // To be called after work(), on the network thread.
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

  // Sends the text, then goes on with step `then`.
  void send(std::string text, Step then);
  void send_rest();
  void take_sent(std::size_t count);

  // If all places are taken, the oldest connection of the address that holds most gives way.
  void take_place(FairPlaces<HttpConnection>* places);
  void leave_place();

  template <typename Stage>
  void guarded(Stage stage);

  // Sets the only deadline: calls step `late` after time_s, unless another deadline is set before.
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

  std::string received_;  // the head and bytes that came with it
  bool late_ = false;     // the deadline has ended a read
  int cancelled_ = 0;     // how often the read was cancelled
  HttpHead head_;
  const HttpRoute* route_ = nullptr;
  ServerRequest request_;
  // The body was incomplete when the head was complete. Then the request counts when the body is
  // complete.
  bool body_to_come_ = false;
  std::size_t body_came_ = 0;  // bytes
  double complete_s_ = 0;      // when the request was complete
  std::optional<ServerResponse> response_;
  bool failed_ = false;  // no response can be made

  std::string sending_;
  std::size_t sent_ = 0;
  Step after_sending_ = nullptr;
  double answer_deadline_s_ = 0;
  std::unique_ptr<HttpStream> stream_;
  bool silent_ = false;  // the endless answer has nothing to send
  std::size_t discarded_ = 0;
};

}  // namespace alidade
