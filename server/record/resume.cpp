#include "server/record/resume.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "common/base/error.hpp"
#include "server/core/room_info.hpp"
#include "server/room/drawn_threads.hpp"
#include "server/scene/sutures.hpp"

namespace palpate {
namespace {

void check(const RecordingHead& head, const std::string& where, const std::string& room, const Scene& scene) {
  if (head.kind != RecordingKind::room)
    throw InputError(where, "is a station's recording", "one of a room, made by palpate-server");
  if (head.name != room)
    throw InputError(where, fmt::format("is of room \"{}\"", head.name), fmt::format("of room \"{}\"", room));
  const std::size_t vertices = scene.body.vertices() + DrawnThreads(scene.body).vertices();
  if (head.surface.body_vertices != vertices)
    throw InputError(where, fmt::format("is of a body of {} vertices", head.surface.body_vertices),
                     fmt::format("the {} of scene \"{}\"; move the file away to begin at rest", vertices, scene.name));
  if (head.surface.mesh_hash != facts_of(scene, Vec3::Zero()).mesh_hash)
    throw InputError(where, "is of a body with another surface",
                     fmt::format("that of scene \"{}\"; move the file away to begin at rest", scene.name));
}

/// Checks that the checkpoint is of the body of the scene, after its cuts.
void check(const RecordedCheckpoint& checkpoint, const std::string& where, const Scene& scene) {
  std::size_t nodes = scene.body.nodes.size();
  const std::vector<CutStep> steps = steps_of(checkpoint.cuts);
  if (!steps.empty()) {
    if (!scene.is_cut_live())
      throw InputError(where, "its newest checkpoint is of a body that a blade has cut, or that has torn",
                       "a scene with \"tool.blade\" or \"body.tears\"");
    CutBody body = begun_cuts(scene);
    std::size_t known = body.cuts().size();
    for (const CutStep& step : steps) {
      if (step.cut > known) throw InputError(where, "its newest checkpoint lacks a cut", "all cuts in order");
      known = std::max(known, step.cut + 1);
    }
    body.repeat(steps);
    nodes = body.body().nodes.size();
  }
  if (!checkpoint.threads.empty() && !threads_of(checkpoint.threads, scene.body))
    throw InputError(where, "its newest checkpoint has threads that are none of this scene's",
                     "those of scene \"" + scene.name + "\"; move the file away to begin at rest");
  if (checkpoint.positions.size() != nodes)
    throw InputError(where, fmt::format("its newest checkpoint has {} nodes", checkpoint.positions.size()),
                     fmt::format("the {} of its scene{}", nodes, steps.empty() ? "" : " with its cuts"));
}

}  // namespace

std::optional<ResumePoint> newest_checkpoint(const RecordingReader& recording, const std::string& where, const std::string& room,
                                             const Scene& scene) {
  const RecordingHead& head = recording.head();
  check(head, where, room, scene);
  for (std::size_t k = recording.blocks().size(); k-- > 0;) {
    const auto block = recording.read(k);
    if (!block || block->checkpoints.empty()) continue;
    const RecordedCheckpoint& newest = block->checkpoints.back();
    check(newest, where, scene);
    return ResumePoint{newest, head.unix_time + (newest.t - head.clock_time)};
  }
  return std::nullopt;
}

std::vector<RecordedCut> recorded_cuts(const std::vector<CutStep>& steps) {
  std::vector<RecordedCut> cuts;
  for (const CutStep& step : steps)
    cuts.push_back({static_cast<std::uint32_t>(step.cut), step.parts, step.to.path_m, step.to.direction, step.to.depth_m});
  return cuts;
}

std::vector<CutStep> steps_of(const std::vector<RecordedCut>& cuts) {
  std::vector<CutStep> steps;
  for (const RecordedCut& cut : cuts) {
    CutStep& step = steps.emplace_back();
    step.cut = cut.number;
    step.parts = cut.parts;
    step.to.path_m = cut.path;
    step.to.direction = cut.direction;
    step.to.depth_m = cut.depth_m;
  }
  return steps;
}

std::vector<RecordedThread> recorded_threads(const BodyState& state) {
  std::vector<RecordedThread> threads;
  if (!state.sutures) return threads;
  for (const SutureState::Thread& thread : state.sutures->threads) {
    RecordedThread& recorded = threads.emplace_back();
    recorded.suture = thread.suture;
    recorded.first_tied = thread.law.first_tied;
    recorded.last_tied = thread.law.last_tied;
    recorded.has_end = thread.has_end;
    recorded.length_m.assign(thread.length_m.begin(), thread.length_m.begin() + thread.law.bites + 1);
    for (const SutureBite& bite : *thread.bites) recorded.bites.push_back({bite.number, bite.cell, bite.rest});
  }
  return threads;
}

std::shared_ptr<const SutureState> threads_of(const std::vector<RecordedThread>& threads, const LumpedBody& body) {
  static_assert(RecordedThread::kMostBites == kMaxBites);
  if (threads.size() < body.sutures.size()) return nullptr;
  SutureState state;
  for (const RecordedThread& recorded : threads) {
    if (recorded.suture >= body.sutures.size()) return nullptr;
    SutureState::Thread& thread = state.threads.emplace_back();
    thread.suture = recorded.suture;
    thread.has_end = recorded.has_end;
    thread.law = body.sutures[recorded.suture].law;
    thread.law.bites = static_cast<int>(recorded.bites.size());
    thread.law.first_tied = recorded.first_tied;
    thread.law.last_tied = recorded.last_tied;
    std::ranges::copy(recorded.length_m, thread.length_m.begin());
    std::vector<SutureBite> bites;
    for (const RecordedThread::Bite& bite : recorded.bites) {
      std::optional<SutureBite> at = bite_at(body, bite.cell, bite.at);
      if (!at || bite.number >= body.sutures[recorded.suture].most_bites()) return nullptr;
      at->number = bite.number;
      bites.push_back(std::move(*at));
    }
    thread.bites = std::make_shared<const std::vector<SutureBite>>(std::move(bites));
  }
  return std::make_shared<const SutureState>(std::move(state));
}

Vector in_a_row(const std::vector<Vec3>& points) {
  Vector row(3 * static_cast<Eigen::Index>(points.size()));
  for (std::uint32_t k = 0; k < points.size(); ++k) at_node(row, k) = points[k];
  return row;
}

}  // namespace palpate
