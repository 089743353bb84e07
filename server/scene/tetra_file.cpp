#include "server/scene/tetra_file.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "common/base/error.hpp"
#include "common/base/in_quotes.hpp"
#include "common/file/read_file.hpp"
#include "common/json/json.hpp"
#include "server/scene/signed_distance.hpp"
#include "server/scene/words.hpp"

namespace palpate {
namespace {

constexpr std::size_t kMaxVertices = 1'000'000, kMaxCells = 4'000'000, kMaxTag = std::size_t{1} << 40;
constexpr std::size_t kMaxFileBytes = std::size_t{1} << 30;
constexpr const char* kGmshExpected = "version 2.2 or 4.1 (gmsh -format msh41)";

// Kinds of cells by their number in a file; cells with nodes on edges and faces list their corners first.
const std::map<int, CellKind> kGmshKinds = {{4, CellKind::tetrahedron}, {11, CellKind::tetrahedron}, {5, CellKind::hexahedron},
                                            {12, CellKind::hexahedron}, {17, CellKind::hexahedron},  {6, CellKind::prism},
                                            {13, CellKind::prism},      {18, CellKind::prism},       {7, CellKind::pyramid},
                                            {14, CellKind::pyramid},    {19, CellKind::pyramid}};
constexpr int kVtkVoxel = 11;
const std::map<int, CellKind> kVtkKinds = {
    {10, CellKind::tetrahedron}, {24, CellKind::tetrahedron}, {12, CellKind::hexahedron}, {kVtkVoxel, CellKind::hexahedron},
    {25, CellKind::hexahedron},  {29, CellKind::hexahedron},  {13, CellKind::prism},      {26, CellKind::prism},
    {32, CellKind::prism},       {14, CellKind::pyramid},     {27, CellKind::pyramid}};

std::size_t corners_of(CellKind kind) { return static_cast<std::size_t>(kind); }

Vec3 point(Words& in) {
  const double x = in.number(), y = in.number(), z = in.number();
  return {x, y, z};
}

/// Reads a .msh file, whose nodes have tags that cells refer to.
class GmshReader {
 public:
  explicit GmshReader(Words& in) : in_(in) {}

  TetraMesh read() {
    std::string_view word;
    while (in_.next(word)) {
      if (word == "$NOD") in_.fail("version 1 of the Gmsh format", kGmshExpected);
      if (word == "$MeshFormat") read_format();
      if ((word == "$Nodes" || word == "$Elements") && version_ == 0)
        in_.fail(in_quotes(word) + " before $MeshFormat", kGmshExpected);
      if (word == "$Entities") read_entities();
      if (word == "$Nodes") version_ < 4 ? read_nodes_2() : read_nodes_4();
      if (word == "$Elements") version_ < 4 ? read_elements_2() : read_elements_4();
    }
    return std::move(mesh_);
  }

 private:
  void read_format() {
    version_ = in_.number();
    if (version_ != 2.2 && version_ != 4.1)
      in_.fail("version " + Json::number(version_).text + " of the Gmsh format", kGmshExpected);
    if (in_.whole() != 0) in_.fail("a binary file", "a text file (Gmsh: Mesh.Binary = 0)");
  }
  void add_node(std::size_t tag, const Vec3& x) {
    number_[tag] = static_cast<std::uint32_t>(mesh_.vertices.size());
    mesh_.vertices.push_back(x);
  }
  /// Reads the cell's nodes up to the end of its line.
  void read_cell(CellKind kind, int region) {
    std::array<std::uint32_t, 8> nodes{};
    for (std::size_t i = 0; i < corners_of(kind); ++i) {
      const auto found = number_.find(in_.index(kMaxTag));
      if (found == number_.end()) in_.fail("an element names a node that is not there", "a tag of $Nodes");
      nodes[i] = found->second;
    }
    if (region < 0) in_.fail("a region " + std::to_string(region), "a number from 0 on");
    add_cell(kind, std::span(nodes).first(corners_of(kind)), static_cast<std::uint32_t>(region), mesh_.cells);
    in_.skip_line();
  }

  void read_nodes_2() {
    for (auto n = in_.count(kMaxVertices); n > 0; --n) {
      const auto tag = in_.index(kMaxTag);
      add_node(tag, point(in_));
    }
  }
  void read_elements_2() {
    for (auto n = in_.count(kMaxCells); n > 0; --n) {
      in_.word();
      const int type = in_.whole();
      int region = 0;
      const auto tags = in_.count(64);
      for (std::size_t i = 0; i < tags; ++i) {
        const int tag = in_.whole();
        if (i == 0) region = tag;
      }
      const auto kind = kGmshKinds.find(type);
      if (kind != kGmshKinds.end())
        read_cell(kind->second, region);
      else
        in_.skip_line();
    }
  }

