#include "server/io/udp_server.hpp"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <asio/post.hpp>
#include <chrono>
#include <cstddef>
#include <utility>

#include "common/base/counted.hpp"
#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/base/limits.hpp"
#include "common/base/plain_text.hpp"
#include "common/io/channel_endpoint.hpp"
#include "common/io/monotonic.hpp"
#include "common/io/processor_time.hpp"
#include "server/io/frame_cost.hpp"

namespace palpate {
namespace {

std::uint64_t draw_number() {
  std::array<std::uint8_t, 8> bytes;
  system_random()(bytes);
  return number_at(bytes);
}

double ms(Micros t) { return seconds(t) * 1e3; }

std::int64_t unix_now() {
  return std::chrono::duration_cast<std::chrono::seconds>(std::chrono::system_clock::now().time_since_epoch()).count();
}

/// Formats the frames from `before` to `after`, with the longest.
std::string frame_figures(const ServerCounts& before, const ServerCounts& after, Micros longest) {
  const auto frames = after.frames - before.frames;
  const auto time = after.frame_time_sum - before.frame_time_sum, stepping = after.stepping - before.stepping;
  const double faster = seconds(after.simulated - before.simulated) / std::max(seconds(stepping), 1e-9);
  std::string text = fmt::format("{}, {} of them asleep, {:.2f} ms mean, {:.2f} ms max, {}", counted(frames, "frame"),
                                 after.frames_asleep - before.frames_asleep, frames ? ms(time) / static_cast<double>(frames) : 0,
                                 ms(longest), stepping > Micros{} ? fmt::format("{:.1f} x real time", faster) : "never stepped");
  struct Row {
    std::uint64_t count;
    const char *noun, *what;
  };
  for (const Row& row : {Row{after.frames_without_rollouts - before.frames_without_rollouts, "frame", "without rollouts"},
                         {after.frames_busy - before.frames_busy, "frame", "skipped"},
                         {after.frames_failed - before.frames_failed, "frame", "failed"},
                         {after.cut_steps - before.cut_steps, "step", "cut"},
                         {after.tools_released - before.tools_released, "tool", "released"},
                         {after.dropped_all() - before.dropped_all(), "datagram", "dropped"}})
    if (row.count > 0) text += fmt::format(", {} {}", counted(row.count, row.noun), row.what);
  if (const double left_out = ms(after.left_out - before.left_out); left_out >= 1)
    text += fmt::format(", {:.0f} ms of body time dropped", left_out);
  return text;
}

std::vector<ServerRooms::RoomSpec> specs_of(const std::vector<NamedScene>& scenes) {
  std::vector<ServerRooms::RoomSpec> specs;
  for (const NamedScene& named : scenes) specs.push_back({named.name, facts_of(named.scene, home_of(named.scene))});
  return specs;
}

}  // namespace

void check_room_name(const std::string& where, const std::string& name, const std::vector<NamedScene>& others) {
  if (name.size() > static_cast<std::size_t>(kMaxNameBytes))
    throw InputError(where, "the room's name is too long", fmt::format("up to {} bytes", kMaxNameBytes));
  if (!is_plain_name(name)) throw InputError(where, "the room's name is " + in_quotes(name, '\''), kNameCharacters);
  for (const NamedScene& other : others)
    if (other.name == name) throw InputError(where, "there is a room \"" + name + "\" already", "another name (NAME=FILE)");
}

UdpServer::RoomWorker::RoomWorker(const Scene& scene, std::size_t threads) : step_pool(threads), room(scene) {
  room.use_threads(step_pool);
  room.listen([this](BuildPhase part) {
    const Micros now = monotonic_now();
    if (std::exchange(in_rollouts, part == BuildPhase::rollouts)) rollouts_took += now - rollouts_began;
    if (in_rollouts) rollouts_began = now;
  });
}

/// Measures wall time: a frame delayed by other load is as late as a long one.
FrameResult UdpServer::RoomWorker::run(const FrameJob& job) {
  rollouts_took = {};
  const Micros began = monotonic_now(), used = processor_now();
  FrameResult result = simulate ? simulate(room, job) : room.simulate(job);
  const Micros stepped = monotonic_now();
  room.build_patches(job, result);
  result.step_took = std::max(stepped - began, Micros{1});
  const Micros done = monotonic_now();
  result.patches_took = done - stepped;
  wall_took = done - began;
  processor_took = processor_now() - used;
  if (job.rollouts) result.rollouts_took = rollouts_took;
  return result;
}

UdpServer::UdpServer(const std::vector<NamedScene>& scenes, const ShellOptions& options, SayEvent say)
    : say_(std::move(say)),
      peers_(draw_number),
      cores_(specs_of(scenes), draw_number, options.rate_hz, options.deadband),
      socket_(bind_udp(io_, "--listen", resolve_udp("--listen", options.listen))),
      threads_(std::clamp<std::size_t>(options.threads, 1, scenes.size())) {
  const std::size_t threads_a_room = std::max<std::size_t>(options.threads / scenes.size(), 1);
  for (const NamedScene& named : scenes) {
    workers_.push_back(std::make_unique<RoomWorker>(named.scene, threads_a_room));
    workers_.back()->simulate = options.simulate;
  }
  hear_rooms();
  socket_.non_blocking(true);
  if (options.keys) {
    trust_.emplace(*options.keys, system_random(), unix_now);
    cores_.know_keys([this](PeerId peer) { return trust_->key_of(peer); });
  }
  if (!options.record.file.empty()) begin_recording(scenes, options);
}

void UdpServer::expect_costs(std::size_t room, const FrameCost& cost) {
  cores_[room].expect_costs(expected_costs(cost, cost.core_share));
}

void UdpServer::run() {
  pool_ = std::make_unique<asio::thread_pool>(threads_);
  try {
    receive();
    step();
    record();
    if (watch_) pulse();
    io_.run();
  } catch (...) {
    failure_ = std::current_exception();
  }
  pool_->stop();
  pool_->join();
  end_recording();
  if (failure_) std::rethrow_exception(failure_);
}

void UdpServer::receive() {
  socket_.async_wait(UdpSocket::wait_read, [this](const asio::error_code& fault) {
    if (fault == asio::error::operation_aborted) return;
    take_waiting();
    step();
    receive();
  });
}

void UdpServer::take(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now) {
  ++traffic_.datagrams_in;
  traffic_.bytes_in += datagram.size();
  sender_ = Sender{from};
  if (trust_)
    take_sealed(datagram, from, now);
  else
    cores_.take(datagram, peers_.id_of(from), now);
  sender_.reset();
}

void UdpServer::take_sealed(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now) {
  const auto letter = trust_->take(datagram, channel_address(from), now);
  if (!letter) {
    traffic_.bytes_from_strangers += datagram.size();
    refuse_without_key(datagram, from, now);
    return say_refused();
  }
  if (!letter->shown) traffic_.bytes_from_strangers += datagram.size();
  if (const PublicKey* const key = trust_->channel().key(letter->from)) sender_->key = *key;
  if (letter->ruling.anew) cores_.expel(letter->from, now);
  if (letter->ruling.refused) {
    say_no_right(*letter);
    const std::size_t limit = letter->shown ? kMaxDatagramBytes : letter->size;
    cores_.refuse(letter->message, letter->from, *letter->ruling.refused, limit, now);
  } else {
    cores_.take(letter->fault, letter->message, letter->size, letter->from, now);
  }
}

/// Answers a Hello that came outside of the trust channel, with at most as many bytes.
void UdpServer::refuse_without_key(std::span<const std::byte> datagram, const UdpEndpoint& from, Micros now) {
  Message message;
  if (decode(datagram, message) != WireFault::none || !std::holds_alternative<Hello>(message.body)) return;
  say_no_key(std::get<Hello>(message.body).station, from, now);
  const Message answer{
      0,
      0,
      0,
      {now, message.clock.sent, {}},
      Refuse{RefuseReason::bad_request, "a key is needed (--key FILE) that the server admits (palpate-key admit)"}};
  const auto size = encode(answer, std::span(out_).first(std::min(out_.size(), datagram.size())));
  if (size == 0) return;
  traffic_.bytes_to_strangers += size;
  send(std::span(out_).first(size), from);
}

void UdpServer::end_sessions(Micros now) {
  const auto ended = trust_->channel().take_ended();
  if (ended.empty()) return;
  for (const ChannelPeer peer : ended) cores_.expel(peer, now);
  send_all(now);
  for (const ChannelPeer peer : ended) trust_->forget(peer);
}

void UdpServer::change_keys(SiteKeys keys) {
  trust_->channel().change_keys(std::move(keys));
  step();
}

void UdpServer::take_waiting() {
  const Micros until = monotonic_now() + kTakingMost;
  for (int k = 0; k < kTakenAtOnce; ++k) {
    UdpEndpoint from;
    asio::error_code none;
    const auto size = socket_.receive_from(asio::buffer(in_), from, 0, none);
    if (none == asio::error::would_block || none == asio::error::try_again) return;
    const auto now = monotonic_now();
    if (!none) take(std::span(in_).first(size), from, now);  // else a station's port is closed; it will time out
    if (now >= until) return;
  }
}

void UdpServer::step() {
  const auto now = monotonic_now();
  if (trust_) {
    trust_->channel().tick(now);
    end_sessions(now);
  }
  cores_.tick(now);
  for (std::size_t k = 0; k < cores_.size(); ++k)
    if (auto job = cores_[k].next_job(now)) hand_out(k, std::move(*job));
  send_all(now);
  const Micros due = cores_.deadline();
  if (due == Micros::max()) {
    timer_.cancel();  // all rooms are idle until a datagram comes
    return;
  }
  timer_.expires_at(monotonic_at(due));
  timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) step();
  });
}

