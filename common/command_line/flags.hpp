// Common style of the programs' flags: of their helps, and of one-line errors for a bad command line.
//
//     --rate-hz N=20 (1 to 1000)  frames a second        in helps: name of the value, default, range or words, REQUIRED
//     --rate-hz: "abc" is no number; expected 1 to 1000; see palpate-server --help
//
// Texts of flags begin in lower case and end without a full stop. CLI11 does the rest.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <functional>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "common/base/error.hpp"

namespace palpate {

/// Accepts a number from `low` to `high`, whole if both are integers; rejects "nan".
template <class Number>
CLI::Validator number_from(Number low, Number high) {
  constexpr const char* kKind = std::is_integral_v<Number> ? "whole number" : "number";
  const std::string range = fmt::format("{} to {}", low, high);
  const auto judge = [=](const std::string& typed) -> std::string {
    Number value{};
    const auto [end, fault] = std::from_chars(typed.data(), typed.data() + typed.size(), value);
    if (fault != std::errc{} || end != typed.data() + typed.size())
      return fmt::format("\"{}\" is no {}; expected {}", typed, kKind, range);
    if (value >= low && value <= high) return {};
    return fmt::format("is {}; expected {}", typed, range);
  };
  return {judge, "(" + range + ")"};
}

/// Accepts a whole number from 0. Needed because CLI11 reads "-1" as 2^64 - 1.
inline CLI::Validator whole_number() {
  const auto judge = [](const std::string& typed) -> std::string {
    std::uint64_t value{};
    const auto [end, fault] = std::from_chars(typed.data(), typed.data() + typed.size(), value);
    const bool whole = fault == std::errc{} && end == typed.data() + typed.size();
    return whole ? "" : fmt::format("is \"{}\"; expected a whole number from 0 to 2^64 - 1", typed);
  };
  return {judge, ""};
}

/// Accepts one of these words.
inline CLI::Validator one_of(const std::vector<std::string>& words) {
  const auto listed = [&](const char* between) { return fmt::format("{}", fmt::join(words, between)); };
  const auto judge = [words, all = listed(", ")](const std::string& typed) -> std::string {
    if (std::find(words.begin(), words.end(), typed) != words.end()) return {};
    return fmt::format("is \"{}\"; expected one of {}", typed, all);
  };
  return {judge, "{" + listed(",") + "}"};
}

/// Returns the placeholder of a flag's value: CLI11 appends the descriptions of validators to the type, after a colon.
inline std::string value_name(const CLI::Option& option) {
  const std::string type = option.get_type_name();
  const auto check = std::min(type.find(":("), type.find(":{"));
  std::string name = type.substr(0, check);
  if (check != std::string::npos && type[check + 1] == '{') {
    name = type.substr(check + 2, type.size() - check - 3);
    std::replace(name.begin(), name.end(), ',', '|');
  }
  return name == "INT" || name == "UINT" || name == "FLOAT" ? "N" : name;
}

/// Prints a flag's placeholder, default and range instead of types of a programming language.
class HelpFormat : public CLI::Formatter {
 public:
  /// Formats `--touch{mouse}`, a flag with an optional value, as --touch[=NAME].
  std::string make_option_name(const CLI::Option* option, bool positional) const override {
    std::string name = CLI::Formatter::make_option_name(option, positional);
    const auto begin = name.find('{'), end = name.find('}');
    if (begin == std::string::npos || end == std::string::npos) return name;
    const bool negation = name.substr(begin, end - begin) == "{false";
    return name.replace(begin, end + 1 - begin, negation ? "" : "[=NAME]");
  }

  std::string make_option_opts(const CLI::Option* option) const override {
    if (!option->get_option_text().empty()) return " " + option->get_option_text();
    std::string text;
    if (option->get_type_size() != 0) text = value_of(*option);
    for (const CLI::Option* other : option->get_excludes()) text += " (not with " + other->get_name() + ")";
    return text;
  }

