#pragma once
// HttpTls: certificate and key of a server, read anew when their files have changed, so that they are renewed without a restart.
// What cannot be used then leaves those before, and is said once: of two files the first is replaced before the second.
//
// TLS 1.2 and later, no renegotiation, no compression, no sessions kept here. Network thread, but for load().

#include <boost/asio/ssl/context.hpp>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "edge_app/output/http/http_options.h"
#include "platform/system/file_stamp.h"

namespace alidade {

class HttpTls {
 public:
  using Context = boost::asio::ssl::context;

  explicit HttpTls(HttpTlsOptions options) : options_(std::move(options)) {}

  // False: *error is one line. Warnings are lines, too: a certificate that is not valid now, a key that others can read.
  [[nodiscard]] bool load(std::string* error, std::vector<std::string>* warnings);

  // For the next connection; after load().
  [[nodiscard]] std::shared_ptr<Context> context(double now_s);

 private:
  struct Stamps {
    FileStamp certificate;
    FileStamp key;
  };
  [[nodiscard]] bool have_changed_since(const Stamps& then) const;

  const HttpTlsOptions options_;
  std::shared_ptr<Context> context_;
  Stamps loaded_;  // of what context_ was made of
  Stamps seen_;    // when they were looked at last
  bool said_ = false;
  double looked_s_ = 0;
};

}  // namespace alidade
