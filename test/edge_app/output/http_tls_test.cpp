// The server over TLS, and who may do what: over real sockets, with certificates made for the test.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <openssl/pem.h>
#include <openssl/ssl.h>
#include <signal.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "edge_app/output/http/http_server.h"
#include "edge_app/output/http/http_tokens.h"
#include "test/edge_app/output/http_client.h"
#include "test/platform/support/test_certificate.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

using test::Client;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

// Trusts nobody and asks nothing of the certificate but to be shown it.
class TlsClient {
 public:
  explicit TlsClient(const HttpServer& server, const std::string& from = "127.0.0.1")
      : client_(server, from), context_(SSL_CTX_new(TLS_client_method())), tls_(SSL_new(context_)) {
    SSL_set_fd(tls_, client_.descriptor());
    ready_ = SSL_connect(tls_) == 1;
  }
  ~TlsClient() {
    SSL_free(tls_);
    SSL_CTX_free(context_);
  }
  TlsClient(const TlsClient&) = delete;
  TlsClient& operator=(const TlsClient&) = delete;

  [[nodiscard]] bool ready() const { return ready_; }
  [[nodiscard]] std::string version() const { return SSL_get_version(tls_); }
  [[nodiscard]] std::string certificate() const {
    X509* const shown = SSL_get1_peer_certificate(tls_);
    if (shown == nullptr) return "";
    BIO* const memory = BIO_new(BIO_s_mem());
    PEM_write_bio_X509(memory, shown);
    char* text = nullptr;
    const long size = BIO_get_mem_data(memory, &text);
    std::string pem(text, static_cast<std::size_t>(size));
    BIO_free(memory);
    X509_free(shown);
    return pem;
  }
  void send(const std::string& text) {
    static_cast<void>(SSL_write(tls_, text.data(), static_cast<int>(text.size())));
  }
  std::string receive(const std::string& enough = "") {
    std::string text;
    std::array<char, 4096> piece{};
    while (enough.empty() || text.find(enough) == std::string::npos) {
      const int count = SSL_read(tls_, piece.data(), static_cast<int>(piece.size()));
      if (count <= 0) {
        ended_well_ = SSL_get_error(tls_, count) == SSL_ERROR_ZERO_RETURN;
        break;
      }
      text.append(piece.data(), static_cast<std::size_t>(count));
    }
    return text;
  }
  // The server said that nothing follows.
  [[nodiscard]] bool ended_well() const { return ended_well_; }

 private:
  Client client_;
  SSL_CTX* context_;
  SSL* tls_;
  bool ready_ = false;
  bool ended_well_ = false;
};

class Greeting final : public HttpStream {
 public:
  void next(std::string* piece) override {
    if (!begun_) *piece += "begun\n";
    begun_ = true;
  }

 private:
  bool begun_ = false;
};

ServerResponse words(const std::string& body) {
  ServerResponse response;
  response.body = body;
  return response;
}

class HttpTlsTest : public ::testing::Test {
 protected:
  HttpTlsTest() {
    ::signal(SIGPIPE, SIG_IGN);  // the client's library writes to a server that has had enough
    options_.tls = HttpTlsOptions{file("server.pem"), file("server.key")};
  }

  [[nodiscard]] std::string file(const char* name) const { return directory_.path() + "/" + name; }
  void write_certificate(int days = 30) {
    made_ = make_certificate("127.0.0.1", days);
    directory_.write("server.pem", made_.certificate);
    directory_.write("server.key", made_.key);
  }
  std::string start_error() {
    server_ = std::make_unique<HttpServer>(options_);
    server_->get("/closed", HttpAccess::kToken,
                 [](const ServerRequest&) { return words("closed"); });
    server_->post("/echo", HttpAccess::kToken, 70000,
                  [](const ServerRequest& request) { return words(request.body); });
    server_->post("/change", HttpAccess::kControl, 100,
                  [](const ServerRequest&) { return words("changed"); });
    server_->get("/stream", HttpAccess::kStream, [](const ServerRequest&) {
      ServerResponse response;
      response.stream = std::make_unique<Greeting>();
      return response;
    });
    std::string error;
    return server_->check_tls(&error) && server_->start(&error) ? "" : error;
  }
  static std::string get(const std::string& path, const std::string& headers = "") {
    return "GET " + path + " HTTP/1.1\r\nHost: camera.example:8080\r\n" + headers + "\r\n";
  }
  static std::string post(const std::string& path, const std::string& headers = "") {
    return "POST " + path + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n" + headers +
           "\r\n";
  }
  std::string ask(const std::string& request, const std::string& from = "127.0.0.1") {
    TlsClient client(*server_, from);
    client.send(request);
    std::string answer = client.receive();
    EXPECT_TRUE(client.ended_well());
    return answer;
  }

