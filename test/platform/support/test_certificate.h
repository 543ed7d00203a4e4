#pragma once
// A self-signed certificate, as cameras make for themselves.

#include <string>

namespace alidade {

struct TestCertificate {
  std::string certificate;  // PEM
  std::string key;          // PEM
};

// For this host: a name, or an address of IPv4. Valid from two days ago until so many days from today.
TestCertificate make_certificate(const std::string& host, int days);

}  // namespace alidade
