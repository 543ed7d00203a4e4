#include "platform/discovery/dns_sd.h"

#include <arpa/inet.h>
#include <arpa/nameser.h>
#include <netinet/in.h>
#include <strings.h>

#include <algorithm>
#include <array>

namespace alidade {
namespace {

constexpr int kMostRecords = 256;
constexpr std::size_t kMostServices = 64;
constexpr std::size_t kMostAddresses = 8;  // of one service

void put_16(std::string* bytes, unsigned value) {
  *bytes += static_cast<char>(value >> 8U);
  *bytes += static_cast<char>(value & 0xFFU);
}

// "_axis-video._tcp.local": each label behind its length.
void put_name(std::string* bytes, const std::string& name) {
  for (std::size_t begin = 0; begin < name.size();) {
    const std::size_t end = std::min(name.find('.', begin), name.size());
    *bytes += static_cast<char>(end - begin);
    bytes->append(name, begin, end - begin);
    begin = end + 1;
  }
  *bytes += '\0';
}

bool is_same_name(const std::string& a, const std::string& b) {
  return ::strcasecmp(a.c_str(), b.c_str()) == 0;
}

// libresolv writes \. for a dot in a label and \123 for other special bytes.
std::string plain_label(std::string_view text) {
  std::string plain;
  const auto is_digit = [&](std::size_t at) {
    return at < text.size() && text[at] >= '0' && text[at] <= '9';
  };
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '\\' || i + 1 == text.size()) {
      plain += text[i];
    } else if (is_digit(i + 1) && is_digit(i + 2) && is_digit(i + 3)) {
      const int byte = 100 * (text[i + 1] - '0') + 10 * (text[i + 2] - '0') + text[i + 3] - '0';
      plain += static_cast<char>(byte);
      i += 3;
    } else {
      plain += text[++i];
    }
  }
  return plain;
}

// One record of the message, whatever its section.
struct DnsRecord {
  std::string name;
  int type = 0;
  const unsigned char* data = nullptr;
  std::size_t size = 0;
};

std::vector<DnsRecord> records_of(ns_msg* message) {
  std::vector<DnsRecord> records;
  for (const ns_sect section : {ns_s_an, ns_s_ns, ns_s_ar}) {
    const int count = std::min<int>(ns_msg_count(*message, section), kMostRecords);
    for (int i = 0; i < count; ++i) {
      ns_rr record{};
      if (ns_parserr(message, section, i, &record) != 0) return records;
      records.push_back({ns_rr_name(record), ns_rr_type(record), ns_rr_rdata(record),
                         static_cast<std::size_t>(ns_rr_rdlen(record))});
    }
  }
  return records;
}

// The name that begins `offset` bytes into the record's data; empty: damaged.
std::string name_in(const ns_msg& message, const DnsRecord& record, std::size_t offset) {
  std::array<char, NS_MAXDNAME> name{};
  if (record.size <= offset ||
      ns_name_uncompress(ns_msg_base(message), ns_msg_end(message), record.data + offset,
                         name.data(), name.size()) < 0) {
    return "";
  }
  return name.data();
}

std::string address_in(const DnsRecord& record) {
  std::array<char, INET6_ADDRSTRLEN> text{};
  const int family = record.type == ns_t_a ? AF_INET : AF_INET6;
  const std::size_t size = record.type == ns_t_a ? sizeof(in_addr) : sizeof(in6_addr);
  if (record.size != size ||
      ::inet_ntop(family, record.data, text.data(), static_cast<socklen_t>(text.size())) == nullptr)
    return "";
  return text.data();
}

// The part of an instance's name before its service's: "Gate" of "Gate._axis-video._tcp.local".
std::string instance_of(const std::string& name, const std::string& type) {
  const std::size_t end = name.size() - std::min(name.size(), type.size() + 1);
  return plain_label(std::string_view(name).substr(0, end));
}

}  // namespace

std::string dns_sd_question(const std::vector<std::string>& types, std::uint16_t id) {
  std::string bytes;
  put_16(&bytes, id);
  put_16(&bytes, 0);  // a query
  put_16(&bytes, static_cast<unsigned>(types.size()));
  for (int section = 0; section < 3; ++section) put_16(&bytes, 0);
  for (const std::string& type : types) {
    put_name(&bytes, type);
    put_16(&bytes, ns_t_ptr);
    put_16(&bytes, ns_c_in);
  }
  return bytes;
}

bool parse_dns_sd_answer(std::string_view datagram, const std::vector<std::string>& types,
                         std::uint16_t id, std::vector<DnsService>* services, std::string* error) {
  services->clear();
  ns_msg message{};
  if (ns_initparse(reinterpret_cast<const unsigned char*>(datagram.data()),
                   static_cast<int>(datagram.size()), &message) != 0) {
    *error = "an answer that is not a whole DNS message";
    return false;
  }
  if (ns_msg_getflag(message, ns_f_qr) == 0 || ns_msg_id(message) != id) {
    *error = "a DNS message that answers nothing that was asked";
    return false;
  }
  const std::vector<DnsRecord> records = records_of(&message);
  std::vector<std::string> names;  // of the instances, as in the message
  for (const DnsRecord& record : records) {
    const auto type = std::find_if(types.begin(), types.end(), [&](const std::string& asked) {
      return record.type == ns_t_ptr && is_same_name(record.name, asked);
    });
    if (type == types.end() || services->size() == kMostServices) continue;
    const std::string name = name_in(message, record, 0);
    if (name.size() <= type->size() + 1) continue;
    names.push_back(name);
    services->emplace_back();
    services->back().instance = instance_of(name, *type);
    services->back().type = *type;
  }
  constexpr std::size_t kBeforeTarget = 6;  // priority, weight, port
  for (const DnsRecord& record : records) {
    for (std::size_t i = 0; record.type == ns_t_srv && i < services->size(); ++i) {
      if (!is_same_name(record.name, names[i]) || record.size <= kBeforeTarget) continue;
      (*services)[i].port = static_cast<int>(ns_get16(record.data + 4));
      (*services)[i].host = name_in(message, record, kBeforeTarget);
    }
  }
  for (const DnsRecord& record : records) {
    if (record.type != ns_t_a && record.type != ns_t_aaaa) continue;
    const std::string address = address_in(record);
    for (DnsService& service : *services) {
      if (!address.empty() && is_same_name(record.name, service.host) &&
          service.addresses.size() < kMostAddresses)
        service.addresses.push_back(address);
    }
  }
  return true;
}

}  // namespace alidade
