#include "common/assessment/session.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "common/base/sort_stably.hpp"

namespace palpate {
namespace {

SessionHand& hand_of(Session& session, const std::string& name) {
  const auto known =
      std::find_if(session.hands.begin(), session.hands.end(), [&](const auto& hand) { return hand.name == name; });
  if (known != session.hands.end()) return *known;
  session.hands.push_back({name, {}, {}, {}});
  return session.hands.back();
}

/// Appends an item unless it is not newer than the last.
template <class Item>
void append(std::vector<Item>& items, const Item& item) {
  if (items.empty() || item.t_s > items.back().t_s) items.push_back(item);
}

/// Adds a report of a hold, which continues the last one of the same two unless that ended more than kHeldMostS before.
void add_guidance(Session& session, const std::string& guide, const std::string& guided, double t_s,
                  const RecordedGuidance& report) {
  constexpr double kEveryS = 0.25, kHeldMostS = 0.6;  // interval of reports
  const auto last = std::find_if(session.guidances.rbegin(), session.guidances.rend(),
                                 [&](const SessionGuidance& g) { return g.guide == guide && g.guided == guided; });
  const bool goes_on = last != session.guidances.rend() && t_s - last->to_s <= kHeldMostS;
  SessionGuidance& hold = goes_on ? *last : session.guidances.emplace_back(SessionGuidance{guide, guided, t_s - kEveryS, t_s});
  ++hold.reports;
  hold.to_s = t_s;
  hold.guide_force_n += (report.guide_force_n - hold.guide_force_n) / hold.reports;
  hold.guided_force_n += (report.guided_force_n - hold.guided_force_n) / hold.reports;
}

void add_block(Session& session, const RecordingReader& recording, const RecordedBlock& block) {
  const auto since_begin = [&](Micros t) { return seconds(t - recording.begin()); };
  for (const RecordedPath& path : block.paths) {
    SessionHand& hand = hand_of(session, recording.name_of(path.station));
    for (const ToolSample& sample : path.samples) append(hand.path, {since_begin(sample.t), sample.position});
  }
  for (const RecordedTouch& touch : block.touches)
    append(hand_of(session, recording.name_of(touch.station)).forces,
           {since_begin(touch.t), touch.force, touch.contact, touch.torque});
  for (const RecordedEvent& event : block.events)
    if (event.kind == RecordedEventKind::reset) session.resets_s.push_back(since_begin(event.t));
  for (const RecordedNote& note : block.notes)
    session.notes.push_back({since_begin(note.about), since_begin(note.t), note.author, note.text});
  for (const RecordedGuidance& hold : block.guidances)
    add_guidance(session, recording.name_of(hold.guide), recording.name_of(hold.guided), since_begin(hold.t), hold);
  for (const RecordedTick& tick : block.ticks) {
    if (tick.broken) continue;
    SessionHand& hand = hand_of(session, recording.head().name);
    append(hand.path, {since_begin(tick.t), tick.position});
    append(hand.forces, {since_begin(tick.t), tick.force, tick.contact, tick.torque});
  }
  for (const RecordedTurn& turn : block.turns) {
    const bool station = recording.head().kind == RecordingKind::station;
    const std::string name = station ? recording.head().name : recording.name_of(turn.station);
    const auto moved = [&](const SessionHand& hand) { return hand.name == name; };
    if (std::any_of(session.hands.begin(), session.hands.end(), moved))
      append(hand_of(session, name).turns, {since_begin(turn.t), turn.orientation, turn.opening});
  }
}

/// Returns orientation and opening at a time, evenly between those before and after.
SessionTurn turn_at(const std::vector<SessionTurn>& turns, double t_s) {
  const auto after =
      std::upper_bound(turns.begin(), turns.end(), t_s, [](double t, const SessionTurn& turn) { return t < turn.t_s; });
  if (after == turns.begin()) return turns.front();
  if (after == turns.end()) return turns.back();
  const SessionTurn& before = *std::prev(after);
  const double share = (t_s - before.t_s) / (after->t_s - before.t_s);
  return {t_s, before.turn.slerp(share, after->turn), std::lerp(before.opening, after->opening, share)};
}

/// First and last sample of any hand [s].
std::pair<double, double> extent_s(const Session& session) {
  double begin_s = 1e300, end_s = -1e300;
  for (const SessionHand& hand : session.hands) {
    begin_s = std::min(begin_s, hand.path.front().t_s);
    end_s = std::max(end_s, hand.path.back().t_s);
  }
  return {begin_s, end_s};
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
  sort_stably(session.notes.begin(), session.notes.end(), [](const auto& a, const auto& b) { return a.t_s < b.t_s; });
  std::erase_if(session.hands, [](const SessionHand& hand) { return hand.path.empty(); });  // shadows have no samples
  const bool own = recording.head().kind == RecordingKind::station;
  for (const RecordedStation& station : recording.stations())
    for (SessionHand& hand : session.hands)
      if (own || hand.name == station.name) hand.tool = station.tool;
  return session;
}

Session cut(Session session, double from_s, double to_s) {
  const auto outside = [&](const auto& item) { return item.t_s < from_s || item.t_s > to_s; };
  for (SessionHand& hand : session.hands) {
    std::erase_if(hand.path, outside);
    std::erase_if(hand.forces, outside);
    std::erase_if(hand.turns, outside);
  }
  std::erase_if(session.hands, [](const SessionHand& hand) { return hand.path.empty(); });
  std::erase_if(session.guidances, [&](const SessionGuidance& hold) { return hold.to_s < from_s || hold.from_s > to_s; });
  std::erase_if(session.resets_s, [&](double t_s) { return t_s < from_s || t_s > to_s; });
  std::erase_if(session.notes, [&](const SessionNote& note) { return note.t_s < from_s || note.t_s > to_s; });
  return session;
}

std::vector<std::uint8_t> presence_of(const Session& session, std::size_t which) {
  const auto [begin_s, end_s] = extent_s(session);
  const double from_s = begin_s;
  const auto tick = [&](double t_s) { return static_cast<std::size_t>(std::lround((t_s - from_s) * 1e3)); };
  std::vector<std::uint8_t> there(tick(end_s) + 1, 0);
  const std::vector<MotionPoint>& path = session.hands[which].path;
  for (std::size_t i = 0; i + 1 < path.size(); ++i)
    if (path[i + 1].t_s - path[i].t_s <= kGoneS)
      std::fill(there.begin() + static_cast<std::ptrdiff_t>(tick(path[i].t_s)),
                there.begin() + static_cast<std::ptrdiff_t>(tick(path[i + 1].t_s)) + 1, std::uint8_t{1});
  return there;
}

std::vector<Motion> motions_of(const Session& session, std::size_t which, const std::string& name) {
  const auto [begin_s, end_s] = extent_s(session);
  std::vector<Motion> motions;
  for (std::size_t k = 0; k < session.hands.size(); ++k) {
    const SessionHand& hand = session.hands[(which + k) % session.hands.size()];
    std::vector<MotionPoint> points = hand.path;
    for (MotionPoint& point : points) point.t_s -= begin_s;
    append(points, {end_s - begin_s, points.back().position});
    MotionHolds holds;
    const bool opens = std::ranges::any_of(hand.turns, [](const SessionTurn& turn) { return turn.opening != 0; });
    for (const MotionPoint& point : points) {
      if (hand.turns.empty()) break;
      const SessionTurn held = turn_at(hand.turns, begin_s + point.t_s);
      holds.orientations.emplace_back(held.turn);
      if (opens) holds.openings.push_back(held.opening);
    }
    motions.emplace_back(std::move(points), std::move(holds), name + ", station \"" + hand.name + "\"");
  }
  return motions;
}

std::vector<Micros> resets_of(const Session& session) {
  std::vector<Micros> resets;
  for (const double t_s : session.resets_s) resets.push_back(std::max(Micros{}, from_seconds(t_s - extent_s(session).first)));
  return resets;
}

}  // namespace palpate
