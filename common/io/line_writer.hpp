// Lines for a descriptor (standard output), written by a thread of their own: who has something to say never waits for who reads.
//
// Where nobody reads (a stopped terminal, a pager, a log that hangs) up to kWaitingMax bytes wait; lines beyond that are left
// out, and how many is said once there is room again. Where nobody will ever read (a pipe whose reader is gone; SIGPIPE has to be
// ignored) they go nowhere. What waits at the end has kEndMost to get out.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

namespace palpate {

class LineWriter {
 public:
  static constexpr std::size_t kWaitingMax = 256 * 1024;            ///< bytes: some 2,500 lines
  static constexpr std::chrono::milliseconds kEndMost{500};         ///< half of the second in which a program ends
  using LeftOut = std::function<std::string(std::uint64_t lines)>;  ///< the line that says so, with its newline

  LineWriter(int descriptor, LeftOut left_out);
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// Whole lines, with their newlines. Any thread.
  void write(const std::string& lines);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  // outlives the writer where a descriptor never lets go of the thread
  std::thread thread_;
};

}  // namespace palpate
