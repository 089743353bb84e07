#include "server/dynamics/contact_sweeps.hpp"

namespace palpate {
namespace {

ContactClosure close(const SweptContact& contact, const Vec3& free, const Mat3& compliance, const ContactParameters& parameters) {
  if (!contact.path) return close_contact(free, compliance, contact.normal, contact.tool, parameters);
  const PathClosure closure = close_on_path(contact.tool - free, compliance, contact.normal, *contact.path);
  return {true, closure.slip_m != 0, closure.lambda, closure.slip_m * contact.normal};
}

}  // namespace

void sweep_contacts(const std::vector<std::vector<Mat3>>& w, std::vector<SweptContact>& contacts, std::vector<ToolPort>& ports) {
  constexpr int kSweeps = 4;
  for (int sweep = 0; sweep < (contacts.size() > 1 ? kSweeps : 1); ++sweep)
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      SweptContact& contact = contacts[i];
      ToolPort& port = ports[contact.port];
      const Vec3 free = contact.end - w[i][i] * port.lambda;
      const ContactClosure closure = close(contact, free, w[i][i], port.parameters);
      const Vec3 step = closure.lambda - port.lambda;
      for (std::size_t j = 0; j < contacts.size(); ++j) contacts[j].end += w[j][i] * step;
      contact.change += step;
      contact.slip = closure.slip;
      port.lambda = closure.lambda;
    }
}

}  // namespace palpate
