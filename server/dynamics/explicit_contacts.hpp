// Contacts of tools with an explicitly stepped body: the part of the surface that a contact needs, kept while it stays on its
// triangle.
//
// Tools that do not touch are checked every kLookS while they are near, less often farther away. A contact's point is
// p = p_rest + B^T u (skin.hpp); only the vertices around it are updated, to their positions at the step's end.
#pragma once

#include <vector>

#include "common/patch/contact_law.hpp"
#include "server/body/skin.hpp"
#include "server/dynamics/explicit_body.hpp"

namespace palpate {

struct ExplicitContact {
  bool valid = false;
  SurfacePoint point;
  NodeWeights b;
  std::vector<std::uint32_t> around;                 // vertices that are kept up to date
  Vec3 at_rest = Vec3::Zero();                       // p at zero displacement
  Vec3 tool = Vec3::Zero(), normal = Vec3::UnitZ();  // at the step's end; outward
  /// Returns B^T y.
  Vec3 gather(const NodeArrays& y) const;
  /// Returns B^T M^-1 B_other.
  double softness_1_kg(const ExplicitContact& other, const ExplicitBody& body) const;
};

class ExplicitContacts {
 public:
  static constexpr double kLookS = 0.001;

  /// `skin` must outlive it.
  explicit ExplicitContacts(const Skin& skin) : skin_(&skin) {}
  void take(const BodyState& state, const std::vector<ToolPort>& ports);
  /// Starts the contact of tools that have come inside since they were last checked.
  void look(const ExplicitBody& body, std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools);
  /// Returns the ports that touch, with their contacts prepared for a step to `end_s`.
  std::vector<std::size_t> meet(const std::vector<ToolPort>& ports, double end_s, const ToolMotion& tools);
  /// Updates the surface around a contact and its normal.
  void look_again(const ExplicitBody& body, std::size_t k);
  /// Moves the port by `slip` and prepares its contact there, if the slip is large enough to solve the contact again (more than
  /// kSlipToleranceM); returns true if so.
  bool slide_on(const ExplicitBody& body, std::size_t k, const Vec3& slip, ToolPort& port);
  /// Applies the result of a step's contact, with the port's lambda and its point at `end`: it continues, slides along the
  /// surface, or ends.
  void finish(std::size_t k, const Vec3& slip, const Vec3& end, double end_s, ToolPort& port);
  ExplicitContact& operator[](std::size_t k) { return contacts_[k]; }
  const ExplicitContact& operator[](std::size_t k) const { return contacts_[k]; }
  const ExplicitContact& refreshed(std::size_t k, const SurfacePoint& point);

 private:
  std::vector<std::uint32_t> vertices_around(std::uint32_t triangle) const;

  const Skin* skin_;
  std::vector<ExplicitContact> contacts_;  // one per port
  std::vector<double> looked_for_s_;       // next time at which a port that does not touch is checked
  std::vector<double> skin_positions_;
};

}  // namespace palpate
