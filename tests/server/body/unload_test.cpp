// Bodies given in their shape under gravity, and ligaments.
#include "server/body/unload.hpp"

#include <catch2/catch.hpp>

#include "common/base/error.hpp"
#include "server/body/settle.hpp"

using namespace palpate;

namespace {

constexpr double kGravity = 9.81;

Scene bar(const std::string& made_of, const std::string& beside = "") {
  return read_scene(R"({"body": {"lattice": {"nodes": [9, 4, 4], "size_m": [0.08, 0.03, 0.03], "fixed_faces": ["x-"],
      "gravity_m_s2": [0, 0, -9.81], )" +
                        made_of + "}" + beside + "}}",
                    "bar.json");
}

double farthest_mm(const std::vector<Vec3>& nodes, const Vector& x) {
  double most = 0;
  for (std::uint32_t i = 0; i < nodes.size(); ++i) most = std::max(most, 1e3 * (at_node(x, i) - nodes[i]).norm());
  return most;
}

/// A column of one cell that stands on its end or hangs from it, free to expand sideways.
Scene column(bool loaded, const std::string& relaxation = "") {
  return read_scene(R"({"body": {"lattice": {"nodes": [2, 2, 21], "size_m": [0.005, 0.005, 0.1], "fixed_faces": ["z+"],
      "gravity_m_s2": [0, 0, -9.81], "solid": {"young_pa": 20000, "poisson": 0)" +
                        relaxation + R"(}}, "reference_configuration": ")" + (loaded ? "loaded" : "stress-free") + "\"}}",
                    "column.json");
}

}  // namespace

TEST_CASE("A body that was given as it hangs hangs so", "[body][unload]") {
  const std::string loaded = R"(, "reference_configuration": "loaded")";
  for (const std::string made_of :
       {R"("solid": {"young_pa": 30000})", R"("solid": {"young_pa": 30000, "element": "tetrahedron"})", R"("young_pa": 30000)",
        R"("solid": {"young_pa": 30000, "relaxation": [{"share": 0.4, "time_s": 1}]})"}) {
    const Scene given = bar(made_of, loaded), plain = bar(made_of);
    REQUIRE(given.body.is_loaded);
    const LumpedBody rests = unloaded(given.body, "bar.json");
    CHECK_FALSE(rests.is_loaded);
    const Dynamics dynamics(rests), of_plain(plain.body);
    const double sag_mm = farthest_mm(plain.body.nodes, settled_state(of_plain, "hanging").x);
    CHECK(sag_mm > 2);
    CHECK(farthest_mm(given.body.nodes, settled_state(dynamics, "hanging").x) < 1e3 * kUnloadedTo * 0.014);
    for (std::size_t i = 0; i < rests.nodes.size(); ++i)
      if (rests.fixed[i]) CHECK(rests.nodes[i] == given.body.nodes[i]);
    for (const Element& e : rests.elements) CHECK(e.rest_length_m == (rests.nodes[e.b] - rests.nodes[e.a]).norm());
    CHECK(rests.masses_kg == given.body.masses_kg);
    CHECK(unloaded(plain.body, "").nodes == plain.body.nodes);
    CHECK(opened(given, "bar.json").body.nodes == rests.nodes);
  }
}

TEST_CASE("A hanging column that was given as loaded is as much shorter at rest as its weight stretches it", "[body][unload]") {
  // Small strains: rho g L^2 / 2 E.
  const Scene given = column(true);
  const LumpedBody rests = unloaded(given.body, "column.json");
  double lowest = 1;
  for (const Vec3& x : rests.nodes) lowest = std::min(lowest, x.z());
  CHECK(1e3 * lowest == Approx(1e3 * 1000 * kGravity * 0.1 * 0.1 / (2 * 20000)).epsilon(0.05));
}

TEST_CASE("What hangs as nothing ever could that was free of stress is refused", "[body][unload]") {
  const Scene given = bar(R"("solid": {"young_pa": 150})", R"(, "reference_configuration": "loaded")");
  CHECK_THROWS_AS(unloaded(given.body, "bar.json: body.reference_configuration"), InputError);
  CHECK_THROWS_AS(read_scene(R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.1, 0.1, 0.1], "young_pa": 1000},
      "reference_configuration": "loaded"}})",
                             "a.json"),
                  InputError);
}

TEST_CASE("A ligament holds a body with its stiffness, shared by the nodes that it reaches", "[body][ligament]") {
  const auto ligament = [](const std::string& from, const std::string& radius, const std::string& to) {
    return R"({"from_m": )" + from + R"(, "radius_m": )" + radius + R"(, "to_m": )" + to +
           R"(, "stiffness_n_m": 50, "damping_n_s_m": 1})";
  };
  const auto block = [](const std::string& ligaments) {
    return read_scene(R"({"body": {"lattice": {"nodes": [3, 3, 3], "size_m": [0.04, 0.04, 0.04], "gravity_m_s2": [0, 0, -9.81],
        "solid": {"young_pa": 1e5}}, "ligaments": [)" +
                          ligaments + "]}}",
                      "block.json");
  };
  // A stiff block that hangs from its corners: m g / k.
  std::string corners;
  for (const char* corner : {"0, 0", "0.04, 0", "0, 0.04", "0.04, 0.04"})
    corners += (corners.empty() ? "" : ", ") +
               ligament(std::string("[") + corner + ", 0.04]", "0.001", std::string("[") + corner + ", 0.14]");
  const Scene scene = block(corners);
  const LumpedBody& body = scene.body;
  REQUIRE(body.nodes.size() == 31);
  CHECK(body.fixed.back() == 1);
  REQUIRE(body.elements.size() == 4);
  CHECK(body.elements[0].stiffness_n_m == 50);
  CHECK(body.elements[0].rest_length_m == Approx(0.1));
  const Dynamics dynamics(body);
  const Equilibrium hangs = find_equilibrium(dynamics);
  REQUIRE(hangs.found);
  const double mass_kg = 1000 * 0.04 * 0.04 * 0.04;
  CHECK(0.04 - hangs.state.x[3 * 18 + 2] == Approx(mass_kg * kGravity / 200).epsilon(0.01));

  const Scene shared = block(ligament("[0.02, 0.02, 0.04]", "0.0201", "[0.02, 0.02, 0.14]"));
  REQUIRE(shared.body.elements.size() == 6);  // the middle of the top and its four neighbours, and the one below
  for (const Element& e : shared.body.elements) CHECK(e.stiffness_n_m == Approx(50.0 / 6));
  try {
    block(ligament("[0.02, 0.02, 0.09]", "0.04", "[0, 0, 0.2]"));
    FAIL("accepted");
  } catch (const InputError& error) {
    CHECK(std::string(error.what()).find("body.ligaments[0] reaches no free node") != std::string::npos);
    CHECK(std::string(error.what()).find("more than 0.05 m") != std::string::npos);
  }
}
