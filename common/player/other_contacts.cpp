#include "common/player/other_contacts.hpp"

#include <algorithm>
#include <span>

namespace palpate {
namespace {

constexpr double kOnSurfaceM = 5e-4;  // a point further from the piece of surface is one beyond it

}  // namespace

OtherContacts::OtherContacts(const Patch& patch, const PlayedSurface& surface, const StateInput& psi0, double dt_s)
    : count_(patch.others.count),
      own_(patch.others.own),
      at_stamp_(patch.tool, patch.turn.value_or(Rotation::Identity()), patch.opening),
      dt_(dt_s),
      moves_for_s_(seconds(patch.load_for)) {
  const ContactParameters parameters{patch.contact_stiffness_n_m, patch.friction};
  for (std::size_t j = 0; j < patch.others.tools().size(); ++j) {
    Contact& contact = contacts_[j];
    contact.tool = patch.others.of[j];
    contact.law = contact.tool.law.value_or(parameters);
    contact.touching = contact.tool.touching;
    contact.push.response = psi0 * contact.tool.rows.transpose();
    contact.push.set_compliance(contact.tool.rows, contact.law.contact_stiffness_n_m, contact.tool.c_static);
    if (contact.touching) {
      // At the stamp the modes are at zero, so c_static alone determines the push.
      const ContactClosure at_stamp =
          close_contact(Vec3::Zero(), contact.tool.c_static, contact.tool.normal, contact.tool.gap, contact.law);
      contact.push.lambda = at_stamp.lambda;
    }
    if (static_cast<int>(j) < own_) find_on(surface, contact);
  }
}

void OtherContacts::find_on(const PlayedSurface& surface, Contact& contact) const {
  if (surface.empty() || !surface.has_modes()) return;
  const OtherContact& at_stamp = contact.tool;
  const Vec3 centre = at_stamp_.centre_of(at_stamp.sphere);
  const Vec3 lowest = centre - at_stamp.sphere.radius_m * at_stamp.normal;
  const Vec3 point = lowest - at_stamp.gap + at_stamp.c_static * contact.push.lambda;
  const NearestPoint nearest = nearest_point(surface.view(), surface.positions(), point);
  if ((nearest.at_border && !contact.touching) || (nearest.position - point).norm() > kOnSurfaceM) return;
  contact.on_surface = true;
  contact.surface = SurfaceContact(nearest.point, contact.touching);
  contact.surface.separate(surface, centre - nearest.position);
  contact.surface.respond(surface, contact.law.contact_stiffness_n_m, contact.push);
}

void OtherContacts::take_from(StateVector& drift) const noexcept {
  for (const Contact& contact : std::span(contacts_).first(static_cast<std::size_t>(own_)))
    if (contact.touching) drift.noalias() -= contact.push.response * contact.push.lambda;
}

void OtherContacts::carry_on(StateVector& next) const noexcept {
  for (const Contact& contact : std::span(contacts_).first(static_cast<std::size_t>(count_))) contact.push.carry_on(next);
}

void OtherContacts::close(StateVector& z, const ModeVector& own, const ToolPose& tool, PlayedSurface& surface) noexcept {
  const auto contacts = std::span(contacts_).first(static_cast<std::size_t>(count_));
  ++steps_;
  ModeVector q = z.head(own.size()) + own;
  for (const Contact& contact : contacts) q += contact.push.moved();
  const double t = std::min(static_cast<double>(steps_) * dt_, moves_for_s_);
  for (std::size_t j = 0; j < contacts.size(); ++j) {
    Contact& contact = contacts[j];
    const OtherContact& other = contact.tool;
    q -= contact.push.moved();
    if (contact.on_surface) {
      surface.place(q);
      contact.surface.close(surface, tool.centre_of(other.sphere), other.sphere.radius_m, contact.law, contact.push);
      contact.touching = contact.surface.touching();
      if (contact.touching) contact.tool.normal = contact.surface.normal();
    } else {
      close(contact, q,
            static_cast<int>(j) < own_ ? Vec3(tool.centre_of(other.sphere) - at_stamp_.centre_of(other.sphere))
                                       : Vec3(t * other.velocity + (0.5 * t * t) * other.acceleration));
    }
    q += contact.push.moved();
    contact.push.add_to(z);
  }
}

bool OtherContacts::add_own(const ToolPose& tool, Vec3& force, Vec3& torque, double& grip) const noexcept {
  bool any = false;
  for (const Contact& contact : std::span(contacts_).first(static_cast<std::size_t>(own_))) {
    const ToolSphere& sphere = contact.tool.sphere;
    const Vec3 arm = tool.arm_of(sphere) - sphere.radius_m * contact.tool.normal;
    force -= contact.push.lambda;
    torque -= arm.cross(contact.push.lambda);
    grip -= grip_of(sphere, tool.turn, arm, contact.push.lambda);
    any |= contact.touching;
  }
  return any;
}

void OtherContacts::close(Contact& contact, const ModeVector& q, const Vec3& displacement) const noexcept {
  const OtherContact& tool = contact.tool;
  Vec3 gap = tool.gap + displacement - contact.slid;
  gap.noalias() -= tool.rows * q;
  contact.push.lambda.setZero();
  if (!contact.touching) {
    const double height = tool.normal.dot(gap);
    if (height >= 0) return;
    contact.slid += gap - height * tool.normal;
    gap = height * tool.normal;
  }
  const ContactClosure closure = close_contact(Vec3::Zero(), contact.push.compliance, tool.normal, gap, contact.law);
  contact.touching = closure.touching;
  contact.slid += closure.slip;
  contact.push.lambda = closure.lambda;
}

}  // namespace palpate
