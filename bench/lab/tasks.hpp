// A body and a motion shared by many cells of a sweep, with the reference force, computed once.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "bench/fidelity/reference.hpp"
#include "common/motion/motion.hpp"
#include "server/scene/scene.hpp"

namespace palpate {

struct SweepTask {
  Scene scene;
  Motion motion;
  ReferenceForce reference;
};

/// Tasks by the names that the cells use.
using SweepTasks = std::map<std::string, SweepTask>;

/// Names of the scenes in a folder, in alphabetical order; or `only`, if not empty. Throws InputError if there is no such scene.
std::vector<std::string> scenes_in(const std::filesystem::path& folder, const std::vector<std::string>& only);
/// Formats a place: "scene@k" is the k-th place (from 1) drawn on a scene of this name, "scene" its top (examination.hpp).
std::string at_place(const std::string& scene, int place);
/// Adds the examination of a scene of the folder, or fast strokes over it, at its top or at a place, under the name above, unless
/// it exists already.
void add_examination(SweepTasks& tasks, const std::filesystem::path& scenes, const std::string& name, bool fast_strokes);
/// Computes the references, `jobs` at a time.
void add_references(SweepTasks& tasks, unsigned jobs);

}  // namespace palpate
