// Threads of a scene through its body.
#pragma once

#include "server/scene/settings.hpp"

namespace palpate {

class SceneText;

/// Adds the threads to a finished body, cut or not. A bite is the point of the cell that it lies in, of a cell that a cut parted
/// the copy on its side: that whose corner nearest to it, uncut, is its own. Throws InputError for a bite that is in no cell.
void add_sutures(LumpedBody& body, const std::vector<SutureSettings>& sutures, const SceneText& text);

}  // namespace palpate
