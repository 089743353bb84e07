// Writes lines to a descriptor (standard output) on a thread of its own, so that the caller never waits for a reader.
//
// While nobody reads (a stopped terminal, a pager, a log that hangs) up to kWaitingMax bytes wait; further lines are dropped, and
// their number is reported once there is room again. When nobody will ever read (a pipe whose reader is gone; SIGPIPE has to be
// ignored) all lines are dropped. Lines that wait at the end have kEndMost to be written.
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
  static constexpr std::chrono::milliseconds kEndMost{500};         ///< half of the second that a program has to end
  using LeftOut = std::function<std::string(std::uint64_t lines)>;  ///< returns the report, with its newline

  LineWriter(int descriptor, LeftOut left_out);
  ~LineWriter();
  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  /// Writes complete lines, with their newlines. Any thread.
  void write(const std::string& lines);

 private:
  struct Shared;
  std::shared_ptr<Shared> shared_;  // outlives the writer when the thread hangs in the descriptor
  std::thread thread_;
};

}  // namespace palpate
