// Arbitrary bytes as an OBJ or STL file: an InputError, or triangles between existing vertices; and a closed surface has a finite
// distance to every point. The first byte selects the format.
#include <cstdlib>

#include "common/base/error.hpp"
#include "server/scene/mesh_file.hpp"
#include "server/scene/mesh_solid.hpp"
#include "server/scene/signed_distance.hpp"
#include "tests/fuzz/text_mutator.hpp"

using namespace palpate;

namespace {

const std::string kObj =
    "# a cube\no cube\nv 0 0 0\nv 0.1 0 0\nv 0.1 0.1 0\nv 0 0.1 0\nv 0 0 0.1\nv 0.1 0 0.1\nv 0.1 0.1 0.1\nv 0 0.1 0.1\n"
    "vn 0 0 1\nusemtl a\nf 4//1 3//1 2//1 1//1\nf 5 6 7 8\nf 1/1/1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf -5 -8 -4 -1\n";
const std::string kTetra[] = {"0 0 0", "0.1 0 0", "0 0.1 0", "0 0 0.1"};

std::string text_stl() {
  std::string out = "solid a\n";
  for (const auto& [a, b, c] : {Triangle{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}})
    out += "facet normal 0 0 0\nouter loop\nvertex " + kTetra[a] + "\nvertex " + kTetra[b] + "\nvertex " + kTetra[c] +
           "\nendloop\nendfacet\n";
  return out + "endsolid a\n";
}

std::string binary_stl() {
  std::string out(80, 'h');
  const auto append = [&](const auto& value) { out.append(reinterpret_cast<const char*>(&value), sizeof value); };
  append(std::uint32_t{4});
  for (const Triangle& t : {Triangle{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}) {
    for (int i = 0; i < 3; ++i) append(0.0f);
    for (const std::uint32_t corner : t)
      for (std::uint32_t axis = 1; axis <= 3; ++axis) append(corner == axis ? 0.1f : 0.0f);
    append(std::uint16_t{0});
  }
  return out;
}

const std::vector<std::string> kFiles{"o" + kObj, "t" + text_stl(), "t" + binary_stl()};
const std::vector<std::string_view> kWords{"v ",
                                           "f ",
                                           "\nf 1 2 3 4 5 6 7 8",
                                           "\nv 0.05 0.05 0.2",
                                           "\n",
                                           "\\\n",
                                           " -1",
                                           "/",
                                           "1e308",
                                           "1e-320",
                                           "nan",
                                           "0x1p3",
                                           "+0.1",
                                           "solid",
                                           "facet",
                                           "vertex 0 0 0\n",
                                           "endloop",
                                           "endfacet",
                                           "endsolid",
                                           "4294967295"};

void check(const TriangleMesh& mesh) {
  for (const Triangle& t : mesh.triangles)
    for (const std::uint32_t corner : t)
      if (corner >= mesh.vertices.size()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data + 1), size - 1);
  try {
    const TriangleMesh given = data[0] % 2 != 0 ? read_obj(bytes, "a.obj") : read_stl(bytes, "a.stl");
    check(given);
    if (given.triangles.size() > size) std::abort();
    MeshSettings settings;
    const TriangleMesh closed = closed_mesh(given, settings, "a mesh");
    check(closed);
    const auto solid = make_mesh_solid(closed);
    // The sign is not checked: a surface that crosses itself has no inside.
    for (const Vec3& point : {Vec3(solid->bounds().center()), Vec3(0, 0, 0), Vec3(9, 9, 9)})
      if (!std::isfinite(solid->distance(point)) || !solid->nearest(point).allFinite()) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  return test::mutate_text(data, size, max_size, seed, kFiles, kWords);
}
