// The page and its images as a client of the server meets them.

#include "edge_app/output/status_page.h"

#include <gtest/gtest.h>
#include <httplib.h>

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "edge_app/record/record_status.h"

namespace alidade {
namespace {

TappedFrame tapped_frame(const std::vector<std::uint8_t>& luma, FrameLandmarks::Kind kind) {
  TappedFrame tapped;
  tapped.frame = 41;
  tapped.image = {luma.data(), 1280, 720, 1280};
  tapped.slot = 3;
  tapped.landmarks.kind = kind;
  tapped.landmarks.count = 2;
  tapped.landmarks.found[0] = {100.12345F, 200, 0.0625F, -0.25F, true};
  tapped.landmarks.found[1] = {1000, 700.5F, 3, 4, false};
  return tapped;
}

class StatusPageTest : public ::testing::Test {
 protected:
  StatusPageTest() {
    HttpServerOptions options;
    options.token = "right horse";
    server_ = std::make_unique<HttpServer>(options);
    add_status_page(server_.get(), &tap_);
    std::string error;
    EXPECT_TRUE(server_->start(&error)) << error;
    client_ = std::make_unique<httplib::Client>("http://" + server_->address());
    client_->set_read_timeout(60);
    client_->set_bearer_token_auth("right horse");
  }
  ~StatusPageTest() override {
    tap_.end();
    tap_thread_.join();
    server_->stop();
  }

  // What the real-time thread does, once somebody asks.
  std::thread show(FrameLandmarks::Kind kind) {
    return std::thread([this, kind] {
      while (!tap_.take_wish()) std::this_thread::yield();
      EXPECT_TRUE(tap_.push(tapped_frame(luma_, kind)));
    });
  }

  std::vector<std::uint8_t> luma_ = std::vector<std::uint8_t>(1280 * 720, 100);
  ImageTap tap_{std::chrono::hours(1)};
  std::thread tap_thread_{&ImageTap::run, &tap_};
  std::unique_ptr<HttpServer> server_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(StatusPageTest, ThePageIsOpenAndMayLoadNothingFromElsewhere) {
  httplib::Client anybody("http://" + server_->address());
  const auto answer = anybody.Get("/");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
  EXPECT_EQ(answer->body, status_page_text());
  EXPECT_EQ(answer->get_header_value("Content-Type"), "text/html; charset=utf-8");
  const std::string policy = answer->get_header_value("Content-Security-Policy");
  EXPECT_EQ(policy.find("default-src 'none'; "), 0U);
  EXPECT_NE(policy.find("script-src 'sha256-"), std::string::npos);
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  for (const char* unsafe :
       {"innerHTML", "outerHTML", "insertAdjacent", "document.write", "eval("}) {
    EXPECT_EQ(status_page_text().find(unsafe), std::string::npos) << unsafe;
  }
  // The name of SVG's namespace in the icon is the only one.
  std::string page = status_page_text();
  const std::string space = "http://www.w3.org/2000/svg";
  ASSERT_NE(page.find(space), std::string::npos);
  page.erase(page.find(space), space.size());
  EXPECT_EQ(page.find("http:"), std::string::npos);
  EXPECT_EQ(page.find("https:"), std::string::npos);
}

int count_of(const std::string& text, const std::string& page) {
  int count = 0;
  for (std::size_t at = page.find(text); at != std::string::npos; at = page.find(text, at + 1))
    ++count;
  return count;
}

TEST(StatusPage, IsOneStyleAndOneScript) {
  const std::string page = status_page_text();
  for (const char* element : {"<style", "<script"})
    EXPECT_EQ(count_of(element, page), 1) << element;
  for (const char* left : {"\nimport ", "\nexport ", "style.css\"", "main.js\""})
    EXPECT_EQ(page.find(left), std::string::npos) << left;
}

TEST(StatusPage, SaysInWordsWhatEachStatusMeans) {
  const std::string page = status_page_text();
  for (const RecordStatus status : kRecordStatuses)
    EXPECT_NE(page.find(std::string("\n  '") + to_string(status) + "': '"), std::string::npos)
        << to_string(status);
}

TEST_F(StatusPageTest, AImageAndItsOverlayBelongToOneFrame) {
  std::thread realtime = show(FrameLandmarks::Kind::kLandmarks);
  const auto image = client_->Get("/api/v1/picture");
  realtime.join();
  ASSERT_TRUE(image);
  EXPECT_EQ(image->status, 200);
  EXPECT_EQ(image->get_header_value("Content-Type"), "image/jpeg");
  EXPECT_EQ(image->get_header_value("X-Alidade-Frame"), "41");
  EXPECT_EQ(image->body, tap_.of_frame(41)->jpeg);
  for (const char* path : {"/api/v1/overlay?frame=41", "/api/v1/overlay"}) {
    const auto overlay = client_->Get(path);
    ASSERT_TRUE(overlay);
    EXPECT_EQ(overlay->status, 200);
    EXPECT_EQ(overlay->body,
              R"({"frame":41,"width":1280,"height":720,"scale":3,"landmarks":[)"
              R"({"u":100.123,"v":200.0,"du":0.063,"dv":-0.25,"used":true},)"
              R"({"u":1000.0,"v":700.5,"du":3.0,"dv":4.0,"used":false}],"points":[]})"
              "\n");
  }
}

TEST_F(StatusPageTest, PointsHaveNoResiduals) {
  std::thread realtime = show(FrameLandmarks::Kind::kPoints);
  const auto overlay = client_->Get("/api/v1/overlay");
  realtime.join();
  ASSERT_TRUE(overlay);
  const auto object = nlohmann::json::parse(overlay->body);
  EXPECT_TRUE(object["landmarks"].empty());
  EXPECT_EQ(object["points"].dump(), "[[100.123,200.0],[1000.0,700.5]]");
}

TEST_F(StatusPageTest, SaysWhyThereIsNoImage) {
  for (const char* path : {"/api/v1/picture", "/api/v1/overlay"}) {
    const auto answer = client_->Get(path);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 503);
    EXPECT_NE(nlohmann::json::parse(answer->body)["error"].get<std::string>().find("no picture"),
              std::string::npos);
  }
}

TEST_F(StatusPageTest, RefusesFramesThatAreNoneOrNotKept) {
  const auto status = [this](const std::string& frame) {
    const auto answer = client_->Get("/api/v1/overlay?frame=" + frame);
    return answer ? answer->status : 0;
  };
  EXPECT_EQ(status("41"), 404);
  EXPECT_EQ(status("9223372036854775807"), 404);
  for (const char* frame : {"", "-1", "1.5", "x", "9223372036854775808", "41%20"})
    EXPECT_EQ(status(frame), 400) << frame;
}

TEST_F(StatusPageTest, TheImageWantsTheToken) {
  httplib::Client anybody("http://" + server_->address());
  for (const char* path : {"/api/v1/picture", "/api/v1/overlay"}) {
    const auto answer = anybody.Get(path);
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 401);
  }
  EXPECT_FALSE(tap_.take_wish()) << "nobody was allowed to ask";
}

}  // namespace
}  // namespace alidade
