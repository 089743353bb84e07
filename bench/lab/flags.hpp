// Names of an enumeration as values of a flag.
#pragma once

#include <map>
#include <string>

#include "common/command_line/flags.hpp"

namespace palpate {

/// Accepts the names; the help shows them instead of the numbers behind them.
template <class Value>
CLI::CheckedTransformer one_of_names(const std::map<std::string, Value>& values) {
  CLI::CheckedTransformer names(values);
  std::string text;
  for (const auto& [name, value] : values) text += (text.empty() ? "{" : ",") + name;
  names.description(text + "}");
  return names;
}

}  // namespace palpate
