// A scene as the server uses it: every default filled in, every value in range.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/base/types.hpp"
#include "common/mechanics/solid_law.hpp"
#include "common/patch/patch.hpp"
#include "common/task/task.hpp"
#include "server/scene/distance_grid.hpp"

namespace palpate {

/// Tension T(e) of an element against its elongation e [m]; k is the element's stiffness [N/m], L its rest length [m].
///   linear      T = k e
///   stiffening  T = k e (1 + c (e / L)^2), c = `stiffening`
///   thigh_skin  T = k/k0 * f(e), f(x) = x / (5.4398 - 0.1418 x) [x mm, f N], odd in e, k0 = f'(0); beyond 90 % of the pole
///               (38.4 mm) continued along its tangent. Source: skin of the thigh, eq. 5 of Cavusoglu and Tendick.
enum class SpringLaw : std::uint8_t { linear, stiffening, thigh_skin };

struct Element {
  std::uint32_t a = 0, b = 0;
  double rest_length_m = 0, stiffness_n_m = 0, damping_n_s_m = 0;
};

/// A solid, isotropic except for its fibres: Young's modulus and Poisson's ratio at small strains (without the fibres), and the
/// time t that relates its viscous stress to the rate of strain (stiffness-proportional Rayleigh damping, D = t K at rest).
struct SolidMaterial {
  SolidLaw law = SolidLaw::neo_hookean;
  double young_pa = 10e3, poisson = 0.45, damping_s = 0.01;
  // Further parameters of the law (solid_law.hpp), and the fibres added to it.
  double shape = 0;
  std::array<double, 2> exponents{};
  Fibres fibres{};

  LawParameters parameters() const { return {law, shape, exponents, fibres}; }
};

/// A linear tetrahedron: nodes 1, 2, 3 counter-clockwise seen from outside, opposite node 0 (positive volume). Or a triangle of a
/// membrane: the last node equals the first.
struct Tetrahedron {
  std::array<std::uint32_t, 4> nodes{};
  std::uint32_t material = 0;  ///< index into LumpedBody::materials
  double share = 1;            ///< share of its stiffness, damping and mass that is there (cell_copies.hpp)

