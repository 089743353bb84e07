// Self-contained HTML pages: a mustache template filled from JSON, with embedded pictures, so that a page opens offline.
#pragma once

#include <filesystem>
#include <string>

#include "bench/output/output.hpp"

namespace palpate {

/// Renders objects as sections, arrays as lists, everything else as text (escaped for {{name}}); an empty text counts as false
/// for {{#name}}. Throws std::logic_error if the template itself is wrong.
std::string render_page(const std::string& page_template, const Json& data);

/// Returns an SVG file as a data URI for <img src>; empty if there is no such file (plots are optional).
std::string picture_uri(const std::filesystem::path& svg);

}  // namespace palpate
