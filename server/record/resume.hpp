// A room's body taken up again from a recording, at its newest checkpoint.
#pragma once

#include <optional>
#include <string>

#include "common/record/reader.hpp"
#include "server/body/body_state.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct ResumePoint {
  RecordedCheckpoint checkpoint;
  Micros unix_time{};  ///< of the checkpoint, microseconds since 1970
};

/// Nothing when the recording has none yet. InputError, with `where`, when it is not of this room and this body: other numbers of
/// vertices or another surface. What its material is may have changed.
std::optional<ResumePoint> newest_checkpoint(const RecordingReader& recording, const std::string& where, const std::string& room,
                                             const Scene& scene);

/// All of a checkpoint's x, y, z in a row, as BodyState has them.
Vector in_a_row(const std::vector<Vec3>& points);

}  // namespace palpate
