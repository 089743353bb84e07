// A body and a motion that many cells of a sweep share, with the force that the hand should have felt: computed once.
#pragma once

#include <filesystem>
#include <map>
#include <string>

#include "bench/fidelity/reference.hpp"
#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct SweepTask {
  Scene scene;
  Motion motion;
  ReferenceForce reference;
};

/// By what their cells call them.
using SweepTasks = std::map<std::string, SweepTask>;

/// "scene@k" is the k-th place (from 1) that was drawn on a scene of this name, "scene" its top (examination.hpp).
std::string at_place(const std::string& scene, int place);
/// Adds the examination of a scene of the folder, at its top or at a place, under the name above, where it is not there yet.
void add_examination(SweepTasks& tasks, const std::filesystem::path& scenes, const std::string& name);
/// Fills in the references, `jobs` at a time.
void add_references(SweepTasks& tasks, unsigned jobs);

}  // namespace palpate
