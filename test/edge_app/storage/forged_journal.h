#pragma once
// A rollback journal as somebody else would forge it: SQLite takes it for that of a change which a power cut interrupted, and, having
// undone it, deletes the file that it names as its super-journal.

#include <cstdint>
#include <fstream>
#include <string>

namespace alidade::test {

inline void forge_journal(const std::string& journal, const std::string& victim) {
  const auto number = [](std::uint32_t value) {
    std::string bytes;
    for (const unsigned shift : {24U, 16U, 8U, 0U}) bytes += static_cast<char>(value >> shift);
    return bytes;
  };
  const std::string magic = "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7";
  constexpr std::uint32_t kSector = 512;
  std::string bytes = magic + number(0) + number(1) + number(1) + number(kSector) + number(4096);
  bytes.resize(kSector);
  std::uint32_t sum = 0;
  for (const char c : victim) sum += static_cast<unsigned char>(c);
  constexpr std::uint32_t kLockPage = 0x40000000 / 4096 + 1;
  bytes += number(kLockPage) + victim + number(static_cast<std::uint32_t>(victim.size())) +
           number(sum) + magic;
  std::ofstream(journal, std::ios::binary) << bytes;
}

}  // namespace alidade::test
