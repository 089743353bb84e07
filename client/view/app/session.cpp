#include "client/view/app/session.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <algorithm>
#include <array>
#include <asio/buffer.hpp>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <utility>

#include "common/base/error.hpp"
#include "common/base/limits.hpp"

namespace palpate {
namespace {

volatile std::sig_atomic_t g_end = 0;

}  // namespace

void watch_signals() {
  for (const int signal : {SIGINT, SIGTERM}) std::signal(signal, [](int) { g_end = 1; });
}
bool told_to_end() { return g_end != 0; }

Micros now_us() { return std::chrono::duration_cast<Micros>(std::chrono::steady_clock::now().time_since_epoch()); }

ViewSession::ViewSession(const std::string& server, const std::string& station, const std::string& room, bool alike,
                         const std::optional<ClientKeys>& keys, NameLookup::Ask ask)
    : server_(server),
      core_(station, now_us(), room, alike),
      address_(server_at(server)),
      finder_(server, address_, ask ? std::move(ask) : server_at, now_us()) {
  if (keys) channel_.emplace(*keys, kWireVersion, system_random(), now_us());
  connect();
}

void ViewSession::connect() {
  socket_ = open_udp_towards(io_, address_);
  asio::error_code unreachable;  // a lost network may come back: the next move tries again
  socket_.connect(address_, unreachable);
  socket_.non_blocking(true);
}

ViewSession::~ViewSession() {
  recording_.reset();
  core_.leave();
  pump();
}

void ViewSession::pump() {
  std::array<std::byte, 2 * kMaxDatagramBytes> datagram;
  asio::error_code error;
  // A refused datagram (nobody listens yet) appears as an error of the next call; the one after it may succeed.
  for (int errors = 0; errors < 8;) {
    const std::size_t size = socket_.receive(asio::buffer(datagram), 0, error);
    if (error == asio::error::would_block || error == asio::error::try_again) break;
    if (!error || error == asio::error::connection_refused) nobody_listens_ = static_cast<bool>(error);
    if (error)
      ++errors;
    else
      take(std::span(datagram).first(size));
  }
  if (channel_) channel_->tick(now_us());
  core_.tick(now_us());
  if (const auto server = finder_.move(now_us(), core_.last_answer(), core_.sent_away())) {
    address_ = *server;
    connect();
  }
  pump_recording();
  send_all();
}

void ViewSession::take(std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagramBytes> opened;
  if (channel_) {
    const std::size_t size = channel_->take(octets(datagram), now_us(), octets(std::span(opened)));
    if (size == 0) return;
    datagram = std::span(opened).first(size);
  }
  core_.take(datagram, now_us());
}

void ViewSession::send_all() {
  std::array<std::byte, kMaxDatagramBytes> plain;
  std::array<std::byte, kMaxSealedBytes> sealed;
  asio::error_code ignored;
  const Micros now = now_us();
  while (const std::size_t size = channel_ ? channel_->emit(octets(std::span(sealed)), now) : 0)
    socket_.send(asio::buffer(sealed.data(), size), 0, ignored);
  if (channel_ && !channel_->ready(now)) return;
  while (const std::size_t size = core_.emit(plain, now)) {
    if (channel_) {
      const auto whole = channel_->seal(octets(std::span(plain).first(size)), octets(std::span(sealed)), now);
      socket_.send(asio::buffer(sealed.data(), whole), 0, ignored);
    } else {
      socket_.send(asio::buffer(plain.data(), size), 0, ignored);
    }
  }
}

void ViewSession::record(const std::string& file) {
  if (std::filesystem::exists(file)) throw InputError("--record " + file, "is there already", "a file that is not there yet");
  record_asked_ = file;
}

void ViewSession::toggle_recording() {
  if (recording_) {
    record_note_ = "recorded to " + recording_->file();
    recording_.reset();
  } else if (record_asked_.empty()) {
    record_asked_ = file_for_now(core_.welcome().scene);
  }
}

void ViewSession::pump_recording() {
  if (!recording_) {
    if (record_asked_.empty() || !core_.ready()) return;
    const std::string file = std::exchange(record_asked_, {});
    try {
      recording_ = std::make_unique<ViewerRecording>(core_, file);
      record_note_ = "recording to " + file;
    } catch (const InputError& error) {
      record_note_ = error.what();
      fmt::print(stderr, "palpate-view: {}\n", record_note_);
    }
    return;
  }
  if (const auto ended = recording_->pump(core_, now_us())) {
    record_note_ = *ended;
    recording_.reset();
  }
}

void ViewSession::pump_until(Micros time) {
  while (!told_to_end()) {
    pump();
    const Micros now = now_us();
    if (now >= time) return;
    const Micros due = channel_ ? std::min(core_.deadline(), channel_->deadline()) : core_.deadline();
    const Micros wait = std::clamp(std::min(time, due) - now, Micros{0}, Micros{100'000});
    pollfd readable{socket_.native_handle(), POLLIN, 0};
    ::poll(&readable, 1, static_cast<int>((wait.count() + 999) / 1000));
  }
}

bool ViewSession::show(Micros now, ViewMoment& moment) {
  if (!core_.show(now, moment)) return false;
  if (!core_.heard_lately(now)) moment.tools.clear();
  return true;
}

void ViewSession::remember(Micros now, const std::vector<ToolView>& tools) {
  if (core_.heard_lately(now)) {
    for (const ToolView& tool : tools) forces_.add(now, tool.station, static_cast<float>(tool.force.norm()));
    for (const StationView& station : core_.room().stations)
      patch_ages_.add(now, station.station, static_cast<float>(1e3 * seconds(station.patch_age)));
  }
  forces_.forget(now);
  patch_ages_.forget(now);
}

std::string ViewSession::status(Micros now) const {
  if (core_.link() != LinkState::joined) return "the server was lost; its last shape is shown";
  if (!core_.heard_lately(now))
    return fmt::format("the server has been silent for {:.1f} s; its last shape is shown", seconds(core_.silence(now)));
  const int shapes = core_.shapes_lately(now);
  const std::string body = fmt::format("{} triangles", core_.mesh().triangles.size());
  if (shapes == 0 || core_.room().asleep) return body + "    at rest";
  const char* const starved = core_.room().starved ? "    the server's machine is overloaded" : "";
  return fmt::format("{}    {} shape{} in the last second, shown {:.0f} ms late{}", body, shapes, shapes == 1 ? "" : "s",
                     1e3 * seconds(core_.lateness(now)), starved);
}

Caption ViewSession::caption(Micros now, const std::vector<ToolView>& tools) {
  if (core_.link() == LinkState::refused) return {"refused", core_.refusal(), ""};
  if (!core_.ready()) return {"palpate", (nobody_listens_ ? "nothing listens at " : "waiting for ") + server_, ""};
  remember(now, tools);
  Caption caption{core_.welcome().scene, status(now), ""};
  caption.panels = {.room = &core_.room(),
                    .holds = core_.heard_lately(now),
                    .forces = &forces_,
                    .patch_ages = &patch_ages_,
                    .stations = {},
                    .now = now};
  if (!record_note_.empty()) caption.status += "    " + record_note_;
  return caption;
}

}  // namespace palpate
