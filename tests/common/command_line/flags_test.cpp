// Help texts of the programs, and messages for command lines that they do not understand.
#include "common/command_line/flags.hpp"

#include <catch2/catch.hpp>

using namespace palpate;

namespace {

/// A program with flags of every kind.
struct SmallProgram {
  CLI::App app{"does little", "palpate-small"};
  std::string scene, color = "red";
  double rate_hz = 20;
  int threads = 1;
  std::uint64_t seed = 1;
  std::vector<std::string> only;

  SmallProgram() {
    describe_program(app, "1.2.3", "palpate-small --scene a.json");
    app.option_defaults()->always_capture_default();
    app.add_option("--scene", scene, "scene file")->required()->type_name("FILE");
    app.add_option("--rate-hz", rate_hz, "frames a second")->check(number_from(1.0, 1000.0));
    app.add_option("--threads", threads, "threads that step")->check(number_from(1, 8));
    app.add_option("--seed", seed, "of what is drawn")->check(whole_number());
    app.add_option("--color", color, "of the body")->check(one_of({"red", "blue"}));
    app.add_option("--only", only, "these alone")->type_name("NAME")->delimiter(',');
  }

  /// Parses a line; returns the error message, empty if there is none.
  std::string parse(std::vector<std::string> line) {
    std::reverse(line.begin(), line.end());
    try {
      app.parse(line);
      return "";
    } catch (const CLI::ParseError& error) {
      return what_is_wrong(app, error);
    }
  }
};

}  // namespace

TEST_CASE("a help names what a flag takes, its default and its range") {
  const std::string help = SmallProgram().app.help();
  for (const char* line :
       {"--scene FILE REQUIRED ", "--rate-hz N=20 (1 to 1000) ", "--threads N=1 (1 to 8) ", "--color red|blue=red ",
        "--only NAME ...", "Example:\n  palpate-small --scene a.json", "Documentation: docs/reference/command-line.md"}) {
    CAPTURE(help, line);
    CHECK(help.find(line) != std::string::npos);
  }
}

TEST_CASE("a line that is wrong is told what, and what was expected") {
  const auto said = [](std::vector<std::string> line) { return SmallProgram().parse(std::move(line)); };
  CHECK(said({"--scene", "a", "--rate-hz", "1e2", "--threads", "8", "--seed", "18446744073709551615", "--only", "a,b"}).empty());
  CHECK(said({"--rate-hz", "2"}) == "--scene: it is missing; expected FILE; see palpate-small --help");
  CHECK(said({"--colour", "red"}) == "--colour: is unknown; expected flags that palpate-small --help lists");
  CHECK(said({"--scene", "a", "--rate-hz", "abc"}) ==
        "--rate-hz: \"abc\" is no number; expected 1 to 1000; see palpate-small --help");
  CHECK(said({"--scene", "a", "--rate-hz", "nan"}).find("--rate-hz: is nan; expected 1 to 1000") == 0);
  CHECK(said({"--scene", "a", "--threads", "2.5"}).find("--threads: \"2.5\" is no whole number; expected 1 to 8") == 0);
  CHECK(said({"--scene", "a", "--threads", "9"}).find("--threads: is 9; expected 1 to 8") == 0);
  CHECK(said({"--scene", "a", "--seed", "-1"}).find("--seed: is \"-1\"; expected a whole number from 0") == 0);
  CHECK(said({"--scene", "a", "--color", "green"}).find("--color: is \"green\"; expected one of red, blue") == 0);
  CHECK(said({"--scene"}) == "--scene: its value is missing; see palpate-small --help");
}

TEST_CASE("a program ends with 2 for a wrong line or input, with 1 for what fails later") {
  CLI::App app{"does little", "palpate-small"};
  CHECK(run_program(app, [] { return 7; }) == 7);
  CHECK(run_program(app, []() -> int { throw InputError("a.json:3", "is no scene", "one"); }) == 2);
  CHECK(run_program(app, []() -> int { throw CLI::ExtrasError({"--x"}); }) == 2);
  CHECK(run_program(app, []() -> int { throw std::runtime_error("the disk is full"); }) == 1);
}
