#include "bench/measure/session.hpp"

#include <algorithm>

namespace palpate {
namespace {

SessionHand& hand_of(Session& session, const std::string& name) {
  const auto known =
      std::find_if(session.hands.begin(), session.hands.end(), [&](const auto& hand) { return hand.name == name; });
  if (known != session.hands.end()) return *known;
  session.hands.push_back({name, {}, {}});
  return session.hands.back();
}

/// Appends unless it is not newer than what is there.
template <class Item>
void append(std::vector<Item>& items, const Item& item) {
  if (items.empty() || item.t_s > items.back().t_s) items.push_back(item);
}

void add_block(Session& session, const RecordingReader& recording, const RecordedBlock& block) {
  const auto since_begin = [&](Micros t) { return seconds(t - recording.begin()); };
  for (const RecordedPath& path : block.paths) {
    SessionHand& hand = hand_of(session, recording.name_of(path.station));
    for (const ToolSample& sample : path.samples) append(hand.path, {since_begin(sample.t), sample.position});
  }
  for (const RecordedTouch& touch : block.touches)
    append(hand_of(session, recording.name_of(touch.station)).forces, {since_begin(touch.t), touch.force, touch.contact});
  for (const RecordedEvent& event : block.events)
    if (event.kind == RecordedEventKind::reset) session.resets_s.push_back(since_begin(event.t));
  for (const RecordedTick& tick : block.ticks) {
    if (tick.broken) continue;
    SessionHand& hand = hand_of(session, recording.head().name);
    append(hand.path, {since_begin(tick.t), tick.position});
    append(hand.forces, {since_begin(tick.t), tick.force, tick.contact});
  }
}

/// When the first hand was seen first.
double begin_of(const Session& session) {
  double begin_s = 1e300;
  for (const SessionHand& hand : session.hands) begin_s = std::min(begin_s, hand.path.front().t_s);
  return begin_s;
}

}  // namespace

Session read_session(const RecordingReader& recording) {
  Session session;
  for (std::size_t k = 0; k < recording.blocks().size(); ++k) {
    const auto block = recording.read(k);
    if (block)
      add_block(session, recording, *block);
    else
      ++session.blocks_lost;
  }
  std::erase_if(session.hands, [](const SessionHand& hand) { return hand.path.empty(); });  // shadows feel with another's hand
  return session;
}

std::vector<Motion> motions_of(const Session& session, std::size_t which, const std::string& name) {
  const double begin_s = begin_of(session);
  double end_s = -1e300;
  for (const SessionHand& hand : session.hands) end_s = std::max(end_s, hand.path.back().t_s);
  std::vector<Motion> motions;
  for (std::size_t k = 0; k < session.hands.size(); ++k) {
    const SessionHand& hand = session.hands[(which + k) % session.hands.size()];
    std::vector<MotionPoint> points = hand.path;
    for (MotionPoint& point : points) point.t_s -= begin_s;
    append(points, {end_s - begin_s, points.back().position});
    motions.emplace_back(std::move(points), name + ", station \"" + hand.name + "\"");
  }
  return motions;
}

std::vector<Micros> resets_of(const Session& session) {
  std::vector<Micros> resets;
  for (const double t_s : session.resets_s) resets.push_back(std::max(Micros{}, from_seconds(t_s - begin_of(session))));
  return resets;
}

}  // namespace palpate
