// Threads of a scene through its body.
#pragma once

#include <optional>
#include <span>

#include "server/scene/settings.hpp"

namespace palpate {

class SceneText;

/// Adds the threads to a finished body, cut or not. With a layer of tissue they cut through it. Throws InputError for a bite that
/// is in no cell.
void add_sutures(LumpedBody& body, const std::vector<SutureSettings>& sutures, const SceneText& text);

/// Moves a bite through the tissue of a body at x (3 N) by `way` [m], by a quarter of its cell at most: its place at rest by
/// (dx/dX)^-1 of that. Returns none where it would leave the body or come through the wall of a cut: it is torn out.
std::optional<SutureBite> moved(const LumpedBody& body, std::span<const double> x, const SutureBite& bite, const Vec3& way);
/// Returns the bite at the place x in the body at rest: the point of the cell that it lies in, of a cell that a cut parted the
/// copy on its side: that whose corner nearest to it, uncut, is its own. None if no cell has it.
std::optional<SutureBite> bite_at(const LumpedBody& body, const Vec3& x);
/// Returns false for one where the body is fixed.
bool can_move(const LumpedBody& body, const SutureBite& bite);
/// Returns the bite at the place x in a cell of the body at rest; none if it is not there.
std::optional<SutureBite> bite_at(const LumpedBody& body, std::uint32_t cell, const Vec3& x);

}  // namespace palpate
