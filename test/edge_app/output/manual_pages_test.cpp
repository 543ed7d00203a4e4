// The manual as a client of the server meets it: pages, and what must not be reached.

#include "edge_app/output/manual_pages.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include <filesystem>
#include <memory>
#include <string>

#include "test/edge_app/output/http_client.h"
#include "test/support/temporary_directory.h"

namespace alidade {
namespace {

namespace fs = std::filesystem;

class ManualPages : public ::testing::Test {
 protected:
  ManualPages() {
    directory_.write("manual/index.html", "first page");
    directory_.write("manual/how-to/index.html", "how to");
    directory_.write("manual/_static/search.js", "search()");
    directory_.write("manual/.buildinfo.html", "hidden");
    directory_.write("manual/program.sh", "of no known kind");
    directory_.write("secret.html", "kept apart");
    fs::create_symlink("../secret.html", folder_ + "/link.html");
    fs::create_symlink("index.html", folder_ + "/same.html");
    HttpServerOptions options;
    options.token = "right horse";
    server_ = std::make_unique<HttpServer>(options);
    add_manual_pages(server_.get(), folder_);
    std::string error;
    EXPECT_TRUE(server_->start(&error)) << error;
  }
  ~ManualPages() override { server_->stop(); }

  // The answer to a path that no library has tidied up.
  std::string answer(const std::string& path) {
    test::Client client(*server_);
    client.send("GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    return client.receive();
  }

  TemporaryDirectory directory_;
  const std::string folder_ = directory_.path() + "/manual";
  std::unique_ptr<HttpServer> server_;
};

TEST_F(ManualPages, AreOpenAndMayLoadNothingFromElsewhere) {
  httplib::Client anybody("http://" + server_->address());
  const auto page = anybody.Get("/manual/");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 200);
  EXPECT_EQ(page->body, "first page");
  EXPECT_EQ(page->get_header_value("Content-Type"), "text/html; charset=utf-8");
  const std::string policy = page->get_header_value("Content-Security-Policy");
  EXPECT_EQ(policy.find("default-src 'none'; "), 0U);
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  EXPECT_EQ(policy.find("http"), std::string::npos);
  EXPECT_EQ(anybody.Get("/manual/how-to/")->body, "how to");
  EXPECT_EQ(anybody.Get("/manual/same.html")->body, "first page");
  const auto script = anybody.Get("/manual/_static/search.js");
  ASSERT_TRUE(script);
  EXPECT_EQ(script->body, "search()");
  EXPECT_EQ(script->get_header_value("Content-Type"), "text/javascript; charset=utf-8");
}

TEST_F(ManualPages, BeginBehindASlash) {
  httplib::Client anybody("http://" + server_->address());
  const auto page = anybody.Get("/manual");
  ASSERT_TRUE(page);
  EXPECT_EQ(page->status, 308);
  EXPECT_EQ(page->get_header_value("Location"), "/manual/");
}

TEST_F(ManualPages, HaveNoWayOut) {
  for (const char* path :
       {"/manual/../secret.html", "/manual/%2e%2e/secret.html", "/manual/how-to/../../secret.html",
        "/manual/..%2fsecret.html", "/manual/.buildinfo.html", "/manual/link.html",
        "/manual//index.html", "/manual/how-to/./index.html", "/manual/index.html%00.js",
        "/manual/..%5csecret.html", "/manual/program.sh", "/manual/how-to", "/manual/none.html"}) {
    const std::string got = answer(path);
    EXPECT_EQ(got.rfind("HTTP/1.1 404", 0), 0U) << path << ": " << got;
    EXPECT_EQ(got.find("kept apart"), std::string::npos) << path;
    EXPECT_NE(got.find("{\"error\":"), std::string::npos) << path;
  }
}

TEST_F(ManualPages, AreOnlyRead) {
  httplib::Client anybody("http://" + server_->address());
  const auto answer = anybody.Post("/manual/index.html", "x", "text/plain");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 405);
  EXPECT_EQ(answer->get_header_value("Allow"), "GET, HEAD");
}

TEST(Manual, ThatIsNotInstalledIsSaidInOneLine) {
  HttpServer server{HttpServerOptions()};
  add_manual_pages(&server, "/nowhere/manual");
  std::string error;
  ASSERT_TRUE(server.start(&error)) << error;
  httplib::Client anybody("http://" + server.address());
  const auto answer = anybody.Get("/manual/");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 404);
  EXPECT_NE(answer->body.find("the manual is not installed"), std::string::npos) << answer->body;
  server.stop();
}

}  // namespace
}  // namespace alidade
