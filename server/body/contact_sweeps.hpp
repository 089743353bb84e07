// Tools that touch one body in one step, closed together: each pushes the points of the others.
//
//     p_j = e_j + sum_k W_jk (lambda_k - lambda_k before)
//
// e_j: where the point of contact j ends with the forces of before [m]; W_jk: what a newton of contact k moves it by [m/N].
// Contacts answer one after the other (contact_law.hpp), each seeing the newest forces of the others, in kSweeps sweeps; one
// alone needs one.
#pragma once

#include <vector>

#include "server/body/stepper.hpp"

namespace palpate {

struct SweptContact {
  std::size_t port = 0;
  Vec3 end = Vec3::Zero(), normal = Vec3::UnitZ(), tool = Vec3::Zero();
  Vec3 change = Vec3::Zero();  ///< out: of lambda
  Vec3 slip = Vec3::Zero();    ///< out: by the contact law
};

/// Sets lambda of the contacts' ports.
void sweep_contacts(const std::vector<std::vector<Mat3>>& w, std::vector<SweptContact>& contacts, std::vector<ToolPort>& ports);

}  // namespace palpate