  /// Reads the physical groups of volumes: the first of each.
  void read_entities() {
    const auto points = in_.count(kMaxCells), curves = in_.count(kMaxCells), surfaces = in_.count(kMaxCells),
               volumes = in_.count(kMaxCells);
    for (std::size_t i = 0; i < points; ++i) {
      in_.skip(4);
      in_.skip(in_.count(64));
    }
    for (std::size_t i = 0; i < curves + surfaces + volumes; ++i) {
      const int tag = in_.whole();
      in_.skip(6);
      const auto groups = in_.count(64);
      for (std::size_t g = 0; g < groups; ++g) {
        const int group = in_.whole();
        if (g == 0 && i >= curves + surfaces) region_of_volume_[tag] = group;
      }
      in_.skip(in_.count(kMaxCells));  // bounding surfaces
    }
  }
  void read_nodes_4() {
    const auto blocks = in_.count(kMaxCells);
    in_.skip(3);
    for (std::size_t b = 0; b < blocks; ++b) {
      in_.skip(2);
      if (in_.whole() != 0) in_.fail("parametric nodes", "plain ones (Gmsh: Mesh.SaveParametric = 0)");
      std::vector<std::size_t> tags(in_.count(kMaxVertices));
      for (auto& tag : tags) tag = in_.index(kMaxTag);
      for (const auto tag : tags) add_node(tag, point(in_));
      if (mesh_.vertices.size() > kMaxVertices) in_.fail("too many nodes", "at most 1000000");
    }
  }
  void read_elements_4() {
    const auto blocks = in_.count(kMaxCells);
    in_.skip(3);
    for (std::size_t b = 0; b < blocks; ++b) {
      in_.skip(1);
      const int entity = in_.whole();
      const auto kind = kGmshKinds.find(in_.whole());
      const auto n = in_.count(kMaxCells);
      const auto region = region_of_volume_.find(entity);
      in_.skip_line();
      for (std::size_t i = 0; i < n; ++i) {
        if (kind == kGmshKinds.end()) {
          in_.skip_line();
          continue;
        }
        in_.word();
        read_cell(kind->second, region == region_of_volume_.end() ? 0 : region->second);
      }
    }
  }

  Words& in_;
  double version_ = 0;
  TetraMesh mesh_;
  // Ordered instead of hashed, as tags could be chosen that share a hash.
  std::map<std::size_t, std::uint32_t> number_;
  std::map<int, int> region_of_volume_;
};

class VtkReader {
 public:
  explicit VtkReader(Words& in) : in_(in) {}

  TetraMesh read() {
    in_.skip(4);  // "# vtk DataFile Version"
    version_ = in_.number();
    in_.skip_line();
    in_.skip_line();  // a title
    if (const auto kind = in_.word(); kind != "ASCII") in_.fail("a " + in_quotes(kind) + " file", "ASCII (a text file)");
    std::string_view word;
    while (in_.next(word)) {
      if (word == "DATASET" && in_.word() != "UNSTRUCTURED_GRID") in_.fail("another data set", "UNSTRUCTURED_GRID");
      if (word == "POINTS") read_points();
      if (word == "CELLS") read_cells();
      if (word == "CELL_TYPES") read_types();
      if (word == "CELL_DATA") cell_data_ = true;
      if (word == "POINT_DATA") cell_data_ = false;
      if (word == "SCALARS") read_scalars();
      if (word == "FIELD") read_field();
    }
    return tetrahedra();
  }

