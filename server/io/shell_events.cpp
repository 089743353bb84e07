// Events of the server: its rooms, its end, and what is reported to listeners.
#include <spdlog/fmt/fmt.h>

#include <utility>

#include "common/io/channel_endpoint.hpp"
#include "common/io/monotonic.hpp"
#include "server/io/udp_server.hpp"

namespace palpate {
namespace {

const char* name_of(RecordedRole role) {
  constexpr std::array kNames{"hand", "viewer", "shadow"};
  return kNames[static_cast<std::size_t>(role)];
}

void append(std::vector<EventField>& fields, std::vector<EventField> more) {
  fields.insert(fields.end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

void count_roles(const std::vector<StationReport>& stations, RoomState& room) {
  for (const StationReport& s : stations)
    ++(s.role == Role::viewer ? room.viewers : s.shadow_of.empty() ? room.hands : room.shadows);
}

}  // namespace

void UdpServer::hear_rooms() {
  for (std::size_t k = 0; k < workers_.size(); ++k) {
    cores_[k].on_event([this, k](const RecordedEvent& event) {
      if (RoomRecorder* const recorder = workers_[k]->recorder()) recorder->event(attributed(event));
      say(k, event);
    });
    cores_[k].on_note([this, k](const RecordedNote& note) {
      RoomRecorder* const recorder = workers_[k]->recorder();
      if (!recorder) return false;
      recorder->note(note);
      say(k, "note", fmt::format("note of \"{}\": {}", note.author, note.text.empty() ? "(a mark)" : note.text),
          {{"author", note.author}, {"text", note.text}, {"station_id", static_cast<double>(note.station)}});
      return true;
    });
    cores_[k].on_tool_released([this, k](const Station& station) {
      const std::string& name = station.hello.station;
      if (RoomRecorder* const recorder = workers_[k]->recorder())
        recorder->event({monotonic_now(), RecordedEventKind::released, station.id, RecordedRole::hand, Scheme::port, name, ""});
      say(k, "tool_released",
          fmt::format("station \"{}\": its tool was released, as it leaps or costs the body more than a hand does", name),
          {{"station", name}, {"station_id", static_cast<double>(station.id)}}, EventLevel::warning);
    });
    cores_[k].on_piece_removed([this, k](std::size_t cells) {
      say(k, "piece_removed", fmt::format("a blade cut off {} cells that nothing holds any more: they are removed", cells),
          {{"cells", static_cast<double>(cells)}});
    });
    cores_[k].on_sutures([this, k](const SutureNews& news) { say(k, news); });
    cores_[k].on_guidance([this, k](const GuidanceNews& news) { say(k, news); });
    cores_[k].on_scheme([this, k](const std::string& station, const SchemeInUse& in_use) {
      say(k, "scheme", fmt::format("station \"{}\": {}", station, describe(in_use)),
          {{"station", station}, {"scheme", std::string(palpate::name_of(in_use.scheme))}});
    });
  }
}

/// Adds the key of a station that joined to the recorded event, as names can be given to another key later.
RecordedEvent UdpServer::attributed(RecordedEvent event) const {
  if (event.kind == RecordedEventKind::joined && sender_ && sender_->key) event.text = "key " + to_text(*sender_->key);
  return event;
}

void UdpServer::say(std::string kind, const std::string& text, std::vector<EventField> fields, EventLevel level) const {
  if (say_) say_({std::move(kind), text, std::move(fields), level, {}});
}

void UdpServer::say(std::size_t room, std::string kind, const std::string& text, std::vector<EventField> fields,
                    EventLevel level) const {
  fields.insert(fields.begin(), {"room", cores_.name(room)});
  say(std::move(kind), label(room) + text, std::move(fields), level);
}

void UdpServer::say(std::size_t room, const RecordedEvent& event) const {
  const std::string kind = palpate::name_of(event.kind);
  const bool comes = event.kind == RecordedEventKind::joined || event.kind == RecordedEventKind::refused;
  std::string text = fmt::format("station \"{}\" {}", event.name, kind);
  if (comes) text += std::string(" as ") + name_of(event.role);
  if (!event.tool.name.empty()) text += " with tool \"" + event.tool.name + "\"";
  if (comes && sender_) text += " from " + to_string(sender_->from);
  if (!event.text.empty()) text += ": " + event.text;
  std::vector<EventField> fields{
      {"station", event.name}, {"role", name_of(event.role)}, {"station_id", static_cast<double>(event.station)}};
  if (!event.tool.name.empty()) fields.push_back({"tool", event.tool.name});
  if (!event.text.empty()) fields.push_back({"reason", event.text});
  append(fields, sender_fields());
  say(room, kind, text, std::move(fields));
}

void UdpServer::say(std::size_t room, const SutureNews& news) const {
  for (const std::string& name : news.drawn_through)
    say(room, "thread_drawn_through", fmt::format("thread \"{}\" was drawn through the tissue", name), {{"suture", name}});
  for (const std::string& name : news.tied)
    say(room, "thread_tied", fmt::format("thread \"{}\" is tied at its last bite", name), {{"suture", name}});
  for (const std::string& name : news.cut)
    say(room, "thread_cut", fmt::format("thread \"{}\" was cut", name), {{"suture", name}});
  if (news.torn_out > 0)
    say(room, "thread_torn_out", fmt::format("{} bites of threads were torn out of the tissue", news.torn_out),
        {{"bites", static_cast<double>(news.torn_out)}});
}

void UdpServer::say(std::size_t room, const GuidanceNews& news) const {
  std::vector<EventField> fields{{"station", news.guide}, {"guided", news.guided}};
  if (news.begins)
    return say(room, "guides", fmt::format("station \"{}\" guides \"{}\"", news.guide, news.guided), std::move(fields));
  append(
      fields,
      {{"lasted_s", seconds(news.lasted)}, {"force_mean_n", news.guide_force_n}, {"guided_force_mean_n", news.guided_force_n}});
  say(room, "guides_no_more",
      fmt::format("station \"{}\" guided \"{}\" for {:.1f} s; mean force {:.2f} N on the guide, {:.2f} N on the guided hand",
                  news.guide, news.guided, seconds(news.lasted), news.guide_force_n, news.guided_force_n),
      std::move(fields));
}

/// Fields with the sender of the datagram that is being processed, if any.
std::vector<EventField> UdpServer::sender_fields() const {
  if (!sender_) return {};
  std::vector<EventField> fields{{"from", to_string(sender_->from)}};
  if (sender_->key) fields.push_back({"key", to_text(*sender_->key)});
  return fields;
}

/// Returns false under a flood, when not even the text is made.
bool UdpServer::may_say(ChannelFault fault, Micros now) {
  Micros& next = next_refusal_said_[static_cast<std::size_t>(fault)];
  if (!say_ || now < next) return false;
  next = now + kRefusalSaidEvery;
  return true;
}

/// Reports a station that asks to join without a key.
void UdpServer::say_no_key(const std::string& station, const UdpEndpoint& from, Micros now) {
  constexpr char kWhy[] = "it has no key (--key)";
  if (!may_say(ChannelFault::malformed, now)) return;
  say_({"no_session",
        fmt::format("no session for station \"{}\" at {}: {}", station, to_string(from), kWhy),
        {{"station", station}, {"from", to_string(from)}, {"reason", kWhy}},
        EventLevel::warning,
        kWhy});
}

/// Reports refused datagrams, so that a wrong key is found.
void UdpServer::say_refused() {
  const auto refusal = trust_->channel().take_refusal();
  if (!refusal || !may_say(refusal->fault, monotonic_now())) return;
  const auto from = endpoint_of(refusal->from, socket_.local_endpoint().protocol());
  std::vector<EventField> fields{{"from", to_string(from)}, {"reason", describe(refusal->fault)}};
  if (refusal->key) fields.push_back({"key", to_text(*refusal->key)});
  say_({"no_session",
        fmt::format("no session for {}: {}{}", to_string(from), describe(refusal->fault),
                    refusal->key ? " (key " + to_text(*refusal->key) + ")" : ""),
        std::move(fields), EventLevel::warning, describe(refusal->fault)});
}

/// Reports a message that the rights of its sender's key forbid.
void UdpServer::say_no_right(const Letter& letter) {
  const std::string& why = letter.ruling.refused->message;
  const auto* const hello = std::get_if<Hello>(&letter.message.body);
  const std::string name = hello ? hello->station : trust_->channel().rights(letter.from)->name;
  std::vector<EventField> fields{{"station", name}, {"reason", why}};
  append(fields, sender_fields());
  say("refused", fmt::format("station \"{}\" refused from {} by its key's rights: {}", name, to_string(sender_->from), why),
      std::move(fields));
}

void UdpServer::drain(Micros most) {
  if (drain_until_ || ending_) return;
  drain_until_ = monotonic_now() + most;
  cores_.drain();
  await_drained();
}

void UdpServer::await_drained() {
  if (ending_) return;
  if (!cores_.has_hands() || monotonic_now() >= *drain_until_) return stop();
  end_timer_.expires_after(kDrainedEvery);
  end_timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) await_drained();
  });
}

