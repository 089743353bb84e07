#include "bindings/core/live_station.hpp"

#include <stdexcept>
#include <utility>

#include "bindings/core/keys_named.hpp"
#include "bindings/core/local_room.hpp"
#include "client/io/sleep_until.hpp"
#include "common/io/monotonic.hpp"

namespace palpate {
namespace {

constexpr Micros kPoll{5'000};

ClientOptions client_options(const LiveOptions& options) {
  ClientOptions client;
  client.hello.station = options.station;
  client.hello.alike = true;
  client.hello.room = options.room;
  client.hello.tool = options.tool;
  client.hello.scheme = scheme_asked(options.scheme);
  client.guard.force_max_n = options.force_max_n;
  client.guard.slew_max_n_s = options.slew_max_n_s;
  return client;
}

}  // namespace

LiveStation::LiveStation(const LiveOptions& options)
    : server_(options.server),
      with_key_(!options.key_file.empty()),
      core_(client_options(options), monotonic_now()),
      udp_(options.server, core_, {}, {}, keys_named(options.key_file, options.token_file)),
      begin_(monotonic_now()) {
  udp_.start();
}

LiveStation::~LiveStation() { leave(); }

void LiveStation::wait(Micros most) const {
  const Micros end = monotonic_now() + most;
  for (Micros now = monotonic_now(); now < end; sleep_until(now += kPoll)) {
    const ClientStatus status = udp_.status();
    if (!status.fault.empty()) throw std::runtime_error(status.fault);
    if (status.link == LinkState::refused) throw std::runtime_error(server_ + " refuses the station: " + status.refusal);
    if (status.link == LinkState::joined && status.clock_locked) return;
  }
  throw std::runtime_error(no_answer_text(server_, udp_.status().nobody_listens, with_key_));
}

Micros LiveStation::due(Micros now) const noexcept { return begin_ + (now - begin_) / kTick * kTick; }

const TickOutput& LiveStation::run(Micros t, const ToolSample& pose) noexcept {
  last_ = t;
  output_ = core_.haptic().tick({t, pose.position, pose.orientation, pose.opening});
  return output_;
}

TickOutput LiveStation::tick(const ToolSample& pose) noexcept {
  const Micros t = due(monotonic_now());
  return t > last_ ? run(t, pose) : output_;
}

std::size_t LiveStation::follow(std::span<const ToolSample> path, std::span<TickOutput> out) noexcept {
  std::size_t late = 0;
  const Micros begin = due(monotonic_now()) + kTick;
  for (std::size_t k = 0; k < path.size(); ++k) {
    const Micros t = begin + static_cast<std::int64_t>(k) * kTick;
    sleep_until(t);
    if (monotonic_now() < t + kTick)
      run(t, path[k]);
    else
      ++late;
    out[k] = output_;
  }
  return late;
}

void LiveStation::leave() { udp_.stop(); }

}  // namespace palpate