 private:
  void read_points() {
    const auto n = in_.count(kMaxVertices);
    in_.word();  // float or double
    for (std::size_t i = 0; i < n; ++i) mesh_.vertices.push_back(point(in_));
  }
  /// Reads "COUNT n0 n1 ..." per cell; from version 5 on two lists, OFFSETS and CONNECTIVITY.
  void read_cells() {
    if (version_ >= 5) return read_cells_5();
    const auto n = in_.count(kMaxCells);
    in_.word();
    for (std::size_t i = 0; i < n; ++i) cells_.push_back(numbers(in_.count(1000)));
  }
  void read_cells_5() {
    const auto offsets = in_.count(kMaxCells), nodes = in_.count(16 * kMaxCells);
    in_.skip(2);
    const auto begin = numbers(offsets);
    in_.skip(2);
    const auto all = numbers(nodes);
    for (std::size_t i = 0; i + 1 < begin.size(); ++i) {
      if (begin[i] > begin[i + 1] || begin[i + 1] > all.size()) in_.fail("OFFSETS that do not grow", "a list into CONNECTIVITY");
      cells_.emplace_back(all.begin() + static_cast<std::ptrdiff_t>(begin[i]),
                          all.begin() + static_cast<std::ptrdiff_t>(begin[i + 1]));
    }
  }
  std::vector<std::size_t> numbers(std::size_t n) {
    std::vector<std::size_t> list(n);
    for (auto& value : list) value = in_.index(16 * kMaxCells);
    return list;
  }
  void read_types() {
    types_.resize(in_.count(kMaxCells));
    for (int& type : types_) type = in_.whole();
  }
  void read_scalars() {
    const auto name = in_.word();
    in_.skip_line();
    if (!cell_data_ || !names_regions(name)) return;
    in_.skip(2);  // LOOKUP_TABLE default
    read_regions();
  }
  /// Reads "FIELD name COUNT", then arrays "name components tuples type" with their numbers.
  void read_field() {
    in_.word();
    for (auto arrays = in_.count(1000); arrays > 0; --arrays) {
      const std::string_view name = in_.word();
      if (name == "METADATA") {  // belongs to the array before; ends with an empty line, so at the next name
        in_.skip_line();
        ++arrays;
        skip_metadata();
        continue;
      }
      const auto components = in_.count(1000), tuples = in_.count(16 * kMaxCells);
      const std::string_view type = in_.word();
      if (cell_data_ && names_regions(name) && components == 1 && tuples == cells_.size())
        read_regions();
      else if (type == "string")
        for (std::size_t i = 0; i < tuples; ++i) in_.skip_line();
      else
        in_.skip(components * tuples);
    }
  }
  /// Skips to the next empty line.
  void skip_metadata() {
    std::string_view word;
    while (in_.next_on_line(word)) in_.skip_line();
    in_.skip_line();
  }
  /// Returns true for the cell data of regions: by this project's name, by that of meshio and by Gmsh's own.
  static bool names_regions(std::string_view name) {
    return name == "region" || name == "gmsh:physical" || name == "CellEntityIds";
  }
  void read_regions() {
    regions_.clear();
    for (std::size_t i = 0; i < cells_.size(); ++i) regions_.push_back(in_.whole());
  }
  TetraMesh tetrahedra() {
    if (types_.size() != cells_.size()) in_.fail("CELL_TYPES of another number than CELLS", "one a cell");
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (const auto kind = kVtkKinds.find(types_[i]); kind != kVtkKinds.end()) take_cell(i, kind->second);
    return std::move(mesh_);
  }
  void take_cell(std::size_t i, CellKind kind) {
    const std::size_t corners = corners_of(kind);
    if (cells_[i].size() < corners)
      in_.fail("a cell of " + std::to_string(cells_[i].size()) + " nodes", std::to_string(corners) + " corners");
    std::array<std::uint32_t, 8> nodes{};
    for (std::size_t n = 0; n < corners; ++n) {
      if (cells_[i][n] >= mesh_.vertices.size()) in_.fail("a cell names a point that is not there", "one of POINTS");
      nodes[n] = static_cast<std::uint32_t>(cells_[i][n]);
    }
    if (types_[i] == kVtkVoxel) {  // a voxel orders its corners by their coordinates
      std::swap(nodes[2], nodes[3]);
      std::swap(nodes[6], nodes[7]);
    }
    add_cell(kind, std::span(nodes).first(corners), regions_.empty() ? 0 : static_cast<std::uint32_t>(std::max(0, regions_[i])),
             mesh_.cells);
  }

  Words& in_;
  TetraMesh mesh_;
  std::vector<std::vector<std::size_t>> cells_;
  std::vector<int> types_, regions_;
  bool cell_data_ = false;
  double version_ = 0;
};

}  // namespace

TetraMesh read_tetra_mesh(const MeshSettings& settings, const std::string& where) {
  const auto ending = settings.path.extension();
  if (ending != ".msh" && ending != ".vtk")
    throw InputError(where, "is not a mesh of tetrahedra by its name", "FILE.msh or FILE.vtk");
  const std::string text = read_plain_file(settings.path, where, "a .msh or .vtk file", kMaxFileBytes);
  return tetra_mesh(text, ending == ".msh" ? TetraFormat::gmsh : TetraFormat::vtk, settings, where);
}

TetraMesh tetra_mesh(std::string_view text, TetraFormat format, const MeshSettings& settings, const std::string& where) {
  Words in(text, where);
  TetraMesh mesh = format == TetraFormat::gmsh ? GmshReader(in).read() : VtkReader(in).read();
  if (mesh.cells.empty()) throw InputError(where, "holds no tetrahedra", "cells of four nodes");
  const Mat3 turn = settings.scale * rotation_xyz(settings.rotation_deg);
  for (Vec3& v : mesh.vertices) v = turn * v + settings.offset_m;
  check_mesh(mesh, where);
  return mesh;
}

}  // namespace palpate
