// Checks of command-line numbers that several experiments share.
#pragma once

#include <fmt/format.h>
#include <CLI/CLI.hpp>

#include <cmath>
#include <map>
#include <string>

namespace palpate {

/// A number from `low` to `high`; unlike CLI::Range it does not take "nan" for one.
inline CLI::Validator between(double low, double high) {
  return {[low, high](std::string& text) -> std::string {
            double value = 0;
            if (CLI::detail::lexical_cast(text, value) && value >= low && value <= high) return {};
            return fmt::format("'{}' is out of range; expected a number from {:g} to {:g}", text, low, high);
          },
          fmt::format("FLOAT in [{:g} - {:g}]", low, high)};
}

/// Names of an enumeration: the help shows them, not the numbers that stand for them.
template <class Value>
CLI::CheckedTransformer one_of_names(const std::map<std::string, Value>& values) {
  CLI::CheckedTransformer names(values);
  std::string text;
  for (const auto& [name, value] : values) text += (text.empty() ? "{" : ",") + name;
  names.description(text + "}");
  return names;
}

}  // namespace palpate
