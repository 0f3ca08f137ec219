// Values of TOML files in complaints.
#pragma once

#include <toml++/toml.h>

#include <sstream>
#include <string>

namespace twilight {

/// A value as a complaint shows it: as the file may have it, cut after 120 letters; "a table".
inline std::string shown(const toml::node& node) {
  if (node.is_table()) return "a table";
  std::ostringstream text;
  node.visit([&](const auto& typed) { text << typed; });
  constexpr std::size_t kLongest = 120;
  return text.str().size() <= kLongest ? text.str() : text.str().substr(0, kLongest) + "...";
}

}  // namespace twilight
