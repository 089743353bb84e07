// Materials that a scene may name, each with the source of its figures: the files of scenes/materials, built into the programs.
#pragma once

#include <string>
#include <vector>

#include "server/scene/scene.hpp"

namespace palpate {

/// Ranges for scenes and material files.
inline constexpr double kMinYoungPa = 1, kMaxYoungPa = 1e9, kMaxPoisson = 0.499, kMaxDampingS = 10;

struct NamedMaterial {
  std::string name, what, source;
  SolidMaterial solid;  ///< for slow motions (relaxed)
  std::vector<PronyBranch> relaxation;
  double young_low_pa = 0, young_high_pa = 0;  ///< range in the literature
  double density_kg_m3 = 0;
};

/// Adds relaxation to a body. Its materials, given for slow motions, become those for fast motions.
void set_relaxation(LumpedBody& body, const std::vector<PronyBranch>& relaxation);

/// Reads one file. Throws InputError with file, line and field.
NamedMaterial read_material(std::string_view text, const std::string& file);

/// All named materials, sorted by name.
const std::vector<NamedMaterial>& named_materials();
/// Returns nullptr if there is none of this name.
const NamedMaterial* find_material(const std::string& name);

/// Lists each material in a line, with its source in the line below.
std::string list_of_materials();

}  // namespace palpate
