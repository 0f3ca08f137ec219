// Text inside SVG and HTML.
#pragma once

#include <string>
#include <string_view>

namespace twilight {

/// The text with &, <, >, " and ' as entities; what XML 1.0 does not allow (control characters,
/// bytes that are not UTF-8) becomes U+FFFD.
std::string xml_escaped(std::string_view text);

/// A path as a relative URL: every byte percent-encoded but letters, digits and -._~/ .
std::string url_of_path(std::string_view path);

}  // namespace twilight
