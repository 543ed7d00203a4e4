#include "test/simulator/servers/digest_auth.h"

#include <openssl/evp.h>
#include <openssl/rand.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <regex>
#include <stdexcept>
#include <utility>

namespace alidade {
namespace {

std::string to_hex(const unsigned char* bytes, std::size_t size) {
  constexpr const char* kDigits = "0123456789abcdef";
  std::string text;
  for (std::size_t i = 0; i < size; ++i) {
    text += kDigits[bytes[i] >> 4];
    text += kDigits[bytes[i] & 15];
  }
  return text;
}

std::string md5(const std::string& text) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  if (EVP_Digest(text.data(), text.size(), digest.data(), &size, EVP_md5(), nullptr) != 1) {
    throw std::runtime_error("OpenSSL offers no MD5");
  }
  return to_hex(digest.data(), size);
}

std::string random_nonce() {
  std::array<unsigned char, 16> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    throw std::runtime_error("OpenSSL has no random numbers");
  }
  return to_hex(bytes.data(), bytes.size());
}

// name=value or name="value", separated by commas.
std::map<std::string, std::string> parse_parameters(const std::string& text) {
  static const std::regex parameter(R"re(([A-Za-z]+)\s*=\s*(?:"([^"]*)"|([^\s,"]*)))re");
  std::map<std::string, std::string> values;
  for (std::sregex_iterator it(text.begin(), text.end(), parameter), end; it != end; ++it) {
    values[(*it)[1]] = (*it)[2].matched ? (*it)[2] : (*it)[3];
  }
  return values;
}

}  // namespace

std::string digest_response(const std::string& user, const std::string& realm,
                            const std::string& password, const std::string& method,
                            const std::string& uri, const std::string& nonce, const std::string& nc,
                            const std::string& cnonce) {
  const std::string ha1 = md5(user + ':' + realm + ':' + password);
  const std::string ha2 = md5(method + ':' + uri);
  return md5(ha1 + ':' + nonce + ':' + nc + ':' + cnonce + ":auth:" + ha2);
}

DigestAuth::DigestAuth(std::string user, std::string password, std::string realm)
    : user_(std::move(user)), password_(std::move(password)), realm_(std::move(realm)) {}

DigestStatus DigestAuth::check(const std::string& method, const std::string& target,
                               const std::string& authorization) {
  const std::string scheme = "Digest ";
  if (authorization.compare(0, scheme.size(), scheme) != 0) return DigestStatus::kMissing;
  auto given = parse_parameters(authorization.substr(scheme.size()));
  if (given["username"] != user_ || given["realm"] != realm_ || given["uri"] != target ||
      given["qop"] != "auth" || given["cnonce"].empty()) {
    return DigestStatus::kRejected;
  }
  if (given["response"] != digest_response(user_, realm_, password_, method, target, given["nonce"],
                                           given["nc"], given["cnonce"])) {
    return DigestStatus::kRejected;
  }
  const std::string& nc = given["nc"];
  if (nc.size() != 8 || nc.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos) {
    return DigestStatus::kRejected;
  }
  const std::uint64_t count = std::strtoull(nc.c_str(), nullptr, 16);
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto nonce = nonces_.find(given["nonce"]);
  if (nonce == nonces_.end() || count <= nonce->second.last_count) return DigestStatus::kStale;
  nonce->second.last_count = count;
  return DigestStatus::kOk;
}

std::string DigestAuth::challenge(DigestStatus status) {
  const std::string nonce = random_nonce();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (nonces_.size() >= kMaxNonces) {
      nonces_.erase(std::min_element(
          nonces_.begin(), nonces_.end(),
          [](const auto& a, const auto& b) { return a.second.age_key < b.second.age_key; }));
    }
    nonces_[nonce].age_key = nonces_made_++;
  }
  std::string text =
      "Digest realm=\"" + realm_ + "\", nonce=\"" + nonce + "\", algorithm=MD5, qop=\"auth\"";
  if (status == DigestStatus::kStale) text += ", stale=true";
  return text;
}

}  // namespace alidade