/// Ends at once if called again while goodbyes are being sent.
void UdpServer::stop() {
  if (std::exchange(ending_, true)) return io_.stop();
  cores_.drain();
  cores_.shut_down(monotonic_now());
  say_goodbyes(kGoodbyes - 1);
}

/// Sends what waits, and repeats that `left` times.
void UdpServer::say_goodbyes(int left) {
  send_all(monotonic_now());
  if (left == 0) return io_.stop();
  end_timer_.expires_after(kGoodbyeEvery);
  end_timer_.async_wait([this, left](const asio::error_code& fault) {
    if (fault) return;
    cores_.repeat_goodbyes(monotonic_now());
    say_goodbyes(left - 1);
  });
}

void UdpServer::pulse() {
  const Micros now = monotonic_now();
  for (std::size_t k = 0; k < workers_.size(); ++k) workers_[k]->links.observe(cores_[k].stations());
  watch_(state(now));
  pulse_timer_.expires_after(kPulseEvery);
  pulse_timer_.async_wait([this](const asio::error_code& fault) {
    if (!fault) pulse();
  });
}

ServerState UdpServer::state(Micros now) const {
  ServerState state{now, draining() || ending_, {}, traffic_, {}, 0};
  for (std::size_t k = 0; k < workers_.size(); ++k) {
    const ServerCore& core = cores_[k];
    const RoomWorker& body = *workers_[k];
    RoomState room{cores_.name(k), core.ended(), core.options().rate_hz, core.pace(), body.share.share(), {}, 0, 0, 0,
                   core.counts(),  body.links};
    if (const auto since = core.computing_since()) room.computing_for = now - *since;
    count_roles(core.stations(), room);
    if (body.recording) room.recording = body.recording->state();
    if (body.recording) room.recorded_bytes = body.recording->written();
    if (!trust_) state.traffic.bytes_from_strangers += room.counts.bytes_from_strangers;
    if (!trust_) state.traffic.bytes_to_strangers += room.counts.bytes_to_strangers;
    state.rooms.push_back(std::move(room));
  }
  if (trust_) state.channel = trust_->channel().counts();
  if (trust_) state.sessions = trust_->channel().sessions();
  return state;
}

}  // namespace palpate