  bool is_triangle() const { return nodes[3] == nodes[0]; }
  std::size_t corners() const { return is_triangle() ? 3 : 4; }
};

/// A hexahedron of eight nodes with one mean gradient and hourglass stiffness (server/elements/element_shape.hpp). Bit a of a
/// node's index in `nodes` says on which side of the element it lies along axis a; the volume is positive.
struct Hexahedron {
  std::array<std::uint32_t, 8> nodes{};
  std::uint32_t material = 0;  ///< index into LumpedBody::materials
  double share = 1;            ///< as that of a tetrahedron
};

/// Element type of the cells of a solid.
enum class SolidElement : std::uint8_t { hexahedron, tetrahedron };

/// A layer of a body as a needle meets it, from the surface inwards.
struct TissueLayer {
  double thickness_m = 0;     ///< at rest; of the innermost not used
  double toughness_j_m2 = 0;  ///< J, energy of a cut
  double puncture_n = 0;      ///< push with which a tip enters it
  double friction_n_m = 0;    ///< of a length of shaft in it
};
/// Layers, with one for what lies behind the body (common/patch/needle.hpp).
inline constexpr std::size_t kMaxTissueLayers = 3;

/// A weighted sum of nodes: (node, weight).
using NodeWeights = std::vector<std::pair<std::uint32_t, double>>;
/// Returns it by ascending node, each node once; those of weight 0 are left out.
NodeWeights merged(NodeWeights weights);

/// A vertex of the surface of a cut body that is no node (cut_walls.hpp): the mean of nodes of one element, by weight.
struct EmbeddedVertex {
  NodeWeights weights;   ///< merged, of sum 1
  bool is_wall = false;  ///< true: it lay inside the body before the cut
};

/// A rigid part beside the body, which never moves (server/body/contacts.hpp).
struct RigidPart {
  std::string name;
  std::uint32_t colour = 0;         ///< 0xrrggbb
  double friction = 0;              ///< Coulomb mu with the body
  double stiffness_ratio = 0;       ///< of its contact to the stiffness of the body's node
  std::vector<Vec3> vertices;       ///< [m]
  std::vector<Triangle> triangles;  ///< closed, counter-clockwise outward
  DistanceGrid distance;
  Eigen::AlignedBox3d box;
};

/// A point of the body through which a thread goes.
struct SutureBite {
  NodeWeights at;            ///< of sum 1
  Vec3 rest = Vec3::Zero();  ///< its place in the body at rest [m]
  std::uint32_t cell = 0;    ///< in which it is
  std::uint32_t number = 0;  ///< of the bites that its thread began with
};

/// A thread through the body (server/body/sutures.hpp), or on a needle, which has yet to draw it through.
struct Suture {
  std::string name;
  double radius_m = 0;
  SutureLaw law;
  std::vector<SutureBite> bites;  ///< none: it is on a needle
  OfSpans length_m{};             ///< of its spans and tails before anything moves; on a needle the first is all of it
  double first_tail_m = 0;        ///< on a needle: what is left before its first bite
  double slack_m = 0;             ///< on a needle: of each span beyond the distance of its bites
  /// Returns the number of bites that it may have.
  std::size_t most_bites() const { return bites.empty() ? std::size_t{kMaxBites} : bites.size(); }
};

/// One of several bodies in a LumpedBody, which may touch the others (server/body/body_contacts.hpp): a solid with its own
/// surface.
struct Member {
  std::string name;
  std::uint32_t colour = 0;                      ///< 0xrrggbb
  double friction = 0;                           ///< Coulomb mu; between two their geometric mean
  bool touches_itself = false;                   ///< true: distant parts of it may touch, too
  std::uint32_t first_node = 0, end_node = 0;    ///< its nodes, and with them its cells and triangles
  std::shared_ptr<const DistanceGrid> distance;  ///< from its surface at rest
};

/// A body of lumped masses before it moves, joined by springs or filled with finite elements of one kind, and held by ligaments:
/// springs to fixed nodes that belong to nothing else. Vertices of the surface are the nodes, and after them those embedded in
/// elements, so a surface point is a weighted sum of node positions.
struct LumpedBody {
  bool planar = false;      ///< 2-D lattice: no motion or force along z
  std::vector<Vec3> nodes;  ///< rest positions [m]
  std::vector<double> masses_kg;
  std::vector<std::uint8_t> fixed;
  std::vector<Element> elements;
  std::vector<Tetrahedron> tetrahedra;   ///< triangles of membranes last
  std::vector<Hexahedron> hexahedra;     ///< never together with tetrahedra that have a volume
  std::vector<SolidMaterial> materials;  ///< for fast motions; young_pa of a membrane is Young's modulus times thickness [N/m]
  std::vector<PronyBranch> relaxation;   ///< relaxation of all elements with a volume (server/body/relaxation.hpp)
  double mass_damping_1_s = 0;           ///< finite elements: a force -c m v on every node (mass-proportional Rayleigh damping)
  std::vector<Triangle> triangles;       ///< closed outer surface over vertices, counter-clockwise outward; none of planar bodies
  std::vector<EmbeddedVertex> embedded;  ///< vertices from nodes.size() on
  SpringLaw law = SpringLaw::linear;
  double stiffening = 0;
  Vec3 gravity_m_s2 = Vec3::Zero();
  double left_out_share = 0;        ///< share of the volume inside a closed surface that was dropped (clip.hpp)
  std::vector<TissueLayer> tissue;  ///< for needles
  std::vector<std::shared_ptr<const RigidPart>> parts;  ///< that it may touch
  std::vector<Member> members;  ///< what touches each other of it; empty: it is one body that does not touch itself
  std::vector<Suture> sutures;  ///< threads through it
  bool is_loaded = false;       ///< true: gravity holds `nodes` there; they are not the rest shape (server/body/unload.hpp)

