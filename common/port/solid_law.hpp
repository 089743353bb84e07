#pragma once

#include <cstdint>

namespace palpate {

/// Of a finite element (server/body/tetra_kernel.hpp).
enum class SolidLaw : std::uint8_t { corotational, neo_hookean };

}  // namespace palpate
