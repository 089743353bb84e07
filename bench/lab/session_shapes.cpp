#include "bench/lab/session_shapes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <map>

#include "bench/output/output.hpp"
#include "server/scene/scene.hpp"

namespace palpate {
namespace {

static_assert(std::endian::native == std::endian::little, "both formats are written as numbers lie in memory");

constexpr Micros kStandsForLeast{2'000'000};  // time for which a shape is shown without a new one

template <class Number>
void append(std::string& bytes, Number number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

void append(std::string& bytes, const Vec3& v) {
  for (int k = 0; k < 3; ++k) append(bytes, static_cast<float>(v[k]));
}

std::string base64(const std::string& bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t group = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[group >> (18 - 6 * k) & 63] : '=';
  }
  return text;
}

/// A DataArray in VTK's inline binary form: the size as uint32 and the data, in base64.
std::string data_array(const char* type, const char* name, int components, const std::string& data) {
  std::string sized;
  append(sized, static_cast<std::uint32_t>(data.size()));
  return fmt::format("<DataArray type=\"{}\" Name=\"{}\" NumberOfComponents=\"{}\" format=\"binary\">{}</DataArray>\n", type,
                     name, components, base64(sized + data));
}

template <class Cells>
std::string cells(const char* what, const Cells& list) {
  std::string connectivity, offsets;
  std::int32_t offset = 0;
  for (const auto& cell : list) {
    for (const std::uint32_t vertex : cell) append(connectivity, static_cast<std::int32_t>(vertex));
    append(offsets, offset += static_cast<std::int32_t>(cell.size()));
  }
  return fmt::format("<{0}>\n{1}{2}</{0}>\n", what, data_array("Int32", "connectivity", 1, connectivity),
                     data_array("Int32", "offsets", 1, offsets));
}

}  // namespace

Edges edges_of(const RecordingHead& head) {
  Edges edges;
  if (!head.surface.triangles.empty() || head.scene.empty()) return edges;
  std::map<std::uint32_t, std::uint32_t> place;
  for (const std::uint32_t node : head.surface.nodes) place.emplace(node, static_cast<std::uint32_t>(place.size()));
  for (const Element& element : read_scene(head.scene, head.scene_file).body.elements)
    if (place.contains(element.a) && place.contains(element.b)) edges.push_back({place.at(element.a), place.at(element.b)});
  return edges;
}

void write_ply(const std::filesystem::path& file, const BodyMesh& mesh, const Edges& edges, const std::vector<Vec3>& positions) {
  std::string ply = fmt::format(
      "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property float displacement_x\nproperty float displacement_y\nproperty float displacement_z\nelement face {}\n"
      "property list uchar int vertex_indices\nelement edge {}\nproperty int vertex1\nproperty int vertex2\nend_header\n",
      positions.size(), mesh.triangles.size(), edges.size());
  for (std::size_t i = 0; i < positions.size(); ++i) {
    append(ply, positions[i]);
    append(ply, Vec3(positions[i] - mesh.vertices[i].rest));
  }
  for (const Triangle& triangle : mesh.triangles) {
    append(ply, std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) append(ply, static_cast<std::int32_t>(vertex));
  }
  for (const auto& edge : edges)
    for (const std::uint32_t vertex : edge) append(ply, static_cast<std::int32_t>(vertex));
  write_text(file, ply);
}

void write_vtp(const std::filesystem::path& file, const BodyMesh& mesh, const Edges& edges, const std::vector<Vec3>& positions) {
  std::string points, displacements;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    append(points, positions[i]);
    append(displacements, Vec3(positions[i] - mesh.vertices[i].rest));
  }
  std::string vtp =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" "
      "header_type=\"UInt32\">\n<PolyData>\n";
  vtp += fmt::format(
      "<Piece NumberOfPoints=\"{}\" NumberOfVerts=\"0\" NumberOfLines=\"{}\" NumberOfStrips=\"0\" NumberOfPolys=\"{}\">\n",
      positions.size(), edges.size(), mesh.triangles.size());
  vtp += "<PointData Vectors=\"displacement\">\n" + data_array("Float32", "displacement", 3, displacements) + "</PointData>\n";
  vtp += "<Points>\n" + data_array("Float32", "points", 3, points) + "</Points>\n";
  vtp += cells("Lines", edges) + cells("Polys", mesh.triangles);
  write_text(file, vtp + "</Piece>\n</PolyData>\n</VTKFile>\n");
}

namespace {

using Write = decltype(write_ply)*;

/// Writes the rigid parts, and returns the names of their files.
std::vector<std::string> export_parts(const std::vector<PartMesh>& parts, const std::filesystem::path& out, Write write,
                                      const char* extension) {
  std::vector<std::string> names;
  if (!parts.empty()) make_output_folder((out / "parts").string());
  for (const PartMesh& part : parts) {
    std::vector<Vec3> positions;
    for (const MeshVertex& vertex : part.mesh.vertices) positions.push_back(vertex.rest);
    names.push_back(fmt::format("parts/part_{:02}.{}", names.size() + 1, extension));
    write(out / names.back(), part.mesh, {}, positions);
  }
  return names;
}

std::string data_set(double t_s, std::size_t part, const std::string& file) {
  return fmt::format("<DataSet timestep=\"{:.6f}\" part=\"{}\" file=\"{}\"/>\n", t_s, part, file);
}

}  // namespace

std::size_t export_shapes(RecordingReader& recording, const std::filesystem::path& out, ShapeFormat format, double frames_hz) {
  const RecordingHead& head = recording.head();
  const Edges edges = edges_of(head);
  const bool vtk = format == ShapeFormat::vtk;
  const Write write = vtk ? write_vtp : write_ply;
  const char* const extension = vtk ? "vtp" : "ply";
  std::vector<std::string> parts;
  std::string series = "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\">\n<Collection>\n";
  const Micros stands_for = std::max(kStandsForLeast, head.shapes_hz > 0 ? from_seconds(2 / head.shapes_hz) : Micros{});
  std::size_t count = 0;
  for (std::size_t i = 0;; ++i) {
    const Micros t = recording.begin() + from_seconds(static_cast<double>(i) / frames_hz);
    if (t > recording.end()) break;
    const auto shape = recording.shape_at(t);
    // An empty room has no frames, however long: nothing is exported for unrecorded time.
    if (!shape || t > shape->t + stands_for) {
      const auto next = recording.next_shape(t);
      if (!next) break;
      i = std::max(i, static_cast<std::size_t>(std::ceil(seconds(*next - recording.begin()) * frames_hz)) - 1);
      continue;
    }
    const BodyMesh* const mesh = recording.mesh_of(*shape);
    if (!mesh) continue;
    if (count == 0) {
      make_output_folder((out / "shapes").string());
      parts = export_parts(head.parts, out, write, extension);
    }
    const std::string name = fmt::format("shapes/shape_{:05}.{}", count++, extension);
    write(out / name, *mesh, edges, shape->positions);
    series += data_set(seconds(t - recording.begin()), 0, name);
    for (std::size_t k = 0; k < parts.size(); ++k) series += data_set(seconds(t - recording.begin()), k + 1, parts[k]);
  }
  if (vtk && count > 0) write_text(out / "shapes.pvd", series + "</Collection>\n</VTKFile>\n");
  return count;
}

}  // namespace palpate