  bool is_solid() const { return !tetrahedra.empty() || !hexahedra.empty(); }
  std::size_t vertices() const { return nodes.size() + embedded.size(); }
  bool is_node(std::uint32_t vertex) const { return vertex < nodes.size(); }
  /// Vertices that are no nodes are not fixed.
  bool is_fixed(std::uint32_t vertex) const { return vertex < fixed.size() && fixed[vertex] != 0; }
  /// Returns the place of its member in `members`, 0 without any.
  std::uint8_t member_of(std::uint32_t vertex) const;
  /// Returns true if the vertex is on the wall of a cut.
  bool is_wall(std::uint32_t vertex) const { return !is_node(vertex) && embedded[vertex - nodes.size()].is_wall; }
};

/// Every pair of nodes joined by an element, once: those of springs in their order, then those of finite elements, ascending.
std::vector<std::pair<std::uint32_t, std::uint32_t>> edges_of(const LumpedBody& body);
/// Mean length of these pairs at rest [m], 0 if there are none.
double mean_edge_m(const LumpedBody& body);
/// Number of nodes without the fixed ends of ligaments, which come last.
std::size_t own_nodes(const LumpedBody& body);
/// Calls f(node) for a vertex that is a node, or for the nodes of one that is not.
template <class F>
void each_node_of(const LumpedBody& body, std::uint32_t vertex, F&& f) {
  if (body.is_node(vertex)) return f(vertex);
  for (const auto& [node, weight] : body.embedded[vertex - body.nodes.size()].weights) f(node);
}
/// Rest positions of all vertices.
std::vector<Vec3> vertices_at_rest(const LumpedBody& body);

/// The edge of a blade of this length that moves along a line (cuts.hpp).
struct CutSettings {
  std::vector<Vec3> path_m;
  Vec3 direction = Vec3::Zero();  ///< of length 1, from the path to the end of the edge
  double depth_m = 0;
};

/// A straight needle along the z axis of the tool's frame, its tip at the tool point. Or a blade, which is the same with an edge
/// along x, its middle at the tool point, and parts the body where it cuts. Or scissors: a blade at the point where two blades
/// cross, which closing moves from stroke_m along z to the tool point.
struct NeedleSpec {
  double length_m = 0;  ///< from tip to hub
  double width_m = 0;   ///< w of its cut: a needle's diameter, the length of a blade's edge
  bool is_blade = false;
  double stroke_m = 0;  ///< of the crossing of scissors; 0: it is none
};

inline constexpr std::size_t kMaxTools = 8;  ///< of a scene

struct ToolSpec {
  ContactKind contact = ContactKind::touch;
  std::uint32_t node = 0;                 ///< attach: index into LumpedBody::nodes
  double friction = 0.3;                  ///< touch: Coulomb mu
  double contact_stiffness_n_m = 1000;    ///< touch: contact stiffness k_c between tool and surface
  double radius_m = 0;                    ///< touch: contact radius of the tip (skin.hpp), 0 = a point
  ToolShape shape = {};                   ///< touch: body of the tool; empty: a point
  std::optional<NeedleSpec> needle = {};  ///< touch: of a point that is the tip of a needle, or a blade's
  std::vector<std::uint32_t> holds = {};  ///< sutures whose ends the first hand holds in turn: its tool does not touch; of a
                                          ///< needle those that are on it in turn
  std::string name = {};                  ///< by which hands ask for it; empty: it has none
  /// Returns true if it matters how the tool is held.
  bool has_body() const { return !shape.empty() || needle.has_value(); }
  /// Returns true if it has jaws, or is scissors.
  bool opens() const { return has_jaws(shape) || (needle && needle->stroke_m > 0); }
};

/// Integrator of the body (server/dynamics/integrator_selection.hpp).
enum class IntegratorKind : std::uint8_t { automatic, tr_bdf2, leapfrog, stabilised };

struct SolverSpec {
  double step_s = 0.010;  ///< largest sub-step of a frame
  IntegratorKind integrator = IntegratorKind::automatic;
};

class CutBody;

struct Scene {
  std::string name;
  LumpedBody body;
  ToolSpec tool;  ///< of hands that ask for none
  SolverSpec solver;
  std::optional<Task> task = {};                ///< for a trainee
  std::shared_ptr<const CutBody> tearing = {};  ///< cuts of `body` that tear on; null: it does not tear
  std::vector<ToolSpec> tools = {};             ///< further ones, each with a name, which touch: points or bodies
  /// Returns tool number `held`: 0 is `tool`, the others are `tools`.
  const ToolSpec& tool_of(std::size_t held) const { return held == 0 ? tool : tools.at(held - 1); }
  /// Returns the number of the tool of that name, 0 for an empty one; none where the scene has no such tool.
  std::optional<std::uint8_t> tool_named(const std::string& named) const;
  /// Returns the contact radii of all tools, each once, that of `tool` first: the skin has a copy for each (skin.hpp).
  std::vector<double> contact_radii() const;
  /// Returns true if the body may be parted while a room runs.
  bool is_cut_live() const { return tearing || (tool.needle && tool.needle->is_blade); }
};

/// Folders below which a scene may name meshes. Links are resolved first: a link to a file elsewhere is refused.
using MeshFolders = std::vector<std::filesystem::path>;

/// Reads and checks a scene file. For a body as loaded by gravity see open_scene() (server/body/unload.hpp). Throws
/// InputError with file, line, field, value and what was expected. Paths inside a scene (meshes) are relative to the scene file,
/// and lie below its folder or one of `besides`.
Scene load_scene(const std::filesystem::path& file, const MeshFolders& besides = {});
/// The same from memory; `name` stands for the file in errors, and paths are relative to it. As the text may come from elsewhere,
/// meshes must lie below one of `folders`.
Scene read_scene(const std::string& json, const std::string& name, const MeshFolders& folders = {});

/// Returns the scene with every default filled in, as JSON that load_scene accepts.
std::string print_scene(const std::filesystem::path& file, const MeshFolders& besides = {});

}  // namespace palpate