void UdpServer::hand_out(std::size_t k, FrameJob job) {
  // Asio's allocator for handlers supports no larger alignment.
  static_assert(alignof(FrameJob) <= alignof(std::max_align_t) && alignof(FrameResult) <= alignof(std::max_align_t));
  RoomWorker& body = *workers_[k];
  if (!std::exchange(reporting_, true)) report();
  if (!std::exchange(body.started, true)) body.room.start(cores_[k].body_time());
  if (RoomRecorder* const recorder = body.recorder()) recorder->begin_frame(job, monotonic_now());
  body.absent.add_to(job, cores_[k].stations());
  asio::post(*pool_, [this, k, &body, job = std::move(job)] {
    try {
      auto result = body.run(job);
      asio::post(io_, [this, k, result = std::move(result)]() mutable { finish(k, std::move(result)); });
    } catch (...) {
      asio::post(io_, [this, k, failure = std::current_exception()] { end_room(k, failure); });
    }
  });
}

void UdpServer::finish(std::size_t k, FrameResult result) {
  const auto now = monotonic_now();
  RoomWorker& body = *workers_[k];
  body.share.add(body.processor_took, body.wall_took);
  cores_[k].set_starved(body.share.starved());
  body.absent.take_out(result);
  if (RoomRecorder* const recorder = body.recorder()) recorder->end_frame(result, cores_[k], now, body.absent.holds());
  cores_[k].finish(std::move(result), now);
  watch_pace(k);
  step();
}

