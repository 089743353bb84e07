#include "server/dynamics/contact_sweeps.hpp"

namespace palpate {

void sweep_contacts(const std::vector<std::vector<Mat3>>& w, std::vector<SweptContact>& contacts, std::vector<ToolPort>& ports) {
  constexpr int kSweeps = 4;
  for (int sweep = 0; sweep < (contacts.size() > 1 ? kSweeps : 1); ++sweep)
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      SweptContact& contact = contacts[i];
      ToolPort& port = ports[contact.port];
      const Vec3 free = contact.end - w[i][i] * port.lambda;
      const ContactClosure closure = close_contact(free, w[i][i], contact.normal, contact.tool, port.parameters);
      const Vec3 step = closure.lambda - port.lambda;
      for (std::size_t j = 0; j < contacts.size(); ++j) contacts[j].end += w[j][i] * step;
      contact.change += step;
      contact.slip = closure.slip;
      port.lambda = closure.lambda;
    }
}

}  // namespace palpate
