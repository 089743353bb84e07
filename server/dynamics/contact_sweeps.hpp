// Tools that touch one body in one step, solved together: each moves the contact points of the others.
//
//     p_j = e_j + sum_k W_jk (lambda_k - lambda_k before)
//
// e_j: end position of contact point j under the previous forces [m]; W_jk: its displacement per unit force at contact k [m/N].
// The contacts are solved one after the other (contact_law.hpp, needle.hpp), each with the newest forces of the others, in
// kSweeps sweeps; a single contact needs one.
#pragma once

#include <optional>
#include <vector>

#include "server/dynamics/stepper.hpp"

namespace palpate {

struct SweptContact {
  std::size_t port = 0;
  Vec3 end = Vec3::Zero(), normal = Vec3::UnitZ(), tool = Vec3::Zero();
  std::optional<PathContact> path = {};  ///< of a needle in the body; `normal` is then the direction along its path
  Vec3 change = Vec3::Zero();            ///< output: change of lambda [N]
  Vec3 slip = Vec3::Zero();              ///< output: slip by the contact law [m]; on a path along its direction
};

/// Sets lambda of the contacts' ports.
void sweep_contacts(const std::vector<std::vector<Mat3>>& w, std::vector<SweptContact>& contacts, std::vector<ToolPort>& ports);

}  // namespace palpate