void UdpServer::end_room(std::size_t k, const std::exception_ptr& failure) {
  cores_[k].end("the body of this room failed", monotonic_now());
  try {
    std::rethrow_exception(failure);
  } catch (const std::exception& fault) {
    say(k, "room_failed", fmt::format("the body failed and the room is closed: {}", fault.what()), {{"reason", fault.what()}},
        EventLevel::error);
  }
  bool any_left = false;
  for (std::size_t j = 0; j < cores_.size(); ++j) any_left |= !cores_[j].ended();
  if (any_left) return step();
  failure_ = failure;
  stop();
}

void UdpServer::send_all(Micros now) {
  ChannelAddress address;
  while (const auto size = trust_ ? trust_->channel().emit(octets(std::span(sealed_)), address) : 0) {
    traffic_.bytes_to_strangers += size;
    send(std::span(sealed_).first(size), endpoint_of(address, socket_.local_endpoint().protocol()));
  }
  PeerId to = 0;
  while (const auto size = cores_.emit(out_, to, now)) {
    const auto datagram = std::span(out_).first(size);
    if (trust_)
      send_sealed(datagram, to, now);
    else if (const auto* known = peers_.address_of(to))
      send(datagram, *known);
    else
      ++traffic_.send_failed;
  }
  peers_.forget_strangers([this](PeerId id) { return cores_.serves(id); });
}

