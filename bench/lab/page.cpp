#include "bench/lab/page.hpp"

#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <kainjow/mustache.hpp>
#include <stdexcept>
#include <string_view>

namespace palpate {
namespace {

namespace mustache = kainjow::mustache;

mustache::data to_mustache(const Json& json) {
  if (json.is_object()) {
    mustache::data object(mustache::data::type::object);
    for (const auto& [name, value] : json.items()) object.set(name, to_mustache(value));
    return object;
  }
  if (json.is_array()) {
    mustache::data list(mustache::data::type::list);
    for (const Json& value : json) list.push_back(to_mustache(value));
    return list;
  }
  if (json.is_boolean()) return mustache::data(json.get<bool>());
  if (json == "") return mustache::data(false);
  if (json.is_string()) return mustache::data(json.get<std::string>());
  return mustache::data(json.dump());
}

}  // namespace

std::string render_page(const std::string& page_template, const Json& data) {
  mustache::mustache page(page_template);
  if (!page.is_valid()) throw std::logic_error("page template: " + page.error_message());
  return page.render(to_mustache(data));
}

std::string picture_uri(const std::filesystem::path& svg) {
  constexpr std::string_view kEscaped = "%#<>\"\n\r\t&";
  std::ifstream in(svg, std::ios::binary);
  if (!in) return {};
  std::string uri = "data:image/svg+xml,";
  for (const char c : std::string(std::istreambuf_iterator<char>(in), {})) {
    if (kEscaped.find(c) == std::string_view::npos)
      uri += c;
    else
      fmt::format_to(std::back_inserter(uri), "%{:02X}", static_cast<unsigned char>(c));
  }
  return uri;
}

}  // namespace palpate
