#include "server/io/server_shell.hpp"

#include <spdlog/fmt/fmt.h>

#include <asio/post.hpp>
#include <random>
#include <thread>
#include <utility>

#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

std::uint64_t draw_instance() {
  std::random_device random;
  return std::uint64_t{random()} << 32 | random();
}

double ms(Micros t) { return seconds(t) * 1e3; }

/// Frames from `before` to `after`; `longest` among them.
std::string frame_figures(const ServerCounts& before, const ServerCounts& after, Micros longest) {
  const auto frames = after.frames - before.frames;
  const auto time = after.frame_time_sum - before.frame_time_sum, simulated = after.simulated - before.simulated;
  return fmt::format(
      "{} frames, {:.2f} ms mean, {:.2f} ms max, {:.1f} x real time, {} skipped, {} failed, {} cut steps, {} datagrams dropped",
      frames, frames ? ms(time) / static_cast<double>(frames) : 0, ms(longest),
      time > Micros{} ? seconds(simulated) / seconds(time) : 0, after.frames_busy - before.frames_busy,
      after.frames_failed - before.frames_failed, after.cut_steps - before.cut_steps, after.dropped_all() - before.dropped_all());
}

}  // namespace

ServerShell::ServerShell(const Scene& scene, const std::string& listen, double rate_hz, Say say)
    : say_(std::move(say)),
      room_(scene),
      core_(facts_of(scene, home_of(scene)), {draw_instance(), rate_hz}),
      socket_(bind_udp(io_, "--listen", resolve_udp("--listen", listen))) {
  socket_.non_blocking(true);
}

void ServerShell::run() {
  const auto busy = asio::make_work_guard(step_io_);
  std::thread stepper([this] { step_io_.run(); });
  try {
    receive();
    report();
    step();
    io_.run();
  } catch (...) {
    failure_ = std::current_exception();
  }
  step_io_.stop();
  stepper.join();
  if (failure_) std::rethrow_exception(failure_);
}

void ServerShell::stop() {
  core_.shut_down();
  send_all(monotonic_now());
  io_.stop();
}

void ServerShell::receive() {
  socket_.async_wait(UdpSocket::wait_read, [this](const asio::error_code& fault) {
    if (fault == asio::error::operation_aborted) return;
    UdpEndpoint from;
    asio::error_code none;
    while (true) {
      const auto size = socket_.receive_from(asio::buffer(in_), from, 0, none);
      if (none == asio::error::would_block || none == asio::error::try_again) break;
      if (none) continue;  // an ICMP answer: a station's port is closed; it will time out
      const auto now = monotonic_now();
      if (const auto peer = peers_.id_of(from, now))
        core_.take(std::span(in_).first(size), *peer, now);
      else
        ++strangers_dropped_;
    }
    step();
    receive();
  });
}

void ServerShell::step() {
  const auto now = monotonic_now();
  core_.tick(now);
  if (auto job = core_.next_job(now)) hand_out(std::move(*job));
  send_all(now);
  timer_.expires_at(monotonic_at(core_.deadline()));
  timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) step();
  });
}

void ServerShell::hand_out(FrameJob job) {
  if (!std::exchange(room_started_, true)) room_.start(core_.body_time());
  asio::post(step_io_, [this, job = std::move(job)] {
    try {
      auto result = room_.run(job);
      asio::post(io_, [this, result = std::move(result)]() mutable {
        const auto now = monotonic_now();
        core_.finish(std::move(result), now);
        send_all(now);
      });
    } catch (...) {
      asio::post(io_, [this, failure = std::current_exception()] {
        failure_ = failure;
        stop();
      });
    }
  });
}

void ServerShell::send_all(Micros now) {
  PeerId to = 0;
  while (const auto size = core_.emit(out_, to, now)) {
    const auto* address = peers_.address_of(to);
    asio::error_code fault;
    if (address) socket_.send_to(asio::buffer(out_.data(), size), *address, 0, fault);
    if (!address || fault) ++send_failed_;
  }
}

void ServerShell::report() {
  report_timer_.expires_after(kReportEvery);
  report_timer_.async_wait([this](const asio::error_code& fault) {
    if (fault) return;
    const auto& counts = core_.counts();
    if (core_.station_count() > 0 && say_)
      say_(fmt::format("{} stations: {}", core_.station_count(), frame_figures(reported_, counts, core_.longest_frame())));
    reported_ = counts;
    core_.reset_longest_frame();
    report();
  });
}

std::string ServerShell::summary() const {
  const auto& c = core_.counts();
  return fmt::format("in all {} joins, {} refusals, {} timeouts, {} datagrams in, {} out, {}", c.joins, c.refusals, c.timeouts,
                     c.received, c.sent, frame_figures({}, c, c.frame_time_max));
}

}  // namespace palpate
