#pragma once
// HttpTls: certificate and key of a server. They are read again when their files change, so that
// they can be renewed without a restart. If the new files cannot be used, the old certificate and
// key stay, and the failure is logged once. A failure counts only if the same files fail twice, at
// least a second apart, as one file is replaced before the other.
//
// TLS 1.2 and later; no renegotiation, no compression, no session cache. For the network thread,
// except load().

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

  // False with one line in *error. Warnings: a certificate that is not valid now, a key that other
  // users can read.
  [[nodiscard]] bool load(std::string* error, std::vector<std::string>* warnings);

  // The context for the next connection. Only after load() returned true. now_s: s, monotonic.
  [[nodiscard]] std::shared_ptr<Context> context(double now_s);

 private:
  struct Stamps {
    FileStamp certificate;
    FileStamp key;
  };
  [[nodiscard]] bool have_changed_since(const Stamps& then) const;

  const HttpTlsOptions options_;
  std::shared_ptr<Context> context_;
  Stamps loaded_;  // of the files from which context_ was made
  Stamps seen_;    // of the files that were tried last
  bool said_ = false;
  double looked_s_ = 0;
};

}  // namespace alidade
