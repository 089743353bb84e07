// Resumes a room's body from a recording, at its newest checkpoint.
#pragma once

#include <optional>
#include <string>

#include "common/record/reader.hpp"
#include "server/body/sutures.hpp"
#include "server/elements/body_state.hpp"
#include "server/scene/cuts.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct ResumePoint {
  RecordedCheckpoint checkpoint;
  Micros unix_time{};  ///< time of the checkpoint, microseconds since 1970
};

/// Returns the newest checkpoint; empty if the recording has none yet. Throws InputError, with `where`, if it belongs to another
/// room or body (other numbers of vertices or another surface). The material may have changed.
std::optional<ResumePoint> newest_checkpoint(const RecordingReader& recording, const std::string& where, const std::string& room,
                                             const Scene& scene);

/// The cuts of a body as a checkpoint has them.
std::vector<RecordedCut> recorded_cuts(const std::vector<CutStep>& steps);
std::vector<CutStep> steps_of(const std::vector<RecordedCut>& cuts);

/// The threads of a body as a checkpoint has them.
std::vector<RecordedThread> recorded_threads(const BodyState& state);
/// Returns null if they are none that threads of this body can be.
std::shared_ptr<const SutureState> threads_of(const std::vector<RecordedThread>& threads, const LumpedBody& body);

/// Concatenates the x, y, z of all points of a checkpoint, as BodyState stores them.
Vector in_a_row(const std::vector<Vec3>& points);

}  // namespace palpate