 private:
  /// Returns for example " N=20 (1 to 1000) REQUIRED".
  static std::string value_of(const CLI::Option& option) {
    const std::string name = value_name(option), type = option.get_type_name();
    const auto range = type.find(":(");
    std::string text = name.empty() ? "" : " " + name;
    const bool several = option.get_expected_max() == CLI::detail::expected_max_vector_size;
    if (std::string given = option.get_default_str(); !given.empty() && given != "[]" && !option.get_required()) {
      if (several && given.starts_with('[')) given = given.substr(1, given.size() - 2);
      text += "=" + given;
    }
    if (several) text += " ...";
    if (range != std::string::npos) text += " " + type.substr(range + 1);
    if (option.get_required()) text += " REQUIRED";
    return text;
  }
};

/// Sets the name and `version` of the program, its help format and an example. Call before flags and sub-commands are added.
inline void describe_program(CLI::App& app, const std::string& version, const std::string& example) {
  app.formatter(std::make_shared<HelpFormat>());
  app.set_help_flag("-h,--help", "print this help and end");
  app.set_version_flag("--version", app.get_name() + " " + version, "print the version and end");
  app.footer(fmt::format("Example:\n  {}\n\nDocumentation: docs/reference/command-line.md", example));
}

/// Returns one line for a bad command line: the fault and what was expected. Unknown flags come first, because a missing flag may
/// have been meant by one of them.
inline std::string what_is_wrong(const CLI::App& app, const CLI::ParseError& error) {
  const auto chosen = app.get_subcommands();
  const CLI::App& command = chosen.empty() ? app : *chosen.front();
  const std::string help = app.get_name() + (chosen.empty() ? "" : " " + command.get_name()) + " --help";
  const std::string said = error.what();
  if (const auto extra = app.remaining(true); !extra.empty())
    return fmt::format("{}: is unknown; expected flags that {} lists", extra.front(), help);
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::RequiredError))
    for (const CLI::Option* option : command.get_options())
      if (option->get_required() && option->count() == 0)
        return fmt::format("{}: it is missing; expected {}; see {}", option->get_name(), value_name(*option), help);
  constexpr std::string_view kConversion = "Could not convert: ";
  if (const auto equals = said.find(" = "); said.starts_with(kConversion) && equals != std::string::npos)
    return fmt::format("{}: \"{}\" is no number; expected one; see {}",
                       said.substr(kConversion.size(), equals - kConversion.size()), said.substr(equals + 3), help);
  if (error.get_exit_code() == static_cast<int>(CLI::ExitCodes::ArgumentMismatch) && said.ends_with(" missing"))
    return fmt::format("{}: its value is missing; see {}", said.substr(0, said.find(':')), help);
  return fmt::format("{}; see {}", said, help);
}

/// The body of main(). Returns the result of `run`; 0 after --help and --version; 2 with one line on stderr, which begins with
/// the name of `app`, for wrong usage or input; 1 with one line for later failures, including writing to stdout.
inline int run_program(CLI::App& app, const std::function<int()>& run) {
  const auto fail = [&](const std::string& line, int status) {
    fmt::print(stderr, "{}: {}\n", app.get_name(), line);
    return status;
  };
  // Standard output may be a file on a full disk.
  const auto said = [&](int status) {
    const bool whole = std::fflush(stdout) == 0 && std::ferror(stdout) == 0 && std::cout.flush().good();
    return whole || status != 0 ? status : fail("what it says could not be written", 1);
  };
  try {
    return said(run());
  } catch (const CLI::Success& asked) {
    return said(app.exit(asked));
  } catch (const CLI::ParseError& wrong) {
    return fail(what_is_wrong(app, wrong), 2);
  } catch (const InputError& wrong) {
    return fail(wrong.what(), 2);
  } catch (const std::exception& failure) {
    return fail(failure.what(), 1);
  }
}

}  // namespace palpate
