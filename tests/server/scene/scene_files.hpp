// Scene and mesh files written by the tests, in a folder that is removed at the end.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "server/scene/mesh_file.hpp"
#include "server/scene/scene.hpp"

namespace palpate::test {

class Folder {
 public:
  Folder();
  ~Folder();
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  std::filesystem::path write(const std::string& name, const std::string& text) const;
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// Message of the InputError thrown on loading this text; empty if it loads.
std::string error_of(const Folder& folder, const std::string& text);

/// Replaces the first `from` in the text; fails the test if there is none.
std::string replaced(std::string text, const std::string& from, const std::string& to);

/// A sphere of four-fold split icosahedron faces per level.
TriangleMesh icosphere(int levels, double radius_m);

std::string as_obj(const TriangleMesh& mesh, double scale = 1);
std::string as_ascii_stl(const TriangleMesh& mesh);

/// Volume of the tetrahedra of a body [m^3].
double volume(const LumpedBody& body);

/// The first example of the documentation: six nodes a side, a soft core.
extern const char* const kSoftCube;

}  // namespace palpate::test