  TemporaryDirectory directory_;
  TestCertificate made_;
  HttpServerOptions options_;
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpTlsTest, AnswersAsWithoutIt) {
  write_certificate();
  ASSERT_EQ(start_error(), "");
  // A page of another name has no certificate for it here, so that any Host may be asked for.
  EXPECT_THAT(ask(get("/closed")), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\nclosed")));
  EXPECT_THAT(ask(get("/closed", "Origin: https://camera.example:8080\r\n")),
              StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask(get("/closed", "Origin: http://camera.example:8080\r\n")),
              StartsWith("HTTP/1.1 403 "));
  const std::string body(60000, 'b');
  TlsClient sending(*server_);
  EXPECT_EQ(sending.version(), "TLSv1.3");
  sending.send("POST /echo HTTP/1.1\r\nHost: localhost\r\nContent-Length: 60000\r\n\r\n" +
               body.substr(0, 20000));
  sending.send(body.substr(20000));
  EXPECT_THAT(sending.receive(), AllOf(StartsWith("HTTP/1.1 200 "), EndsWith("\r\n\r\n" + body)));
  TlsClient following(*server_);
  following.send(get("/stream"));
  EXPECT_THAT(following.receive("begun\n"), EndsWith("begun\n"));
  TlsClient browsing(*server_);
  browsing.send(get("/stream", "Accept-Language: en\r\n"));
  EXPECT_THAT(browsing.receive(), AllOf(StartsWith("HTTP/1.1 403 "), HasSubstr("ticket")));
}

// Of as many as there are places, and more, from one address or from many.
TEST_F(HttpTlsTest, HandshakesThatDoNotEndHoldNobodyUp) {
  write_certificate();
  options_.limits.head_timeout_s = 1e4;
  options_.limits.max_strangers = 8;
  ASSERT_EQ(start_error(), "");
  std::vector<std::unique_ptr<Client>> slow;
  for (int i = 0; i < 40; ++i) {
    slow.push_back(std::make_unique<Client>(*server_, "127.0.0." + std::to_string(2 + i % 20)));
    slow.back()->send(std::string("\x16\x03\x01\x02\x00\x01", 6));
    EXPECT_THAT(ask(get("/closed")), StartsWith("HTTP/1.1 200 "));
  }
  EXPECT_LE(server_->counters().connections, 8);
  EXPECT_EQ(slow.front()->receive(), "") << "nothing that is not TLS is said to it";
}

TEST_F(HttpTlsTest, AHandshakeMustEndInTheHeadsTime) {
  write_certificate();
  options_.limits.head_timeout_s = 0.5;
  ASSERT_EQ(start_error(), "");
  Client silent(*server_);
  Client slow(*server_);
  slow.send(std::string("\x16\x03\x01\x02\x00\x01", 6));
  TlsClient no_head(*server_);
  TlsClient half_a_head(*server_);
  half_a_head.send("GET /closed HTTP/1.1\r\n");
  EXPECT_EQ(silent.receive(), "");
  EXPECT_EQ(slow.receive(), "");
  EXPECT_EQ(no_head.receive(), "");
  EXPECT_THAT(half_a_head.receive(), StartsWith("HTTP/1.1 408 "));
}

TEST_F(HttpTlsTest, AFloodOfHandshakesTakesNoneOfAnotherAddressOrOfWhoHasShownTheToken) {
  write_certificate();
  options_.token = "right-horse";
  options_.limits.requests_per_s = 1e-6;  // one each, and none for days
  ASSERT_EQ(start_error(), "");
  EXPECT_TRUE(TlsClient(*server_, "127.0.0.2").ready());
  for (int i = 0; i < 5; ++i) EXPECT_FALSE(TlsClient(*server_, "127.0.0.2").ready());
  EXPECT_EQ(server_->counters().refused, 5);
  const std::string with_token = get("/closed", "Authorization: Bearer right-horse\r\n");
  EXPECT_THAT(ask(with_token, "127.0.0.3"), StartsWith("HTTP/1.1 200 "));
  EXPECT_TRUE(TlsClient(*server_, "127.0.0.3").ready()) << "of those with the token it has its own";
}

TEST_F(HttpTlsTest, WhoAsksWithoutItIsToldSo) {
  write_certificate();
  ASSERT_EQ(start_error(), "");
  Client plain(*server_);
  plain.send(get("/closed"));
  EXPECT_THAT(plain.receive(), AllOf(StartsWith("HTTP/1.1 400 "), EndsWith("https://\"}\n")));
  Client garbage(*server_);
  garbage.send("\n\n\n\n\n\n\n\n");
  EXPECT_THAT(garbage.receive(), Not(HasSubstr("200")));
  EXPECT_THAT(ask(get("/closed")), StartsWith("HTTP/1.1 200 "));
}

TEST_F(HttpTlsTest, ACertificateThatIsReplacedIsShownWithoutARestart) {
  write_certificate();
  ASSERT_EQ(start_error(), "");
  EXPECT_EQ(TlsClient(*server_).certificate(), made_.certificate);
  const std::string before = made_.certificate;
  made_ = make_certificate("127.0.0.1", 60);
  directory_.write("server.pem", made_.certificate);
  EXPECT_EQ(TlsClient(*server_).certificate(), before) << "the key is not there yet";
  directory_.write("server.key", made_.key);
  std::string shown = before;
  while (shown == before || shown.empty()) shown = TlsClient(*server_).certificate();
  EXPECT_EQ(shown, made_.certificate);
}

TEST_F(HttpTlsTest, WhatCannotBeUsedIsSaidInOneLine) {
  const auto error = [this] {
    const std::string line = start_error();
    EXPECT_EQ(line.find('\n'), std::string::npos);
    return line;
  };
  EXPECT_THAT(error(), HasSubstr("server.pem: cannot be read: No such file"));
  write_certificate();
  const TestCertificate other = make_certificate("127.0.0.1", 30);
  directory_.write("server.key", other.key);
  EXPECT_THAT(error(), AllOf(HasSubstr("server.key: the key does not belong to the certificate in"),
                             HasSubstr("server.pem")));
  directory_.write("server.key", made_.certificate);
  EXPECT_THAT(error(), HasSubstr("server.key: holds no private key"));
  directory_.write("server.pem", made_.key);
  EXPECT_THAT(error(), HasSubstr("server.pem: holds no certificate"));
  write_certificate();
  BIO* const key = BIO_new_mem_buf(made_.key.data(), -1);
  EVP_PKEY* const read = PEM_read_bio_PrivateKey(key, nullptr, nullptr, nullptr);
  BIO* const locked = BIO_new_file(file("server.key").c_str(), "w");
  char password[] = "secret";
  EXPECT_EQ(
      PEM_write_bio_PrivateKey(locked, read, EVP_aes_128_cbc(), nullptr, 0, nullptr, password), 1);
  BIO_free(locked);
  EVP_PKEY_free(read);
  BIO_free(key);
  EXPECT_THAT(error(), HasSubstr("server.key: the key is encrypted"));
  // What clients will refuse is for them to say.
  write_certificate(-1);
  EXPECT_EQ(error(), "");
  EXPECT_TRUE(TlsClient(*server_).ready());
}

TEST_F(HttpTlsTest, AViewersTokenChangesNothing) {
  write_certificate();
  options_.tokens = {{"viewers-horse", HttpRight::kView}, {"right-horse", HttpRight::kControl}};
  ASSERT_EQ(start_error(), "");
  const std::string viewing = "Authorization: Bearer viewers-horse\r\n";
  const std::string controlling = "Authorization: Bearer right-horse\r\n";
  EXPECT_THAT(ask(get("/closed", viewing)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask(post("/echo", viewing)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask(post("/change", viewing)),
              AllOf(StartsWith("HTTP/1.1 403 "), HasSubstr("may only view"),
                    HasSubstr("\r\nWWW-Authenticate: Bearer error=\"insufficient_scope\", "
                              "scope=\"control\"\r\n")));
  EXPECT_THAT(ask(post("/change", controlling)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask(get("/closed", controlling)), StartsWith("HTTP/1.1 200 "));
  EXPECT_THAT(ask(post("/change")), AllOf(StartsWith("HTTP/1.1 401 "), HasSubstr("this needs")));
  EXPECT_THAT(ask(post("/change", "Authorization: Bearer wrong-horse\r\n")),
              AllOf(StartsWith("HTTP/1.1 401 "), HasSubstr("invalid_token")));
}

class HttpTokensTest : public ::testing::Test {
 protected:
  HttpServerOptions of_file(bool several) {
    HttpServerOptions options;
    options.token_file = directory_.path() + "/tokens";
    options.token_file_holds_several = several;
    options.token_file_stamp = FileStamp(options.token_file);
    return options;
  }
  TemporaryDirectory directory_;
};

TEST_F(HttpTokensTest, AreReadAnewOnceTheirFileHasChanged) {
  directory_.write("tokens", "view old-horse\n");
  HttpServerOptions options = of_file(true);
  options.tokens = {{"old-horse", HttpRight::kView}};
  HttpTokens tokens(options);
  EXPECT_EQ(tokens.right_of("Bearer old-horse", 10), HttpRight::kView);
  EXPECT_EQ(tokens.right_of("Bearer old-horsf", 10), std::nullopt);
  EXPECT_EQ(tokens.right_of("old-horse", 10), std::nullopt);
  directory_.write("tokens", "# of today\nview  new-horse\n\ncontrol other-horse\r\n");
  EXPECT_EQ(tokens.right_of("Bearer old-horse", 12), std::nullopt);
  EXPECT_EQ(tokens.right_of("Bearer new-horse", 12), HttpRight::kView);
  EXPECT_EQ(tokens.right_of("Bearer other-horse", 12), HttpRight::kControl);
  directory_.write("tokens", "control short\n");
  EXPECT_EQ(tokens.right_of("Bearer new-horse", 14), HttpRight::kView)
      << "the earlier tokens stay in use";
  directory_.write("tokens", "view last-horse-of-all\n");
  EXPECT_EQ(tokens.right_of("Bearer last-horse-of-all", 14.5), std::nullopt) << "once a second";
  EXPECT_EQ(tokens.right_of("Bearer last-horse-of-all", 16), HttpRight::kView);
}

TEST_F(HttpTokensTest, TheOnlyOneOfAFileMayDoEverythingAndIsReadAnewToo) {
  directory_.write("tokens", "only-horse\nnot-a-token\n");
  HttpServerOptions options = of_file(false);
  options.token = "only-horse";
  HttpTokens tokens(options);
  EXPECT_EQ(tokens.right_of("Bearer only-horse", 10), HttpRight::kControl);
  directory_.write("tokens", " next-horse-here \n");
  EXPECT_EQ(tokens.right_of("Bearer next-horse-here", 12), HttpRight::kControl);
  EXPECT_EQ(tokens.right_of("Bearer only-horse", 12), std::nullopt);
}

TEST(ParseTokens, SaysWhichLineIsWrongAndNoToken) {
  const auto error = [](const std::string& text) {
    std::vector<HttpToken> tokens;
    std::string line;
    EXPECT_FALSE(parse_tokens(text, &tokens, &line)) << text;
    EXPECT_THAT(line, Not(HasSubstr("horse")));
    return line;
  };
  EXPECT_THAT(error(""), HasSubstr("no token in it"));
  EXPECT_THAT(error("# view only-horse\n"), HasSubstr("no token in it"));
  EXPECT_THAT(error("view my-horse1\nonly-horse\n"), StartsWith("line 2 names no right"));
  EXPECT_THAT(error("admin only-horse\n"), StartsWith("line 1 names no right"));
  EXPECT_THAT(error("view\n"), StartsWith("line 1 has no token"));
  EXPECT_THAT(error("view a-horse\n"), StartsWith("line 1 has no token of at least 8"));
  EXPECT_THAT(error("view only-hors\xc3\xa9\n"), StartsWith("line 1 has no token of at least 8"));
  EXPECT_THAT(error("view only-horse and more\n"), StartsWith("line 1 has more than"));
  EXPECT_THAT(error("view only-horse\ncontrol only-horse\n"),
              StartsWith("line 2 repeats an earlier token"));
}

}  // namespace
}  // namespace alidade
