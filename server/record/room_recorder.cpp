#include "server/record/room_recorder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "server/record/resume.hpp"
#include "server/room/drawn_threads.hpp"

namespace palpate {
namespace {

/// Bytes of a patch on the wire, terms included.
std::uint32_t bytes_of(const StationFrame& frame) {
  std::array<std::byte, kMaxDatagramBytes> scratch;
  Message message;
  message.body = PatchMessage{*frame.patch};
  std::size_t bytes = encode(message, scratch);
  if (frame.terms.variables > 0)
    for (PatchTerms& piece : to_pieces(frame.terms, 0)) {
      message.body = std::move(piece);
      bytes += encode(message, scratch);
    }
  return static_cast<std::uint32_t>(bytes);
}

constexpr double kNodeStateBytes = 24;  ///< position and velocity
constexpr double kStressNumberBytes = sizeof(std::int16_t),
                 kStressBytes = sizeof(float);  ///< per number; per element in addition

}  // namespace

RoomRecorder::RoomRecorder(const RecordingHead& head) : writer_(head), surface_(mesh_of(head.surface), head.surface.nodes) {
  if (head.shapes_hz > 0) shape_every_ = from_seconds(1 / head.shapes_hz);
  expect_checkpoints_of(kNodeStateBytes * head.surface.body_nodes);
}

void RoomRecorder::expect_checkpoints_of(double bytes) {
  checkpoint_every_ = std::max(kCheckpointEvery, from_seconds(bytes / kCheckpointBytesPerS));
}

void RoomRecorder::begin_frame(FrameJob& job, Micros now) {
  began_ = now;
  wants_shape_ = shape_every_ > Micros{} && job.target >= next_shape_;
  if (wants_shape_) {
    job.shapes = true;
    next_shape_ = std::max(next_shape_ + shape_every_, job.target + shape_every_ / 2);
  }
  if (job.target >= next_checkpoint_) {
    job.state = true;
    next_checkpoint_ = job.target + checkpoint_every_;
  }
  jobs_.clear();
  for (const StationJob& station : job.stations) {
    RecordedPath path{station.id, {}};
    Micros& newest = newest_.try_emplace(station.id, Micros::min()).first->second;
    for (const ToolSample& sample : station.samples) {
      if (sample.t <= newest) continue;
      path.samples.push_back(sample);
      if (sample.orientation || sample.opening != 0)
        writer_.add(RecordedTurn{sample.t, station.id, ToolPose(sample).turn, sample.opening});
      newest = sample.t;
    }
    writer_.add(path);
    jobs_[station.id] = {station.id, station.scheme, station.order, station.shadow_of, station.horizon, {}, station.silence};
  }
  std::erase_if(newest_, [this](const auto& entry) { return !jobs_.contains(entry.first); });
}

RecordedTouch RoomRecorder::touch_of(const StationFrame& frame, Micros stamp) const {
  RecordedTouch touch;
  touch.t = stamp;
  touch.station = frame.id;
  touch.tool = frame.tool;
  touch.force = frame.force;
  touch.torque = frame.torque;
  touch.contact = frame.contact;
  touch.has_patch = frame.patch.has_value();
  if (const auto job = jobs_.find(frame.id); job != jobs_.end()) touch.horizon = job->second.horizon;
  if (!frame.patch) return touch;
  touch.scheme = frame.patch->scheme;
  touch.states = frame.patch->states();
  if (!frame.renewed_from) touch.bytes = bytes_of(frame);
  return touch;
}

/// Adds a checkpoint, unless the body has not moved since the last.
void RoomRecorder::add_checkpoint(const FrameResult& result, const ServerCore& core, std::vector<RecordedHold> holds) {
  if (!result.state || result.failed) return;
  const BodyState& state = *result.state;
  if (checkpoint_.size() == state.x.size() && checkpoint_ == state.x && checkpoint_history_ == state.history &&
      checkpoint_threads_ == state.sutures)
    return;
  checkpoint_ = state.x;
  checkpoint_history_ = state.history;
  checkpoint_threads_ = state.sutures;
  for (const StationReport& station : core.stations())
    for (const StationFrame& frame : result.stations)
      if (frame.id == station.id && frame.contact && station.shadow_of.empty())
        holds.push_back({station.name, frame.tool, frame.turn, frame.opening, frame.needle, station.tool.name});
  RecordedCheckpoint checkpoint{result.stamp, {}, {}, std::move(holds)};
  const auto nodes = static_cast<std::uint32_t>(state.x.size() / 3);
  for (std::uint32_t node = 0; node < nodes; ++node) {
    checkpoint.positions.emplace_back(at_node(state.x, node));
    checkpoint.velocities.emplace_back(at_node(state.v, node));
  }
  checkpoint.threads = recorded_threads(state);
  if (result.cuts) checkpoint.cuts = recorded_cuts(*result.cuts);
  if (state.history) {
    checkpoint.relaxed = side_by_side(*state.history);
    expect_checkpoints_of(kNodeStateBytes * nodes + kStressNumberBytes * static_cast<double>(checkpoint.relaxed.size()) +
                          kStressBytes * static_cast<double>(checkpoint.relaxed.cols()));
  }
  writer_.add(checkpoint);
}

void RoomRecorder::end_frame(const FrameResult& result, const ServerCore& core, Micros now,
                             const std::vector<RecordedHold>& absent) {
  const std::uint64_t skipped = core.counts().frames_busy;
  writer_.add(RecordedFrame{result.stamp, now - began_, now - result.stamp,
                            static_cast<std::uint32_t>(skipped - std::exchange(skipped_before_, skipped)), result.steps,
                            result.cut_steps, result.newton_iterations, result.failed});
  for (const StationFrame& frame : result.stations) {
    writer_.add(touch_of(frame, result.stamp));
  }
  add_checkpoint(result, core, absent);
  if (result.surface && result.surface != surface_taken_) {
    surface_taken_ = result.surface;
    surface_.take(*result.surface);
    writer_.add_mesh(result.stamp, surface_.mesh(), surface_.vertex_of());
  }
  if (wants_shape_ && !result.positions.empty()) writer_.add_shape(result.stamp, result.positions);
}

/// Adds the links of the stations, and the hold of each that guides another.
void RoomRecorder::add_links(const std::vector<StationReport>& stations, Micros now) {
  for (const StationReport& s : stations) {
    writer_.add(
        RecordedLink{now, s.id, s.rtt.mean, s.rtt.min, s.rtt.jitter, s.patch_age, s.offset, s.link.received, s.link.lost});
    const auto guided = s.guided != 0 ? std::ranges::find(stations, s.guided, &StationReport::id) : stations.end();
    if (guided != stations.end())
      writer_.add(RecordedGuidance{now, s.id, s.guided, s.guidance_force_n, guided->guidance_force_n});
  }
}

void RoomRecorder::tick(const ServerCore& core, Micros now) {
  const bool slow = core.pace().rate_hz < kSlowBelow * core.options().rate_hz;
  if (slow != std::exchange(slow_, slow)) {
    RecordedEvent event;
    event.t = now;
    event.kind = slow ? RecordedEventKind::overrun : RecordedEventKind::kept_up;
    if (slow)
      event.text = fmt::format("{:.1f} of {:g} frames a second, {:.0f} ms behind", core.pace().rate_hz, core.options().rate_hz,
                               1e3 * seconds(core.pace().behind));
    writer_.add(event);
  }
  if (now >= next_links_) {
    next_links_ = now + kLinksEvery;
    add_links(core.stations(), now);
  }
  writer_.tick(now);
}

RecordedSurface recorded_surface(const Scene& scene) {
  const LumpedBody& body = scene.body;
  const DrawnThreads threads(body);
  std::vector<Vec3> rest = vertices_at_rest(body);
  threads.append(rest);
  std::vector<Triangle> triangles = body.triangles;
  for (const Triangle& t : threads.triangles(static_cast<std::uint32_t>(body.vertices()))) triangles.push_back(t);
  RecordedSurface surface = recorded_surface(rest, triangles, facts_of(scene, Vec3::Zero()).mesh_hash);
  surface.body_nodes = static_cast<std::uint32_t>(body.nodes.size());
  for (std::size_t k = 0; k < surface.nodes.size(); ++k) {
    const bool thread = surface.nodes[k] >= body.vertices();
    surface.marks[k] = thread ? kThreadMark : mark_of(drawn_vertex(body, surface.nodes[k], surface.rest[k]));
  }
  return surface;
}

}  // namespace palpate
