// A scene file as typed values, each with its line.
//
// The text is scanned as JSON, checked name by name and type by type against schema/scene.fbs, and then read by the FlatBuffers
// parser. The result has only known fields of the right type; ranges are checked later, with the members below.
#pragma once

#include <filesystem>
#include <memory>
#include <string>

#include "common/json/json.hpp"
#include "scene_generated.h"
#include "server/scene/scene.hpp"

namespace palpate {

class SceneText {
 public:
  /// Meshes must lie below the file's folder or one of `besides`.
  explicit SceneText(const std::filesystem::path& file, const MeshFolders& besides = {});
  /// Reads from memory; `file` is used in errors, and paths inside the scene are relative to it. Meshes must lie below one of
  /// `folders`.
  SceneText(const std::string& json, const std::filesystem::path& file, MeshFolders folders = {});

  /// Returns the text as a scene whose "body" is bodies[i]: paths that begin with it, and errors, are those of that body.
  SceneText of_member(std::size_t i) const;

  const schema::SceneT& values() const { return *values_; }
  const std::filesystem::path& file() const { return file_; }

  /// Paths look like "body.lattice.layers[1].below_z_m".
  bool has(const std::string& path) const;

  /// Returns "FILE:LINE" of a value, or of the innermost enclosing object if the value is absent.
  std::string where(const std::string& path) const;

  /// Throws: the value at `path` (or its absence) is not what was expected.
  [[noreturn]] void refuse(const std::string& path, const std::string& expected) const;
  /// Throws with `what` in place of the value.
  [[noreturn]] void refuse(const std::string& path, const std::string& what, const std::string& expected) const;

  /// Returns the file that the text at `path` names, in one of the folders for meshes.
  std::filesystem::path mesh_path(const std::string& path, const std::string& named) const;

  /// Refuses values outside [low, high]; `unit` may be empty.
  void in_range(const std::string& path, double value, double low, double high, const char* unit) const;

 private:
  const Json* find(const std::string& path, const Json** innermost = nullptr) const;
  /// Returns a path, or a text that begins with one, by the names of the file.
  std::string named(const std::string& path) const;

  std::filesystem::path file_;
  MeshFolders folders_;
  std::shared_ptr<const Json> root_;
  std::shared_ptr<const schema::SceneT> values_;
  std::string body_ = "body";  // what "body" is in the file
};

}  // namespace palpate
