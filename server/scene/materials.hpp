// Materials that a scene may name, each with where its numbers are from: the files of scenes/materials, built into the programs.
#pragma once

#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// Of what a scene or a file may say.
inline constexpr double kMinYoungPa = 1, kMaxYoungPa = 1e9, kMaxPoisson = 0.499, kMaxDampingS = 10;

struct NamedMaterial {
  std::string name, what, source;
  SolidMaterial solid;  ///< of slow motions
  std::vector<PronyBranch> relaxation;
  double young_low_pa = 0, young_high_pa = 0;  ///< what is found in the literature
  double density_kg_m3 = 0;
};

/// Gives a body whose materials are of slow motions its relaxation; they then are those of fast ones.
void set_relaxation(LumpedBody& body, const std::vector<PronyBranch>& relaxation);

/// Reads one file. Throws InputError with file, line and field.
NamedMaterial read_material(std::string_view text, const std::string& file);

/// All of them, by name.
const std::vector<NamedMaterial>& named_materials();
/// Null for none of this name.
const NamedMaterial* find_material(const std::string& name);

/// A line for each and one below it for its source.
std::string list_of_materials();

}  // namespace palpate