void UdpServer::send(std::span<const std::byte> datagram, const UdpEndpoint& to) {
  asio::error_code fault;
  socket_.send_to(asio::buffer(datagram.data(), datagram.size()), to, 0, fault);
  if (fault) {
    ++traffic_.send_failed;
    return;
  }
  ++traffic_.datagrams_out;
  traffic_.bytes_out += datagram.size();
}

void UdpServer::send_sealed(std::span<const std::byte> datagram, PeerId to, Micros now) {
  ChannelAddress address;
  const auto size = trust_->seal(to, datagram, sealed_, address, now);
  if (size == 0) {
    ++traffic_.send_failed;
    return;
  }
  send(std::span(sealed_).first(size), endpoint_of(address, socket_.local_endpoint().protocol()));
}

std::string UdpServer::label(std::size_t k) const {
  return cores_.size() > 1 ? fmt::format("room \"{}\": ", cores_.name(k)) : "";
}

std::string UdpServer::pace_text(std::size_t k) const {
  const ServerCore& core = cores_[k];
  const CoreShare& share = workers_[k]->share;
  return fmt::format(
      "{:.1f} of {:g} frames a second, {:.0f} ms behind{}", core.pace().rate_hz, core.options().rate_hz, ms(core.pace().behind),
      share.starved() ? fmt::format("; the machine is starved: frames get {:.0f} % of a core", 100 * share.share()) : "");
}

void UdpServer::watch_pace(std::size_t k) {
  const ServerCore& core = cores_[k];
  const bool slow = core.pace().rate_hz < kSlowBelow * core.options().rate_hz;
  if (slow == std::exchange(workers_[k]->slow, slow)) return;
  say(k, slow ? "overrun" : "kept_up", slow ? "the room overruns: " + pace_text(k) : "the room keeps its frame rate again",
      {{"rate_hz", core.pace().rate_hz}, {"behind_ms", ms(core.pace().behind)}, {"core_share", workers_[k]->share.share()}},
      slow ? EventLevel::warning : EventLevel::info);
}

void UdpServer::report() {
  report_timer_.expires_after(kReportEvery);
  report_timer_.async_wait([this](const asio::error_code& fault) {
    if (fault) return;
    reporting_ = false;  // until the next frame; continues below if there have been any
    for (std::size_t k = 0; k < cores_.size(); ++k) {
      ServerCore& core = cores_[k];
      const ServerCounts counts = core.counts();
      const Pace& pace = core.pace();
      const bool slow = pace.rate_hz < kSlowBelow * core.options().rate_hz;
      if (core.station_count() > 0)
        say(k, "report",
            fmt::format("{}: {}{}", counted(core.station_count(), "station"),
                        frame_figures(workers_[k]->reported, counts, core.longest_frame()),
                        slow ? ", the room overruns: " + pace_text(k) : ""),
            {{"stations", static_cast<double>(core.station_count())},
             {"frames", static_cast<double>(counts.frames - workers_[k]->reported.frames)},
             {"longest_ms", ms(core.longest_frame())},
             {"rate_hz", pace.rate_hz},
             {"behind_ms", ms(pace.behind)},
             {"core_share", workers_[k]->share.share()}});
      reporting_ |= counts.frames > workers_[k]->reported.frames;
      workers_[k]->reported = counts;
      core.reset_longest_frame();
    }
    if (reporting_) report();
  });
}

std::vector<std::string> UdpServer::summary() const {
  std::vector<std::string> lines;
  for (std::size_t k = 0; k < cores_.size(); ++k) {
    const ServerCounts c = cores_[k].counts();
    lines.push_back(fmt::format("{}in all {}, {}, {}, {} in, {} out, {}", label(k), counted(c.joins, "join"),
                                counted(c.refusals, "refusal"), counted(c.timeouts, "timeout"), counted(c.received, "datagram"),
                                c.sent, frame_figures({}, c, c.frame_time_max)));
  }
  return lines;
}

}  // namespace palpate
