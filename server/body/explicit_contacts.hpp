// Where tools touch a body that is stepped explicitly: what a contact needs of the surface, kept while it stays on its triangle.
//
// Tools that do not touch are looked for every kLookS at least while they are near. A contact's point is p = p_rest + B^T u
// (skin.hpp); only the vertices around it are kept in place, where they are at the step's end.
#pragma once

#include <vector>

#include "common/port/contact_law.hpp"
#include "server/body/explicit_body.hpp"
#include "server/body/skin.hpp"

namespace palpate {

struct ExplicitContact {
  bool valid = false;
  SurfacePoint point;
  Skin::Weights b;
  std::vector<std::uint32_t> around;                 // vertices that are kept in place
  Vec3 at_rest = Vec3::Zero();                       // p where nothing has moved
  double softness_1_kg = 0;                          // B^T M^-1 B
  Vec3 tool = Vec3::Zero(), normal = Vec3::UnitZ();  // at the step's end; outward
  /// B^T y
  Vec3 gather(const NodeArrays& y) const;
};

class ExplicitContacts {
 public:
  static constexpr double kLookS = 0.001;

  /// `skin` must outlive it.
  explicit ExplicitContacts(const Skin& skin) : skin_(&skin) {}
  void take(const BodyState& state, const std::vector<ToolPort>& ports);
  /// Whether tools that do not touch have come to be inside.
  void look(const ExplicitBody& body, std::vector<ToolPort>& ports, double at_s, const ToolMotion& tools);
  /// Ports that touch, with their contacts made ready for a step to `end_s`, the surface where the velocities take it in
  /// `ahead_s`.
  const std::vector<std::size_t>& meet(const ExplicitBody& body, const std::vector<ToolPort>& ports, double end_s, double ahead_s,
                                       const ToolMotion& tools);
  /// The surface around a contact and its normal, where the velocities take it in `ahead_s`.
  void look_again(const ExplicitBody& body, std::size_t k, double ahead_s);
  /// Moves the port on by `slip` where that is worth another closing of the contact there (kSlipToleranceM), and makes the
  /// contact ready for it.
  bool slide_on(const ExplicitBody& body, std::size_t k, const Vec3& slip, double ahead_s, ToolPort& port);
  /// What the step's closing of a contact, with the port's lambda and its point at `end`, leads to: it goes on, further along the
  /// surface, or ends.
  void finish(std::size_t k, const Vec3& slip, const Vec3& end, double end_s, ToolPort& port);
  ExplicitContact& operator[](std::size_t k) { return contacts_[k]; }
  const ExplicitContact& operator[](std::size_t k) const { return contacts_[k]; }
  const ExplicitContact& refreshed(const ExplicitBody& body, std::size_t k, const SurfacePoint& point);

 private:
  std::vector<std::uint32_t> vertices_around(std::uint32_t triangle) const;

  const Skin* skin_;
  std::vector<ExplicitContact> contacts_;  // a port
  std::vector<std::size_t> touching_;
  std::vector<double> looked_for_s_;  // when a port that does not touch is looked for next
  std::vector<double> skin_positions_;
};

}  // namespace palpate
