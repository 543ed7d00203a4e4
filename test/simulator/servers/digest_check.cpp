#include "test/simulator/servers/digest_check.h"

#include <openssl/evp.h>

#include <map>
#include <regex>
#include <utility>

namespace alidade {
namespace {

constexpr const char* kRealm = "AXIS_TEST";

std::string digest_of(const EVP_MD* kind, const std::string& text) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned size = 0;
  EVP_Digest(text.data(), text.size(), digest, &size, kind, nullptr);
  return {reinterpret_cast<const char*>(digest), size};
}

std::string hexadecimal(const std::string& bytes) {
  std::string hex;
  for (const char c : bytes) {
    constexpr const char* kDigits = "0123456789abcdef";
    hex += kDigits[static_cast<unsigned char>(c) >> 4];
    hex += kDigits[static_cast<unsigned char>(c) & 15];
  }
  return hex;
}

int next_nonce() {
  static std::atomic<int> next{0};
  return next++;
}

}  // namespace

DigestCheck::DigestCheck(std::string user, std::string password, Algorithm algorithm)
    : user_(std::move(user)),
      password_(std::move(password)),
      algorithm_(algorithm),
      nonce_(next_nonce()) {}

void DigestCheck::renew_nonce() { nonce_ = next_nonce(); }

std::string DigestCheck::hash(const std::string& text) const {
  return hexadecimal(digest_of(algorithm_ == Algorithm::kMd5 ? EVP_md5() : EVP_sha256(), text));
}

std::string DigestCheck::challenge() const {
  return std::string("Digest realm=\"") + kRealm + "\", nonce=\"" + nonce() +
         "\", algorithm=" + (algorithm_ == Algorithm::kMd5 ? "MD5" : "SHA-256") + ", qop=\"auth\"";
}

bool DigestCheck::accepts(const std::string& method, const std::string& target,
                          const std::string& authorization) const {
  if (user_.empty()) {
    return true;
  }
  if (authorization.rfind("Digest ", 0) != 0) {
    return false;
  }
  std::map<std::string, std::string> field;
  const std::regex pair("(\\w+)=(\"([^\"]*)\"|[^,\\s]+)");
  for (std::sregex_iterator match(authorization.begin(), authorization.end(), pair), end;
       match != end; ++match) {
    field[(*match)[1]] = (*match)[3].matched ? (*match)[3].str() : (*match)[2].str();
  }
  const std::string secret = hash(user_ + ":" + kRealm + ":" + password_);
  const std::string what = hash(method + ":" + field["uri"]);
  const std::string expected = nonce();
  return field["username"] == user_ && field["nonce"] == expected && field["uri"] == target &&
         field["response"] == hash(secret + ":" + expected + ":" + field["nc"] + ":" +
                                   field["cnonce"] + ":auth:" + what);
}

bool accepts_basic(const std::string& user, const std::string& password,
                   const std::string& authorization) {
  return authorization == "Basic " + base64(user + ":" + password);
}

std::string header_of(const std::string& request, const std::string& name) {
  const std::size_t at = request.find("\r\n" + name + ": ");
  if (at == std::string::npos) {
    return {};
  }
  const std::size_t begin = at + name.size() + 4;
  return request.substr(begin, request.find("\r\n", begin) - begin);
}

std::string sha1(const std::string& bytes) { return digest_of(EVP_sha1(), bytes); }

std::string base64(const std::string& bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                   reinterpret_cast<const unsigned char*>(bytes.data()),
                                   static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(size));
  return text;
}

std::string from_base64(const std::string& text) {
  std::string bytes(text.size(), '\0');
  const int size = EVP_DecodeBlock(reinterpret_cast<unsigned char*>(bytes.data()),
                                   reinterpret_cast<const unsigned char*>(text.data()),
                                   static_cast<int>(text.size()));
  if (size < 0) {
    return {};
  }
  bytes.resize(static_cast<std::size_t>(size));
  for (std::size_t end = text.size(); end > 0 && text[end - 1] == '='; --end) {
    bytes.pop_back();
  }
  return bytes;
}

}  // namespace alidade
