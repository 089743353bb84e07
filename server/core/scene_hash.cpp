#include "server/core/scene_hash.hpp"

#include <bit>
#include <numeric>

namespace palpate {
namespace {

class SceneHash {
 public:
  void feed(double number) { word(std::bit_cast<std::uint32_t>(static_cast<float>(number))); }
  void feed(const Vec3& v) {
    for (const double number : v) feed(number);
  }
  void feed(const LumpedBody& body) {
    word(body.nodes.size());
    feed(std::accumulate(body.masses_kg.begin(), body.masses_kg.end(), 0.0));
    for (const Element& e : body.elements) {
      feed(e.stiffness_n_m);
      feed(e.damping_n_s_m);
    }
    for (const Tetrahedron& t : body.tetrahedra) feed_cell(t.material, t.share);
    for (const Hexahedron& h : body.hexahedra) feed_cell(h.material, h.share);
    for (const SolidMaterial& m : body.materials) feed(m);
    for (const PronyBranch& branch : body.relaxation) {
      feed(branch.share);
      feed(branch.time_s);
    }
    word(static_cast<std::uint64_t>(body.law));
    for (const double number : {body.stiffening, body.mass_damping_1_s}) feed(number);
    feed(body.gravity_m_s2);
    for (const TissueLayer& t : body.tissue)
      for (const double number : {t.thickness_m, t.toughness_j_m2, t.puncture_n, t.friction_n_m}) feed(number);
    for (const auto& part : body.parts) {
      for (const double number : {part->friction, part->stiffness_ratio}) feed(number);
      for (const Vec3& vertex : part->vertices) feed(vertex);
    }
    for (const Member& member : body.members)
      for (const double number : {member.friction, member.touches_itself ? 1.0 : 0.0}) feed(number);
  }
  void feed(const ToolSpec& tool) {
    word(static_cast<std::uint64_t>(tool.contact));
    word(tool.node);
    for (const double number : {tool.friction, tool.contact_stiffness_n_m, tool.radius_m}) feed(number);
    for (const ToolSphere& sphere : tool.shape) {
      feed(sphere.centre);
      feed(sphere.radius_m);
      if (!sphere.on_jaw()) continue;
      feed(sphere.hinge_m);
      feed(sphere.swing_rad);
    }
    if (tool.needle)
      for (const double number :
           {tool.needle->length_m, tool.needle->width_m, tool.needle->is_blade ? 1.0 : 0.0, tool.needle->stroke_m})
        feed(number);
  }
  void feed(const SolverSpec& solver) {
    feed(solver.step_s);
    word(static_cast<std::uint64_t>(solver.integrator));
  }
  std::uint64_t value() const { return hash_; }

 private:
  void word(std::uint64_t bits) { hash_ = (hash_ ^ bits) * 0x100000001b3u; }
  void feed_cell(std::uint32_t material, double share) {
    word(material);
    feed(share);
  }
  void feed(const SolidMaterial& m) {
    word(static_cast<std::uint64_t>(m.law));
    for (const double number : {m.young_pa, m.poisson, m.damping_s, m.shape, m.exponents[0], m.exponents[1]}) feed(number);
    for (const double number : m.fibres.direction) feed(number);
    for (const double number : {m.fibres.share, m.fibres.exponent}) feed(number);
  }

  std::uint64_t hash_ = 0xcbf29ce484222325u;
};

}  // namespace

std::uint64_t scene_hash(const Scene& scene) {
  SceneHash hash;
  hash.feed(scene.body);
  if (scene.tearing) hash.feed(1.0);
  hash.feed(scene.tool);
  for (const ToolSpec& tool : scene.tools) hash.feed(tool);
  hash.feed(scene.solver);
  return hash.value();
}

}  // namespace palpate
