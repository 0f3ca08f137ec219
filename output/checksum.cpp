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

}  // namespace twilight
