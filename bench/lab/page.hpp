// Self-contained HTML pages: a mustache template filled with JSON, pictures inside the file, so that it opens offline.
#pragma once

#include <filesystem>
#include <string>

#include "bench/output/output.hpp"

namespace palpate {

/// Objects become sections, arrays lists, the rest text (escaped where the template says {{name}}); an empty text counts as
/// nothing for {{#name}}. std::logic_error when the template itself is wrong.
std::string render_page(const std::string& page_template, const Json& data);

/// An SVG file as a data URI for <img src>; empty when there is no such file (plots are an extra).
std::string picture_uri(const std::filesystem::path& svg);

}  // namespace palpate
