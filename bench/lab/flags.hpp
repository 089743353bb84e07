// Values of flags: names of an enumeration, and lists of numbers.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "common/base/error.hpp"
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

/// Refuses a list of a flag that has a number twice, for which the same would be computed twice.
inline void check_once_each(const char* flag, std::vector<double> numbers) {
  std::sort(numbers.begin(), numbers.end());
  const auto twice = std::adjacent_find(numbers.begin(), numbers.end());
  if (twice != numbers.end()) throw InputError(flag, fmt::format("has {:g} twice", *twice), "each number once");
}

}  // namespace palpate
