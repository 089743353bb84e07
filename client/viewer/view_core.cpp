#include "client/viewer/view_core.hpp"

#include <algorithm>
#include <utility>

namespace palpate {
namespace {

constexpr Micros kSecond{1'000'000};
constexpr char kSessionEnded[] = "the connection to the server ended before it was recorded";

Hello hello_of(std::string station, std::string room, bool alike) {
  Hello hello;
  hello.station = std::move(station);
  hello.room = std::move(room);
  hello.role = Role::viewer;
  hello.alike = alike;
  return hello;
}

}  // namespace

ViewCore::ViewCore(std::string station, Micros now, std::string room, bool alike)
    : ClientSession(hello_of(std::move(station), std::move(room), alike), now) {}

void ViewCore::tick(Micros now) {
  if (advance(now) == Event::ended)
    while (!notes_.empty()) end_note(kSessionEnded);
  if (!joined()) return;
  if (!mesh_.current() && now >= next_mesh_) ask_for_mesh(now);
  if (now >= next_state_) {
    state_due_ = true;
    next_state_ = Micros::max();
  }
  if (now >= next_beat_) {
    beat_due_ = true;
    next_beat_ = now + kBeatEvery;
  }
}

Micros ViewCore::deadline() const {
  const Micros at = ClientSession::deadline();
  if (!joined()) return at;
  Micros alive_at = std::min({at, next_beat_, next_state_});
  if (!notes_.empty()) alive_at = std::min(alive_at, next_note_);
  return mesh_.current() ? alive_at : std::min(alive_at, next_mesh_);
}

void ViewCore::show_channel(ShapeChannel channel) {
  if (channel == channel_) return;
  channel_ = channel;
  shapes_.show(channel);
  state_due_ = true;
}

void ViewCore::take(std::span<const std::byte> bytes, Micros now) {
  Message message;
  const Event event = receive(bytes, message, now);
  if (event == Event::joined || event == Event::resumed) return begin(event == Event::joined, now);
  if (event == Event::ended)
    while (!notes_.empty()) end_note(kSessionEnded);
  const auto* const refusal = event == Event::denied ? std::get_if<Refuse>(&message.body) : nullptr;
  if (refusal && !notes_.empty() && note_since_ != Micros{} && message.clock.echo >= note_since_) end_note(refusal->message);
  if (event != Event::message) return;
  if (const auto* rooms = std::get_if<RoomList>(&message.body)) rooms_ = *rooms;
  if (const auto* piece = std::get_if<MeshPiece>(&message.body)) take_mesh(*piece, now);
  if (const auto* room = std::get_if<RoomView>(&message.body)) room_ = *room;
  if (const auto* task = std::get_if<Task>(&message.body)) task_.take(*task);
  if (const auto* beat = std::get_if<Beat>(&message.body)) {
    task_.take_resets(beat->resets);
    hear_notes(beat->notes, now);
  }
  const auto* const piece = std::get_if<ShapePiece>(&message.body);
  // Without the mesh a shape is meaningless: it counts as lost, and its contents are sent again.
  if (piece && (!mesh_.complete() || !shapes_.fits(*piece))) return;
  note(message.seq, now);
  if (piece) take_shape(*piece, now);
  const auto* const tools = std::get_if<Tools>(&message.body);
  if (tools && mesh_.want(tools->mesh_pieces) && mesh_.complete()) next_mesh_ = now;
  if (!tools || !mesh_.complete()) return;
  take_shape(*tools, now);
  task_.take(*tools);
  playback_.add(*tools, now);
}

bool ViewCore::write_note(Note note) {
  if (!joined() || notes_.size() >= kNotesMost) return false;
  notes_.push_back(std::move(note));
  return true;
}

void ViewCore::hear_notes(std::uint32_t recorded, Micros now) {
  if (recorded <= noted_) return;
  noted_ = recorded;
  next_note_ = now;
  if (!notes_.empty() && note_since_ != Micros{}) end_note("");
}

/// Ends the first note.
void ViewCore::end_note(const std::string& refusal) {
  note_outcomes_.push_back({std::move(notes_.front()), refusal});
  notes_.pop_front();
  note_since_ = next_note_ = Micros{};
}

/// Notes that a datagram arrived, to report it to the server.
void ViewCore::note(std::uint32_t seq, Micros now) {
  const auto ahead = static_cast<std::int32_t>(seq - state_.newest);
  if (!heard_any_ || ahead > 0) {
    state_.have = heard_any_ && ahead < 64 ? state_.have << ahead | 1 : 1;
    state_.newest = seq;
    heard_any_ = true;
  } else if (ahead > -64) {
    state_.have |= std::uint64_t{1} << -ahead;
  }
  if (next_state_ == Micros::max()) next_state_ = now + kStateEvery;
}

void ViewCore::take_mesh(const MeshPiece& piece, Micros now) {
  const bool had = mesh_.complete();
  const std::uint32_t changes = mesh_.changes();
  mesh_.take(piece);
  if (asked_ > 0 && --asked_ == 0) next_mesh_ = now;
  if (had && mesh_.complete() && mesh_.changes() != changes) take_mesh_change();
  if (had || !mesh_.complete()) return;
  shapes_.rest(mesh_.mesh().vertices);
  rest_.clear();
  for (const MeshVertex& vertex : mesh_.mesh().vertices) rest_.push_back(vertex.rest.cast<float>());
}

/// Takes up a mesh that was changed: a new vertex moves like the nearest old one until its own position arrives.
void ViewCore::take_mesh_change() {
  const std::vector<MeshVertex>& all = mesh_.mesh().vertices;
  const std::size_t before = rest_.size();
  std::vector<std::uint32_t> like;
  for (std::size_t i = before; i < all.size(); ++i) {
    rest_.push_back(all[i].rest.cast<float>());
    const auto nearest = std::min_element(rest_.begin(), rest_.begin() + static_cast<std::ptrdiff_t>(before),
                                          [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b) {
                                            return (a - rest_[i]).squaredNorm() < (b - rest_[i]).squaredNorm();
                                          });
    like.push_back(static_cast<std::uint32_t>(nearest - rest_.begin()));
  }
  shapes_.extend({all.begin() + static_cast<std::ptrdiff_t>(before), all.end()}, like);
  playback_.extend(rest_, like);
  ++mesh_version_;
}

/// `anew`: the session is new, and the server knows nothing of what arrived in the one before.
void ViewCore::begin(bool anew, Micros now) {
  const Welcome& scene = welcome();
  const bool other_mesh =
      counts().joins == 1 || !mesh_.expects(scene.vertices, scene.triangles, scene.mesh_hash) || (anew && mesh_.changes() > 0);
  if (other_mesh) {
    mesh_.expect(scene.vertices, scene.triangles, scene.mesh_hash);
    rest_.clear();
    playback_.clear();
    ++mesh_version_;
  }
  if (other_mesh || anew) shapes_.rest(mesh_.complete() ? mesh_.mesh().vertices : std::vector<MeshVertex>{});
  if (anew) {
    heard_any_ = false;
    task_.clear();
    noted_ = 0;
  }
  state_due_ = false;
  next_state_ = Micros::max();
  asking_.clear();
  asked_ = 0;
  next_beat_ = next_mesh_ = now;
}

template <class Part>
void ViewCore::take_shape(const Part& part, Micros now) {
  finished_.clear();
  shapes_.take(part, finished_);
  for (Shape& shape : finished_) {
    playback_.add(std::move(shape), now);
    shapes_came_.push_back(now);
  }
  while (!shapes_came_.empty() && now - shapes_came_.front() >= kSecond) shapes_came_.pop_front();
}

int ViewCore::shapes_lately(Micros now) const {
  return static_cast<int>(std::count_if(shapes_came_.begin(), shapes_came_.end(), [now](Micros t) { return now - t < kSecond; }));
}

void ViewCore::ask_for_mesh(Micros now) {
  const auto pieces = mesh_.missing(kMeshWindow);
  asking_.assign(pieces.begin(), pieces.end());
  asked_ = pieces.size();
  next_mesh_ = now + kMeshRetry;
}

Micros ViewCore::lateness(Micros now) const {
  return clock().locked() ? now - clock().from_peer(playback_.moment(now)) : playback_.delay();
}

std::size_t ViewCore::emit(std::span<std::byte> out, Micros now) {
  if (const auto size = emit_own(out, now)) return size;
  if (!joined()) return 0;
  if (std::exchange(beat_due_, false)) return say(Beat{}, out, now);
  if (std::exchange(state_due_, false)) return say_state(out, now);
  if (!notes_.empty() && now >= next_note_) {
    next_note_ = now + kNoteEvery;
    if (note_since_ == Micros{}) note_since_ = now;
    notes_.front().number = noted_ + 1;
    return say(notes_.front(), out, now);
  }
  if (asking_.empty()) return 0;
  const MeshRequest request{asking_.front()};
  asking_.pop_front();
  return say(request, out, now);
}

std::size_t ViewCore::say_state(std::span<std::byte> out, Micros now) {
  state_.channels = channel_ == ShapeChannel::position ? std::uint8_t{0} : bit_of(channel_);
  state_.kbit_s = kbit_s_;
  return say(state_, out, now);
}

}  // namespace palpate
