// A patch of scheme hyper against the body: forces far beyond the tangent, and impossible requests.
#include "server/reduction/fit_nonlinear_terms.hpp"

#include <array>
#include <catch2/catch.hpp>
#include <cmath>

#include "common/patch/terms_pieces.hpp"
#include "server/reduction/patch_build.hpp"
#include "tests/support/bodies.hpp"
#include "tests/support/explicit_steppers.hpp"

using namespace palpate;
using namespace palpate::test;

namespace {

constexpr std::uint32_t kNode = 57;

struct Grasp {
  LumpedBody body = box_body(4, 4, 4);
  Dynamics dynamics;
  Skin skin{body};
  BodyState state;
  FrameModel frame{dynamics, skin, 0};
  std::vector<ToolPort> ports{1};
  ToolAt tool;

  explicit Grasp(double shift_m, double speed_m_s = 0, SpringLaw law = SpringLaw::linear, std::uint64_t seed = 5,
                 double stiffer = 1)
      : dynamics((body.law = law, stiffen(body, stiffer))) {
    begin(random_state(dynamics, seed, shift_m, speed_m_s));
  }
  explicit Grasp(LumpedBody of) : body(std::move(of)), dynamics(body) { begin(random_state(dynamics, 5, 0, 0)); }
  void begin(BodyState at) {
    state = std::move(at);
    ports[0].kind = ContactKind::attach;
    ports[0].node = kNode;
    ports[0].lambda = -dynamics.element_force(state, kNode);
    tool = {node_of(state.x, kNode), node_of(state.v, kNode)};
  }
  static const LumpedBody& stiffen(LumpedBody& body, double more) {
    for (Element& e : body.elements) e.stiffness_n_m *= more;
    return body;
  }
  BuiltPatch build() {
    PatchRequest request;
    request.scheme = Scheme::hyper;
    request.horizon = Micros{100'000};
    frame.begin(state, ports, std::span(&tool, 1), request.horizon);
    auto built = build_patch(frame, 0, request);
    REQUIRE(built);
    REQUIRE(check(built->patch) == PatchFault::none);
    return *built;
  }
};

/// A block of finite elements with a spring from near the grasped node to a place outside.
LumpedBody held_by_a_ligament() {
  LumpedBody body = solid_box(4, 4, 4, {SolidLaw::neo_hookean, 8e3, 0.45, 0.01});
  const auto anchor = static_cast<std::uint32_t>(body.nodes.size());
  body.nodes.push_back(body.nodes[kNode + 1] + Vec3(0, -0.04, 0.01));
  body.masses_kg.push_back(1e-3);
  body.fixed.push_back(1);
  body.elements.push_back({kNode + 1, anchor, (body.nodes[anchor] - body.nodes[kNode + 1]).norm(), 40, 0.1});
  return body;
}

}  // namespace

TEST_CASE("A solid that a ligament holds has nonlinear patches, ten times nearer to its forces than the linear ones") {
  Grasp grasp(held_by_a_ligament());
  const BuiltPatch built = grasp.build();
  REQUIRE(built.terms.variables == built.patch.modes() + 3);
  NonlinearForce bend(built.terms, built.patch);
  for (const Vec3& d : {Vec3(0.006, 0, 0), Vec3(0.004, -0.004, 0.005), Vec3(0, 0.001, -0.006)}) {
    NonlinearForce::Variables u = NonlinearForce::Variables::Zero(built.patch.modes() + 3), force;
    u.head<3>() = d;
    BodyState moved = grasp.state;
    moved.x.segment<3>(3 * kNode) += d;
    const Vec3 exact = grasp.dynamics.element_force(moved, kNode), linear = built.patch.force - built.patch.k_port * d;
    bend.move_to(u);
    bend.elastic(force);
    CHECK((linear + force.head<3>() - exact).norm() < 0.1 * (linear - exact).norm());
  }
}

TEST_CASE("With the modes still, the force of a displaced tool is the body's") {
  Grasp grasp(0);
  const BuiltPatch built = grasp.build();
  const Patch& patch = built.patch;
  const NonlinearTerms& terms = built.terms;
  REQUIRE(terms.variables == patch.modes() + 3);
  NonlinearForce bend(terms, patch);
  for (const Vec3& d : {Vec3(0.002, 0, 0), Vec3(0.0012, -0.0012, 0.0016), Vec3(0, 0.0004, -0.002)}) {
    NonlinearForce::Variables u = NonlinearForce::Variables::Zero(patch.modes() + 3), force;
    u.head<3>() = d;
    BodyState moved = grasp.state;
    moved.x.segment<3>(3 * kNode) += d;
    const Vec3 exact = grasp.dynamics.element_force(moved, kNode), linear = patch.force - patch.k_port * d;
    bend.move_to(u);
    bend.elastic(force);
    INFO("exact " << (exact - patch.force).transpose() << ", linear " << (linear - patch.force).transpose());
    const double least = (exact - linear).norm();
    CHECK((exact - linear - Vec3(force.head<3>())).norm() < 0.1 * least);
    CHECK(least > 1e-3 * (exact - patch.force).norm());
  }
}

TEST_CASE("Terms give back the stiffness that PSD projection changed to make the linear patch passive") {
  int projected = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Grasp grasp(0.016, 0, SpringLaw::linear, seed);
    const BuiltPatch built = grasp.build();
    const Patch& patch = built.patch;
    const NonlinearTerms& terms = built.terms;
    if (terms.variables == 0 || built.psd_change_1_s2 == 0) continue;
    ++projected;
    NonlinearForce bend(terms, patch);
    for (int axis = 0; axis < 3; ++axis) {
      Vector k, d, e = Vector::Unit(grasp.state.x.size(), 3 * kNode + axis);
      grasp.dynamics.multiply_tangents(grasp.state, e, k, d);
      NonlinearForce::Variables u = NonlinearForce::Variables::Zero(patch.modes() + 3), force;
      constexpr double kSmallM = 1e-7;
      u[axis] = kSmallM;
      bend.move_to(u);
      bend.elastic(force);
      const Vec3 stiffness = patch.k_port.col(axis) - Vec3(force.head<3>()) / kSmallM;
      CHECK((stiffness - k.segment<3>(3 * kNode)).norm() < 1e-3 * k.segment<3>(3 * kNode).norm());
    }
  }
  CHECK(projected > 0);
}

