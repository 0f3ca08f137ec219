#include "output/checksum.h"

#include <fmt/format.h>

#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace twilight {

std::string fnv1a64(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::byte byte : bytes) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 1099511628211ULL;
  }
  return fmt::format("{:016x}", hash);
}

std::string fnv1a64_of_files(std::span<const std::filesystem::path> files) {
  std::string content;
  for (const std::filesystem::path& path : files) {
    std::ifstream stream(path, std::ios::binary);
    if (!stream) throw std::runtime_error(fmt::format("{}: cannot read this file", path.string()));
    content.append(std::istreambuf_iterator<char>(stream), {});
    content += fmt::format("\n{}\n", content.size());  // where one ends
  }
  return fnv1a64(content);
}

std::string fnv1a128(std::string_view text) {
  // The prime is 2^88 + 0x13b: a product modulo 2^128 is a shift and a small product.
  std::uint64_t high = 0x6c62272e07bb0142ULL, low = 0x62b821756295c58dULL;
  constexpr std::uint64_t kSmall = 0x13b;
  for (const char c : text) {
    low ^= static_cast<unsigned char>(c);
    const std::uint64_t lower = (low & 0xffffffffULL) * kSmall;
    const std::uint64_t upper = (low >> 32) * kSmall + (lower >> 32);
    const std::uint64_t carry = upper >> 32;
    high = high * kSmall + carry + (low << 24);
    low = (upper << 32) | (lower & 0xffffffffULL);
  }
  return fmt::format("{:016x}{:016x}", high, low);
}

}  // namespace twilight
