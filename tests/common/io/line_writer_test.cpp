// Lines for a reader that stalls, resumes, or disappears: the writer never waits, and is informed.
#include "common/io/line_writer.hpp"

#include <unistd.h>

#include <array>
#include <catch2/catch.hpp>
#include <csignal>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

using namespace palpate;

namespace {

struct Pipe {
  Pipe() { REQUIRE(::pipe(ends.data()) == 0); }
  ~Pipe() { close_reader(), close_writer(); }
  void close_reader() {
    if (reads()) ::close(std::exchange(ends[0], -1));
  }
  void close_writer() {
    if (ends[1] >= 0) ::close(std::exchange(ends[1], -1));
  }
  bool reads() const { return ends[0] >= 0; }
  /// Reads until `last` has come.
  std::string read_until(const std::string& last) const {
    std::string text;
    std::array<char, 4096> part;
    while (text.find(last) == text.npos) {
      const ::ssize_t got = ::read(ends[0], part.data(), part.size());
      if (got <= 0) break;
      text.append(part.data(), static_cast<std::size_t>(got));
    }
    return text;
  }
  std::array<int, 2> ends{-1, -1};
};

std::string left_out(std::uint64_t lines) { return std::to_string(lines) + " left out\n"; }
std::string line(int k) { return "line " + std::to_string(k) + std::string(90, '.') + "\n"; }

}  // namespace

TEST_CASE("Lines come out as they were written, in order and whole, and all of them before the writer is gone") {
  Pipe pipe;
  std::string all;
  {
    LineWriter writer(pipe.ends[1], left_out);
    for (int k = 0; k < 100; ++k) {
      all += line(k);
      writer.write(line(k));
    }
  }
  pipe.close_writer();
  CHECK(pipe.read_until("nothing ends it") == all);
}

TEST_CASE("Who writes does not wait for a reader that stalls, and lines beyond what may wait are left out and counted") {
  Pipe pipe;
  std::optional<LineWriter> writer(std::in_place, pipe.ends[1], left_out);
  constexpr int kLines = 50'000;  // 5 MB; a pipe buffers 64 kB and the writer 256
  for (int k = 0; k < kLines; ++k) writer->write(line(k));
  const std::string text = pipe.read_until("left out\n");
  int whole = 0;
  std::size_t at = 0;
  for (; text.compare(at, line(whole).size(), line(whole)) == 0; ++whole) at += line(whole).size();
  CHECK(whole >= 2'500);
  CHECK(text.substr(at) == left_out(static_cast<std::uint64_t>(kLines - whole)));
  writer->write("again\n");
  CHECK(pipe.read_until("again\n") == "again\n");
}

TEST_CASE("A writer ends though nobody reads, and where nobody will ever read") {
  Pipe stalled;
  {
    LineWriter writer(stalled.ends[1], left_out);
    for (int k = 0; k < 5'000; ++k) writer.write(line(k));
  }
  CHECK(stalled.read_until("left out\n").starts_with(line(0)));  // its thread ends with that
  auto* const before = std::signal(SIGPIPE, SIG_IGN);
  Pipe gone;
  gone.close_reader();
  {
    LineWriter writer(gone.ends[1], left_out);
    for (int k = 0; k < 5'000; ++k) writer.write(line(k));
  }
  std::signal(SIGPIPE, before);
}