TEST_CASE("A body whose law is not smooth is served the port patch, and the builder says so") {
  Grasp grasp(0.002, 0.1, SpringLaw::thigh_skin);
  const BuiltPatch built = grasp.build();
  CHECK(built.patch.scheme == Scheme::port);
  CHECK(built.fell_back);
  CHECK(built.terms.variables == 0);
  const BuiltPatch other = Grasp(0.002, 0.1).build();
  CHECK(other.patch.scheme == Scheme::hyper);
  CHECK_FALSE(other.fell_back);
}

TEST_CASE("A solid of either law is served some of its elements, one of both the port patch") {
  const bool hexahedra = GENERATE(false, true);
  for (const int laws : {0, 1, 2})
    for (const bool touch : {false, true}) {
      const SolidLaw law = laws == 0 ? SolidLaw::neo_hookean : SolidLaw::corotational;
      const SolidMaterial soft{law, 8e3, 0.45, 0.01};
      LumpedBody body = hexahedra ? hexa_box(4, 4, 4, soft) : solid_box(4, 4, 4, soft);
      body.materials.push_back({SolidLaw::neo_hookean, 8e3, 0.45, 0.01});
      if (laws != 1) (hexahedra ? body.hexahedra.front().material : body.tetrahedra.front().material) = 1;
      if (laws == 1) body.materials.pop_back();
      const Dynamics dynamics(body);
      const Skin skin(body);
      BodyState state = dynamics.rest_state();
      std::vector<ToolPort> ports(1);
      ToolAt tool{node_of(state.x, kNode), Vec3::Zero()};
      if (touch) {
        ports[0].parameters = {1000, 0.3};
        ports[0].touching = true;
        ports[0].point = nearest_point(skin.view(), skin.place(state.x), tool.position).point;
        ports[0].lambda = Vec3(0, 0, -0.1);
      } else {
        ports[0].kind = ContactKind::attach;
        ports[0].node = kNode;
      }
      FrameModel frame(dynamics, skin, 0);
      PatchRequest request;
      request.scheme = Scheme::hyper;
      request.horizon = Micros{100'000};
      frame.begin(state, ports, std::span(&tool, 1), request.horizon);
      const auto built = build_patch(frame, 0, request);
      REQUIRE(built);
      const Patch* const patch = &built->patch;
      REQUIRE(check(*patch) == PatchFault::none);
      CAPTURE(touch);
      const bool known = laws < 2;
      CHECK((patch->scheme == Scheme::hyper) == known);
      CHECK(built->fell_back == !known);
      CHECK((built->terms.elements.count() > (hexahedra ? 6 : 20)) == known);
      if (known) CHECK(to_pieces(built->terms, 1).size() <= static_cast<std::size_t>(kUsualPieces));
    }
}

TEST_CASE("A planar body has terms, and the tool's way across it changes nothing") {
  const Scene scene = load_scene(PALPATE_SOURCE_DIR "/scenes/sheet13.json");
  const Dynamics dynamics(scene.body);
  const Skin skin(scene.body);
  const BodyState state = dynamics.rest_state();
  std::vector<ToolPort> ports(1);
  ports[0].kind = ContactKind::attach;
  ports[0].node = scene.tool.node;
  const ToolAt tool{node_of(state.x, scene.tool.node), Vec3::Zero()};
  PatchRequest request;
  request.scheme = Scheme::hyper;
  FrameModel frame(dynamics, skin, 0);
  frame.begin(state, ports, std::span(&tool, 1), request.horizon);
  const auto built = build_patch(frame, 0, request);
  REQUIRE(built);
  const Patch* const patch = &built->patch;
  CHECK(patch->scheme == Scheme::hyper);
  CHECK_FALSE(built->fell_back);
  REQUIRE(built->terms.variables > 0);
  REQUIRE_FALSE(to_pieces(built->terms, 1).empty());
  NonlinearForce force(built->terms, *patch);
  NonlinearForce::Variables u = NonlinearForce::Variables::Constant(patch->modes() + 3, 1e-3), here, across;
  u[2] = 0;
  force.move_to(u);
  force.elastic(here);
  REQUIRE(here.norm() > 0);
  u[2] = 0.005;
  force.move_to(u);
  force.elastic(across);
  CHECK((across - here).norm() < 1e-3 * here.norm());
}

TEST_CASE(
    "A lattice has springs for terms, linear ones and ones that stiffen, more than three datagrams take and no more than there "
    "are") {
  for (const SpringLaw law : {SpringLaw::linear, SpringLaw::stiffening}) {
    Grasp grasp(0.001, 0, law);
    const NonlinearTerms terms = grasp.build().terms;
    CHECK(terms.elements.count() > 60);
    const auto pieces = static_cast<int>(to_pieces(terms, 1).size());
    CHECK(pieces > 3);
    CHECK(pieces <= kUsualPieces);
  }
}

TEST_CASE("A body too stiff for a tick has springs for terms, too, with mass for it") {
  Grasp stiff(0.001, 0, SpringLaw::stiffening, 5, 1e4);
  const BuiltPatch built = stiff.build();
  REQUIRE(built.terms.elements.count() > 0);
  CHECK(NonlinearForce(built.terms, built.patch).added_mass().size() > 0);
}

TEST_CASE("A hyper-reduced patch knows the way back to where the body rests, whatever bent it") {
  Grasp grasp(0.002);
  const Matrix v = grasp.build().modes.of_nodes();
  Vector way = grasp.dynamics.rest_state().x - grasp.state.x;
  way.segment<3>(3 * kNode).setZero();  // the tool's own motion
  const Vector missed = way - v * (v.transpose() * grasp.dynamics.masses().cwiseProduct(way));
  const auto size = [&](const Vector& x) { return std::sqrt(x.dot(grasp.dynamics.masses().cwiseProduct(x))); };
  CHECK(size(missed) < 0.02 * size(way));
}

TEST_CASE("The load of another hand that moves on grows in the modes that a patch has, PSD-projected or not") {
  constexpr std::uint32_t kOther = 54;
  int projected = 0;
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    Grasp grasp(0.016, 0, SpringLaw::linear, seed);
    grasp.ports.push_back(grasp.ports[0]);
    grasp.ports[1].node = kOther;
    const std::array<ToolAt, 2> tools{grasp.tool, ToolAt{node_of(grasp.state.x, kOther), Vec3(0.05, -0.02, 0.1)}};
    PatchRequest request;
    request.scheme = Scheme::hyper;
    grasp.frame.begin(grasp.state, grasp.ports, tools, request.horizon);
    const auto built = build_patch(grasp.frame, 0, request);
    REQUIRE(built);
    const Matrix v = built->modes.of_nodes();
    if (v.cols() == 0) continue;
    projected += built->psd_change_1_s2 > 0;
    Vector motion = Vector::Zero(grasp.state.x.size()), k, d;
    at_node(motion, kOther) = tools[1].velocity;
    grasp.dynamics.multiply_tangents(grasp.state, motion, k, d);
    const Vector expected = -v.transpose() * k;
    CHECK((built->patch.load_rate - expected).norm() < 1e-9 * expected.norm());
  }
  CHECK(projected > 0);
}
