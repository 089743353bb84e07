// A context for drawing without a display, if the machine has one.
#pragma once

#include <catch2/catch.hpp>
#include <memory>
#include <stdexcept>

#include "client/view/offscreen_context.hpp"

namespace palpate {

/// Returns nullptr, with a message, if EGL or a driver is missing.
inline std::unique_ptr<OffscreenContext> context() {
  try {
    return std::make_unique<OffscreenContext>();
  } catch (const std::runtime_error& error) {
    WARN("skipped: " << error.what());
    return nullptr;
  }
}

}  // namespace palpate
