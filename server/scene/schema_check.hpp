// Checks names and types of a JSON tree against a FlatBuffers schema, with messages for people.
#pragma once

#include <string>

#include "common/json/json.hpp"

namespace flatbuffers {
class Parser;
}

namespace palpate {

/// Throws InputError with file, line and field for the first unknown field (with the nearest known name) or wrong type.
void check_against_schema(const Json& root, const flatbuffers::Parser& parser, const std::string& file);

}  // namespace palpate
