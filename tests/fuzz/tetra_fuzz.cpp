// Arbitrary text as a Gmsh or VTK file: an InputError, or a mesh of tetrahedra from which a body can be made. The first byte
// selects the format.
#include <cstdlib>

#include "common/base/error.hpp"
#include "server/scene/tetra_file.hpp"
#include "tests/fuzz/text_mutator.hpp"

using namespace palpate;

namespace {

const std::string kNodes = "1 0 0 0\n2 0.1 0 0\n3 0 0.1 0\n4 0 0 0.1\n5 0.1 0.1 0.1\n";
const std::string kPoints = "0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n0.1 0.1 0.1\n";
const std::vector<std::string> kFiles{
    "m$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n" + kNodes +
        "$EndNodes\n$Elements\n3\n1 2 2 1 1 1 2 3\n2 4 2 7 1 1 2 3 4\n3 4 1 8 2 3 4 5\n$EndElements\n",
    "m$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n1 0 0 1\n1 0 0 0 0\n1 0 0 0 1 1 1 1 7 0\n$EndEntities\n$Nodes\n1 5 1 5\n3 "
    "1 0 5\n1\n2\n3\n4\n5\n" +
        kPoints + "$EndNodes\n$Elements\n2 3 1 3\n2 1 2 1\n1 1 2 3\n3 1 4 2\n2 1 2 3 4\n3 2 3 4 5\n$EndElements\n",
    "v# vtk DataFile Version 3.0\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n" + kPoints +
        "CELLS 2 10\n4 0 1 2 3\n4 1 2 3 4\nCELL_TYPES 2\n10\n10\nCELL_DATA 2\nSCALARS region int 1\nLOOKUP_TABLE default\n1\n2\n",
    "v# vtk DataFile Version 5.1\na\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 double\n" + kPoints +
        "CELLS 3 8\nOFFSETS vtktypeint64\n0 4 8\nCONNECTIVITY vtktypeint64\n0 1 2 3 1 2 3 4\nCELL_TYPES 2\n10\n10\n"};
const std::vector<std::string_view> kWords{
    "$Nodes\n",       "$Elements\n", "$Entities\n", "$EndNodes\n", "2.2 0 8",       "4.1 0 8",
    "POINTS ",        "CELLS ",      "CELL_TYPES ", "OFFSETS ",    "CONNECTIVITY ", "SCALARS region int 1\n",
    "1000000 ",       "4000000 ",    "2000000000 ", "-1 ",         "1e308 ",        "nan ",
    "1099511627776 ", "0 ",          "1 2 3 4\n",   "10\n"};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data + 1), size - 1);
  const MeshSettings settings;
  try {
    const TetraMesh mesh = tetra_mesh(text, data[0] % 2 != 0 ? TetraFormat::gmsh : TetraFormat::vtk, settings, "a mesh");
    if (mesh.vertices.size() > size || mesh.cells.size() > size) std::abort();
    for (const Vec3& x : mesh.vertices)
      if (!x.allFinite() || x.cwiseAbs().maxCoeff() > kMaxCoordinateM) std::abort();
    for (const Tetrahedron& t : mesh.cells) {
      for (const std::uint32_t node : t.nodes)
        if (node >= mesh.vertices.size()) std::abort();
      if (!(volume_of(t, mesh.vertices) > 0)) std::abort();
    }
    for (const Triangle& face : outer_faces(mesh.cells))
      for (const std::uint32_t corner : face)
        if (corner >= mesh.vertices.size()) std::abort();
  } catch (const InputError&) {
  }
  return 0;
}

extern "C" std::size_t LLVMFuzzerCustomMutator(std::uint8_t* data, std::size_t size, std::size_t max_size, unsigned seed) {
  return test::mutate_text(data, size, max_size, seed, kFiles, kWords);
}
