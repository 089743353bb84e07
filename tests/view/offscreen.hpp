// A context to draw in without a display, where the machine has one.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <stdexcept>

#include "client/view/offscreen_context.hpp"

namespace palpate {

/// Nothing where EGL or a driver is missing; says so.
inline std::unique_ptr<OffscreenContext> context() {
  try {
    return std::make_unique<OffscreenContext>();
  } catch (const std::runtime_error& error) {
    WARN("skipped: " << error.what());
    return nullptr;
  }
}

}  // namespace palpate
