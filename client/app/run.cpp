#include "client/app/run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <exception>
#include <thread>

#include "client/app/hand_run.hpp"
#include "client/app/lines.hpp"
#include "client/app/pausing.hpp"
#include "client/app/report.hpp"
#include "client/io/body_reset.hpp"
#include "client/io/link_check.hpp"

namespace palpate {

int check_link(const AppOptions& options, const std::atomic<bool>& stop) {
  constexpr double kTrialS = 10;
  const Micros duration = from_seconds(options.duration_s.value_or(kTrialS));
  say(fmt::format("checking the link to {} for {:g} s", options.server, seconds(duration)));
  const LinkFigures figures = measure_link(options.server, options.station, duration, options.realtime, stop, options.keys);
  if (figures.joined) say(describe(figures));
  const LinkVerdict verdict = judge(figures);
  for (const std::string& word : verdict.words) say("  " + word);
  say(verdict.serves()         ? "serves"
      : verdict.link_serves    ? "the link serves, this machine does not"
      : verdict.machine_serves ? "the link does not serve"
                               : "neither the link nor this machine serves");
  return verdict.serves() ? 0 : 1;
}

int reset_body(const AppOptions& options, const std::atomic<bool>& stop) {
  constexpr double kWaitS = 5;
  const std::string fault =
      reset_body(options.server, "reset", options.room, from_seconds(options.duration_s.value_or(kWaitS)), stop, options.keys);
  if (!fault.empty()) complain("the body was not reset: " + fault);
  if (fault.empty()) say("the body is at rest again");
  return fault.empty() ? 0 : 1;
}

int run(const std::vector<AppOptions>& hands, const std::atomic<bool>& stop) {
  begin_pauses(static_cast<int>(hands.size()));
  CommonStart start(hands.size());
  std::atomic<bool> end{false};
  std::atomic<std::size_t> going{hands.size()};
  std::vector<HandEnd> ends(hands.size());
  std::vector<std::exception_ptr> faults(hands.size());
  std::vector<std::thread> threads;
  for (std::size_t k = 0; k < hands.size(); ++k)
    threads.emplace_back([&, k] {
      if (hands.size() > 1) speak_as(hands[k].station);
      try {
        ends[k] = run_hand(hands[k], start, end);
      } catch (...) {
        faults[k] = std::current_exception();
        end = true;
      }
      hand_ended();
      --going;
    });
  while (going > 0) {
    if (stop) end = true;
    std::this_thread::sleep_for(kPoll);
  }
  for (std::thread& thread : threads) thread.join();
  if (std::ranges::any_of(ends, &HandEnd::device_stuck)) {
    complain("a call of the device does not return: the device was halted and abandoned");
    std::_Exit(1);
  }
  for (const std::exception_ptr& fault : faults)
    if (fault) std::rethrow_exception(fault);
  if (hands.size() > 1 && !hands.front().report.empty()) write_joint_summary(hands);
  return std::ranges::max(ends, {}, &HandEnd::code).code;
}

}  // namespace palpate
