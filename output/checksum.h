// Fingerprints of bytes.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>

namespace twilight {

/// FNV-1a, 64 bits (Fowler, Noll & Vo; RFC 9923), as 16 hexadecimal digits. Finds damage and
/// changes; no protection against intent.
std::string fnv1a64(std::span<const std::byte> bytes);
inline std::string fnv1a64(std::string_view text) {
  return fnv1a64(std::as_bytes(std::span(text)));
}

/// Of the contents of files, one after the other. Throws std::runtime_error for one that cannot be
/// read.
std::string fnv1a64_of_files(std::span<const std::filesystem::path> files);
/// FNV-1a, 128 bits, as 32 hexadecimal digits: names what must not collide by chance.
std::string fnv1a128(std::string_view text);

}  // namespace twilight
