#include "output/checksum.h"

#include <fmt/format.h>

#include <cstdint>

namespace twilight {

std::string fnv1a64(std::span<const std::byte> bytes) {
  std::uint64_t hash = 14695981039346656037ULL;
  for (const std::byte byte : bytes) {
    hash = (hash ^ std::to_integer<std::uint64_t>(byte)) * 1099511628211ULL;
  }
  return fmt::format("{:016x}", hash);
}

}  // namespace twilight
