// One line of comma-separated text.
#pragma once

#include <string_view>
#include <vector>

namespace twilight {

/// Without the blanks, tabs and carriage returns at both ends.
std::string_view trimmed(std::string_view text);

/// What stands between the commas, each trimmed; at least one.
std::vector<std::string_view> split_at_commas(std::string_view line);

}  // namespace twilight
