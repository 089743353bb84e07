// Command-line flags for the material of the paper's specimens, shared by their experiments.
#pragma once

#include <cmath>
#include <utility>

#include "bench/paper/specimen.hpp"
#include "common/base/error.hpp"
#include "common/command_line/flags.hpp"

namespace palpate {

inline void add_material(CLI::App& command, Material& material) {
  command.add_option("--stiffness-n-m", material.stiffness_n_m, "of every element")->check(number_from(1e-6, 1e9));
  command.add_option("--damping-n-s-m", material.damping_n_s_m, "of every element")->check(number_from(1e-9, 1e6));
  command.add_option("--node-mass-kg", material.node_mass_kg, "of every node")->check(number_from(1e-12, 1e6));
}

/// Refuses "nan", which the command line accepts as a number in every range.
inline void refuse_nan(const Material& material) {
  for (const auto& [flag, value] : {std::pair{"--stiffness-n-m", material.stiffness_n_m},
                                    {"--damping-n-s-m", material.damping_n_s_m},
                                    {"--node-mass-kg", material.node_mass_kg}})
    if (std::isnan(value)) throw InputError(flag, "is nan", "a number");
}

}  // namespace palpate
